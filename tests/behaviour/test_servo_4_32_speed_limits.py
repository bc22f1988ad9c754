"""Section 4.32: the speed limits: for angles and speeds with 0x25 on, and for nothing else."""

import pytest

from unit.sim.desk import FREE, Desk
from unit.sim.response import watch

SPEED_CW, SPEED_CCW = 1 << 10, 1 << 11


@pytest.mark.states("B90", "B54")
@pytest.mark.parametrize(("rpm", "held", "bit"), [(100, 40, SPEED_CW), (-100, -30, SPEED_CCW)])
def test_a_speed_beyond_its_limit_is_held_at_it(rpm: int, held: int, bit: int) -> None:
    desk = Desk(rom=FREE | {"speed_limit_cw": 40, "speed_limit_ccw": -30})
    desk.write("0x01", rpm)
    desk.wait(1.0)
    assert desk.read("0x09") == pytest.approx(held, abs=1)
    assert desk.read("0x01") == rpm
    assert (desk.read("0x19") or 0) & bit
    desk.write("0x01", held // 2)
    desk.wait(1.0)
    assert not (desk.read("0x19") or 0) & bit


@pytest.mark.states("B90")
def test_speed_limits_hold_for_angles_but_not_for_torque_and_not_without_0x25() -> None:
    def fastest(cascade: int, name: str, raw: int) -> int:
        desk = Desk(rom=FREE | {"speed_limit_cw": 20, "speed_torque_control": cascade, "extended_angle": 1})
        desk.write(name, raw)
        best = 0
        for _ in range(50):
            desk.wait(0.01)
            best = max(best, desk.read("0x09") or 0)
        return best

    assert fastest(1, "0x00", 900) <= 21
    assert fastest(1, "0x02", 50) > 40
    assert fastest(0, "0x00", 900) > 40


@pytest.mark.states("B90", "B54")
def test_an_angle_that_is_held_back_says_so_on_its_way() -> None:
    desk = Desk(rom=FREE | {"speed_limit_cw": 20})
    desk.write("0x00", 900)
    desk.wait(0.3)
    assert (desk.read("0x19") or 0) & SPEED_CW
    desk.settle()
    assert desk.read("0x19") == 0


@pytest.mark.states("B90")
def test_the_two_sides_are_apart() -> None:
    desk = Desk(rom=FREE | {"speed_limit_cw": 20, "speed_limit_ccw": -80})
    desk.write("0x00", 600)
    assert max(watch(desk, "0x09", 1.5)) <= 21
    desk.write("0x00", 0)
    assert min(watch(desk, "0x09", 1.0)) == pytest.approx(-80, abs=3)


@pytest.mark.states("B90")
def test_a_limit_of_0_lets_nothing_turn_that_way() -> None:
    desk = Desk(rom=FREE | {"speed_limit_cw": 0})
    desk.write("0x01", 60)
    desk.wait(1.0)
    assert desk.read("0x09") == 0
    desk.write("0x01", -60)
    desk.wait(1.0)
    assert desk.read("0x09") == pytest.approx(-60, abs=1)


@pytest.mark.states("B104")
@pytest.mark.parametrize("model", ["BLA15-06U-A0", "BLA15-12U-A0"])
def test_a_bla15_takes_limits_of_300_and_commands_of_150(model: str) -> None:
    desk = Desk(model, rom=FREE)
    assert (desk.write("0x3A", 300), desk.write("0x3B", -300)) == (300, -300)
    assert (desk.write("0x3A", 301), desk.write("0x3B", -301)) == (None, None)
    assert (desk.write("0x01", 150), desk.write("0x01", -150)) == (150, -150)
    assert (desk.write("0x01", 151), desk.write("0x01", -151)) == (None, None)
