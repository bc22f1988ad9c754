"""Section 4.31: the angle limits: what they hold back, when they do not, and the cautions about torque on and off."""

import pytest

from unit.sim.desk import FREE, Desk

ANGLE_CW, ANGLE_CCW = 1 << 8, 1 << 9
ON, OFF, BRAKE = 0, 1, 2


@pytest.mark.states("B31", "B54")
@pytest.mark.parametrize(("target", "held", "bit"), [(900, 300, ANGLE_CW), (-900, -200, ANGLE_CCW)])
def test_an_angle_beyond_its_limit_goes_to_the_limit_and_says_so(target: int, held: int, bit: int) -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 300, "angle_limit_ccw": -200})
    assert desk.write("0x00", target) == target
    assert desk.read("0x19") == bit
    desk.settle()
    assert desk.read("0x08") == pytest.approx(held, abs=3)
    assert desk.read("0x00") == target
    assert desk.read("0x19") == bit
    desk.write("0x00", 0)
    desk.settle()
    assert desk.read("0x19") == 0


@pytest.mark.states("B31")
def test_angle_limits_hold_without_0x25_too() -> None:
    desk = Desk(rom=FREE | {"speed_torque_control": 0, "angle_limit_cw": 300})
    desk.write("0x00", 900)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(300, abs=3)


@pytest.mark.states("B31")
def test_at_the_limit_itself_it_is_notified() -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 300, "angle_dead_band": 0, "angle_p_gain": 100, "torque_mode": 1})
    desk.servo.turn_manually(29.9, desk.now)
    assert (desk.read("0x08"), desk.read("0x19")) == (299, 0)
    desk.servo.turn_manually(30.0, desk.now)
    assert (desk.read("0x08"), desk.read("0x19")) == (300, ANGLE_CW)


@pytest.mark.states("B87")
@pytest.mark.parametrize(("name", "wrong", "right"), [("0x38", -1, 0), ("0x39", 1, 0)])
def test_0_is_always_inside(name: str, wrong: int, right: int) -> None:
    desk = Desk(rom=FREE)
    assert (desk.write(name, wrong), desk.write(name, right)) == (None, right)


@pytest.mark.states("B87")
def test_with_both_at_0_the_horn_stays_at_0() -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 0, "angle_limit_ccw": 0})
    for target in (900, -900):
        desk.write("0x00", target)
        desk.settle()
        assert desk.read("0x08") == pytest.approx(0, abs=3)


@pytest.mark.states("B88")
def test_angle_limits_do_not_stop_a_speed_or_a_torque() -> None:
    for name in ("0x01", "0x02"):
        desk = Desk(rom=FREE | {"angle_limit_cw": 300, "extended_angle": 1})
        desk.write(name, 30)
        desk.wait(3.0)
        assert (desk.read("0x08") or 0) > 1_000


@pytest.mark.states("B31")
def test_a_narrower_limit_moves_a_horn_that_stands_outside() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x00", 900)
    desk.settle()
    desk.write("0x38", 500)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(500, abs=3)


@pytest.mark.states("B89")
@pytest.mark.parametrize("mode", [OFF, BRAKE])
def test_without_output_nothing_pulls_a_horn_back_that_is_turned_out(mode: int) -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 300})
    desk.write("0x20", mode)
    desk.under(load_pct=15.0).wait(1.0)
    desk.under(load_pct=0.0).wait(1.0)
    there = desk.read("0x08") or 0
    assert there > 400
    desk.wait(5.0)
    assert (desk.read("0x08"), desk.servo.output) == (there, mode)
    assert desk.read("0x19") == ANGLE_CW


@pytest.mark.states("B89")
@pytest.mark.parametrize("mode", [OFF, BRAKE])
def test_output_that_comes_back_there_holds_there(mode: int) -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 300})
    desk.write("0x20", mode)
    desk.servo.turn_manually(60.0, desk.now)
    desk.write("0x20", ON)
    desk.wait(2.0)
    assert (desk.read("0x00"), desk.read("0x19")) == (600, ANGLE_CW)
    assert desk.read("0x08") == pytest.approx(600, abs=3)
    desk.under(load_pct=-20.0).wait(1.0)
    assert desk.read("0x08") == pytest.approx(600, abs=6)


@pytest.mark.states("B89")
@pytest.mark.parametrize(("next_command", "ends_at"), [(900, 300), (600, 300), (-900, -200), (100, 100)])
def test_the_next_command_from_there_goes_to_the_nearest_angle_inside(next_command: int, ends_at: int) -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 300, "angle_limit_ccw": -200})
    desk.write("0x20", OFF)
    desk.servo.turn_manually(60.0, desk.now)
    desk.write("0x20", ON)
    desk.wait(0.5)
    desk.write("0x00", next_command)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(ends_at, abs=3)
