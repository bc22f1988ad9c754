"""Sections 4.31 to 4.33 and 4.36: limits of angle, speed and torque, when they apply, and the origin."""

import pytest

from behaviour.servo_story import Rom, Steps, between, follow, go, near, refused, stories, turned, under
from unit.sim.desk import FREE, Desk
from unit.sim.response import watch

ANGLE_CW, ANGLE_CCW, SPEED_CW, SPEED_CCW, TORQUE_CW, TORQUE_CCW = (1 << bit for bit in range(8, 14))
ON, OFF, BRAKE = 0, 1, 2
WITHIN = {"angle_limit_cw": 300, "angle_limit_ccw": -200}


@pytest.mark.states("B31", "B54", "B88", "B89", "B90", "B91", "B94")
@stories({
    **{f"B31, B54: an angle beyond its limit goes to the limit and sets the bit, {target}, 0x25 {cascade}": (
        WITHIN | {"speed_torque_control": cascade}, [
            ("0x00", target, 0), {"0x19": bit}, Desk.settle, {"0x08": near(limit), "0x00": target, "0x19": bit},
            go(0), {"0x19": 0},
    ]) for target, limit, bit in ((900, 300, ANGLE_CW), (-900, -200, ANGLE_CCW)) for cascade in (0, 1)},
    "B31: the bit is set exactly at the limit": (
        {"angle_limit_cw": 300, "angle_dead_band": 0, "angle_p_gain": 100, "torque_mode": OFF},
        [turned(29.9), {"0x08": 299, "0x19": 0}, turned(30.0), {"0x08": 300, "0x19": ANGLE_CW}],
    ),
    "B31: a narrower limit moves a horn outside it": ({}, [
        go(900), ("0x38", 500, 0), Desk.settle, {"0x08": near(500)},
    ]),
    **{f"B88: angle limits do not apply to {name}": (
        {"angle_limit_cw": 300, "extended_angle": 1}, [(name, 30, 3.0), {"0x08": between(1_001, 100_000)}],
    ) for name in ("0x01", "0x02")},
    **{f"B89: torque on outside the limits holds there until the next command, {mode}, {command}": (WITHIN, [
        ("0x20", mode, 0), turned(60.0), ("0x20", ON, 2.0), {"0x00": 600, "0x19": ANGLE_CW, "0x08": near(600)},
        under(load_pct=-20.0), 1.0, {"0x08": near(600, 6)}, under(load_pct=0.0), go(command), {"0x08": near(ends_at)},
    ]) for mode in (OFF, BRAKE) for command, ends_at in ((900, 300), (600, 300), (-900, -200), (100, 100))},
    **{f"B90: a speed of 0 is a limit on its side only, {rpm}": ({"speed_limit_cw": 0}, [
        ("0x01", rpm, 1.0), {"0x09": near(reached, 1), "0x01": rpm, "0x19": bit},
    ]) for rpm, reached, bit in ((60, 0, SPEED_CW), (-60, -60, 0))},
    **{f"B54, B90: a speed is limited on its side, {rpm}": ({"speed_limit_cw": 40, "speed_limit_ccw": -30}, [
        ("0x01", rpm, 1.0), {"0x09": near(reached, 1), "0x01": rpm, "0x19": bit},
        ("0x01", reached // 2, 1.0), {"0x19": 0},
    ]) for rpm, reached, bit in ((100, 40, SPEED_CW), (-100, -30, SPEED_CCW))},
    "B91: a load below the torque limit is held": ({"torque_limit_cw": 30}, [
        under(load_pct=-20.0), ("0x00", 0, 1.0), {"angle_deg": near(0, 0.99)},
    ]),
    "B91: a load above the torque limit turns the horn": ({"torque_limit_cw": 10}, [
        under(load_pct=-20.0), ("0x00", 0, 1.0), {"angle_deg": between(-10_000, -1)},
    ]),
    **{f"B94: readings are relative to the origin, reverse {reverse}": (
        {"soft_start": 1, "speed_torque_control": 0, "origin": 450, "reverse": reverse}, [
            Desk.settle, {"0x08": near(0), "angle_deg": near(rest, 0.4)}, go(100), {"angle_deg": near(angle, 0.4)},
    ]) for reverse, rest, angle in ((0, 45.0, 55.0), (1, -45.0, -55.0))},
    "B94: writing the origin changes the reading and moves nothing without output": ({"torque_mode": OFF}, [
        turned(60.0), {"0x08": 600}, ("0x44", 450, 0), {"0x08": 150}, 1.0, {"angle_deg": 60.0},
    ]),
})  # fmt: skip
def test_limits_and_origin(rom: Rom, steps: Steps) -> None:
    follow(Desk(rom=FREE | rom), *steps)


@pytest.mark.states("B87")
def test_0_is_always_within_the_angle_limits() -> None:
    desk = Desk(rom=FREE)
    follow(desk, refused("0x38", -1), ("0x38", 0, 0), refused("0x39", 1), ("0x39", 0, 0))
    for target in (900, -900):
        follow(desk, go(target), {"0x08": near(0)})


@pytest.mark.states("B89")
@pytest.mark.parametrize("mode", [OFF, BRAKE])
def test_without_output_a_horn_turned_outside_the_limits_stays_there(mode: int) -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 300})
    follow(desk, ("0x20", mode, 0), under(load_pct=15.0), 1.0, under(load_pct=0.0), 1.0)
    there = desk.value("0x08")
    assert there > 400
    follow(desk, 5.0, {"0x08": there, "0x19": ANGLE_CW, "output": mode})


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


@pytest.mark.states("B91", "B54")
@pytest.mark.parametrize(("sign", "limit", "bit"), [(1, 25, TORQUE_CW), (-1, -35, TORQUE_CCW)])
@pytest.mark.parametrize(("name", "raw"), [("0x00", 900), ("0x01", 50), ("0x02", 90)])
def test_torque_limits_apply_to_all_three_commands(name: str, raw: int, sign: int, limit: int, bit: int) -> None:
    desk = Desk(rom=FREE | {"torque_limit_cw": 25, "torque_limit_ccw": -35}).under(load_pct=-limit)
    follow(desk, (name, raw * sign, 0.5), {"0x0A": near(limit, 1)})
    assert desk.value("0x19") & bit
    follow(desk, under(load_pct=0.0), go(0), {"0x19": 0})


@pytest.mark.states("B91")
def test_torque_limits_do_not_apply_without_0x25() -> None:
    desk = Desk(rom=FREE | {"speed_torque_control": 0, "torque_limit_ccw": -10})
    desk.servo.conditions.load_pct = 60.0
    desk.wait(0.5)
    assert desk.value("0x0A") < -50
    assert not desk.value("0x19") & TORQUE_CCW


@pytest.mark.states("B94", "B33")
@pytest.mark.parametrize(("origin", "reading"), [(0, -1_750), (-1_800, 50), (1_799, 51)])
def test_at_power_on_readings_are_within_a_turn_around_the_origin(origin: int, reading: int) -> None:
    assert Desk(rom=FREE | {"origin": origin}, angle_deg=185.0).read("0x08") == reading
