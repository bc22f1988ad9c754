"""Sections 4.31 to 4.33 and 4.36: limits of angle, speed and torque, when they apply, and the origin."""

import pytest

from unit.sim.desk import FREE, Desk
from unit.sim.response import watch

ANGLE_CW, ANGLE_CCW, SPEED_CW, SPEED_CCW, TORQUE_CW, TORQUE_CCW = (1 << bit for bit in range(8, 14))
ON, OFF, BRAKE = 0, 1, 2
WITHIN = {"angle_limit_cw": 300, "angle_limit_ccw": -200}


@pytest.mark.states("B31", "B54")
@pytest.mark.parametrize("cascade", [0, 1])
@pytest.mark.parametrize(("target", "limit", "bit"), [(900, 300, ANGLE_CW), (-900, -200, ANGLE_CCW)])
def test_an_angle_beyond_its_limit_goes_to_the_limit_and_sets_the_bit(
    target: int, limit: int, bit: int, cascade: int
) -> None:
    desk = Desk(rom=FREE | WITHIN | {"speed_torque_control": cascade})
    assert desk.write("0x00", target) == target
    assert desk.read("0x19") == bit
    desk.settle()
    assert desk.read("0x08") == pytest.approx(limit, abs=3)
    assert desk.reads("0x00", "0x19") == [target, bit]
    desk.go(0)
    assert desk.read("0x19") == 0


@pytest.mark.states("B31")
def test_the_bit_is_set_exactly_at_the_limit() -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 300, "angle_dead_band": 0, "angle_p_gain": 100, "torque_mode": OFF})
    for degrees, bit in ((29.9, 0), (30.0, ANGLE_CW)):
        desk.turn(degrees)
        assert desk.reads("0x08", "0x19") == [round(degrees * 10), bit]


@pytest.mark.states("B87")
def test_0_is_always_within_the_angle_limits() -> None:
    desk = Desk(rom=FREE)
    for name, wrong in (("0x38", -1), ("0x39", 1)):
        assert (desk.write(name, wrong), desk.write(name, 0)) == (None, 0)
    for target in (900, -900):
        desk.go(target)
        assert desk.read("0x08") == pytest.approx(0, abs=3)


@pytest.mark.states("B88")
@pytest.mark.parametrize("name", ["0x01", "0x02"])
def test_angle_limits_do_not_apply_to_a_speed_or_torque(name: str) -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 300, "extended_angle": 1})
    desk.run(name, 30, 3.0)
    assert desk.value("0x08") > 1_000


@pytest.mark.states("B31")
def test_a_narrower_limit_moves_a_horn_outside_it() -> None:
    desk = Desk(rom=FREE)
    desk.go(900)
    desk.write("0x38", 500)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(500, abs=3)


@pytest.mark.states("B89")
@pytest.mark.parametrize("mode", [OFF, BRAKE])
def test_without_output_a_horn_turned_outside_the_limits_stays_there(mode: int) -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 300})
    desk.write("0x20", mode)
    desk.under(load_pct=15.0).wait(1.0)
    desk.under(load_pct=0.0).wait(1.0)
    there = desk.value("0x08")
    assert there > 400
    desk.wait(5.0)
    assert (desk.reads("0x08", "0x19"), desk.servo.output) == ([there, ANGLE_CW], mode)


@pytest.mark.states("B89")
@pytest.mark.parametrize("mode", [OFF, BRAKE])
@pytest.mark.parametrize(("next_command", "ends_at"), [(900, 300), (600, 300), (-900, -200), (100, 100)])
def test_torque_on_outside_the_limits_holds_there_until_the_next_command(
    next_command: int, ends_at: int, mode: int
) -> None:
    desk = Desk(rom=FREE | WITHIN)
    desk.write("0x20", mode)
    desk.turn(60.0)
    desk.run("0x20", ON, 2.0)
    assert desk.reads("0x00", "0x19") == [600, ANGLE_CW]
    assert desk.read("0x08") == pytest.approx(600, abs=3)
    desk.under(load_pct=-20.0).wait(1.0)
    assert desk.read("0x08") == pytest.approx(600, abs=6)
    desk.under(load_pct=0.0)
    desk.go(next_command)
    assert desk.read("0x08") == pytest.approx(ends_at, abs=3)


# Speed.


@pytest.mark.states("B90", "B54")
@pytest.mark.parametrize(
    ("limits", "rpm", "reached", "bit"),
    [
        ({"speed_limit_cw": 40, "speed_limit_ccw": -30}, 100, 40, SPEED_CW),
        ({"speed_limit_cw": 40, "speed_limit_ccw": -30}, -100, -30, SPEED_CCW),
        ({"speed_limit_cw": 0}, 60, 0, SPEED_CW),
        ({"speed_limit_cw": 0}, -60, -60, 0),
    ],
)
def test_a_speed_is_limited_on_its_side(limits: dict[str, int], rpm: int, reached: int, bit: int) -> None:
    desk = Desk(rom=FREE | limits)
    desk.run("0x01", rpm, 1.0)
    assert desk.read("0x09") == pytest.approx(reached, abs=1)
    assert desk.read("0x01") == rpm
    assert desk.value("0x19") & bit == bit
    if limits["speed_limit_cw"]:
        desk.run("0x01", reached // 2, 1.0)
        assert not desk.value("0x19") & bit


@pytest.mark.states("B90", "B54")
def test_speed_limits_apply_to_angles_but_not_to_a_torque_nor_without_0x25() -> None:
    def desk_with(cascade: int, **rom: int) -> Desk:
        limits = {"speed_limit_cw": 20, "speed_limit_ccw": -80}
        return Desk(rom=FREE | limits | {"speed_torque_control": cascade} | rom)

    desk = desk_with(1)
    desk.run("0x00", 600, 0.3)
    assert desk.value("0x19") & SPEED_CW
    assert max(watch(desk, "0x09", 1.2)) <= 21
    assert desk.read("0x19") == 0
    desk.write("0x00", 0)
    assert min(watch(desk, "0x09", 1.0)) == pytest.approx(-80, abs=3)
    for cascade, name, raw in ((1, "0x02", 50), (0, "0x00", 900)):
        desk = desk_with(cascade, extended_angle=1)
        desk.write(name, raw)
        assert max(watch(desk, "0x09", 0.5)) > 40


@pytest.mark.states("B104")
@pytest.mark.parametrize("model", ["BLA15-06U-A0", "BLA15-12U-A0"])
def test_a_bla15_accepts_limits_of_300_and_commands_of_150(model: str) -> None:
    desk = Desk(model, rom=FREE)
    assert (desk.write("0x3A", 300), desk.write("0x3B", -300)) == (300, -300)
    assert (desk.write("0x3A", 301), desk.write("0x3B", -301)) == (None, None)
    assert (desk.write("0x01", 150), desk.write("0x01", -150)) == (150, -150)
    assert (desk.write("0x01", 151), desk.write("0x01", -151)) == (None, None)


# Torque.


@pytest.mark.states("B91", "B54")
@pytest.mark.parametrize(("sign", "limit", "bit"), [(1, 25, TORQUE_CW), (-1, -35, TORQUE_CCW)])
@pytest.mark.parametrize(("name", "raw"), [("0x00", 900), ("0x01", 50), ("0x02", 90)])
def test_torque_limits_apply_to_all_three_commands(name: str, raw: int, sign: int, limit: int, bit: int) -> None:
    desk = Desk(rom=FREE | {"torque_limit_cw": 25, "torque_limit_ccw": -35}).under(load_pct=-limit)
    desk.run(name, raw * sign, 0.5)
    assert desk.read("0x0A") == pytest.approx(limit, abs=1)
    assert desk.value("0x19") & bit
    desk.under(load_pct=0.0)
    desk.go(0)
    assert desk.read("0x19") == 0


@pytest.mark.states("B91")
def test_torque_limits_do_not_apply_without_0x25() -> None:
    desk = Desk(rom=FREE | {"speed_torque_control": 0, "torque_limit_ccw": -10})
    desk.servo.conditions.load_pct = 60.0
    desk.wait(0.5)
    assert desk.value("0x0A") < -50
    assert not desk.value("0x19") & TORQUE_CCW


@pytest.mark.states("B91")
@pytest.mark.parametrize(("limit", "holds"), [(30, True), (10, False)])
def test_a_load_above_the_torque_limit_turns_the_horn(limit: int, holds: bool) -> None:
    desk = Desk(rom=FREE | {"torque_limit_cw": limit}).under(load_pct=-20.0)
    desk.run("0x00", 0, 1.0)
    assert (abs(desk.servo.angle_deg) < 1) is holds


# The origin.


@pytest.mark.states("B94", "B66")
@pytest.mark.parametrize(("reverse", "rest", "angle"), [(0, 45.0, 55.0), (1, -45.0, -55.0)])
def test_commands_readings_and_soft_start_are_relative_to_the_origin(reverse: int, rest: float, angle: float) -> None:
    desk = Desk(rom={"origin": 450, "timeout_action": 0, "reverse": reverse})
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)
    assert desk.servo.angle_deg == pytest.approx(rest, abs=0.4)
    desk.go(100)
    assert desk.servo.angle_deg == pytest.approx(angle, abs=0.4)


@pytest.mark.states("B94")
def test_writing_the_origin_changes_the_reading_and_moves_nothing_without_output() -> None:
    desk = Desk(rom=FREE | {"torque_mode": OFF}, angle_deg=60.0)
    assert desk.read("0x08") == 600
    assert desk.write("0x44", 450) == 450
    assert desk.read("0x08") == 150
    desk.wait(1.0)
    assert desk.servo.angle_deg == 60.0


@pytest.mark.states("B94", "B33")
@pytest.mark.parametrize(("origin", "reading"), [(0, -1_750), (-1_800, 50), (1_799, 51)])
def test_at_power_on_readings_are_within_a_turn_around_the_origin(origin: int, reading: int) -> None:
    assert Desk(rom=FREE | {"origin": origin}, angle_deg=185.0).read("0x08") == reading
