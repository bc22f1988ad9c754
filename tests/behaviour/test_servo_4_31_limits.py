"""Sections 4.31 to 4.33: limits of angle, speed and torque: what they hold back, when they do not, and their bits."""

import pytest

from unit.sim.desk import Desk

FREE = {"speed_torque_control": 1, "timeout_action": 0, "soft_start": 0}
ANGLE_CW, ANGLE_CCW, SPEED_CW, SPEED_CCW, TORQUE_CW, TORQUE_CCW = (1 << bit for bit in range(8, 14))


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


def test_angle_limits_hold_without_0x25_too() -> None:
    desk = Desk(rom=FREE | {"speed_torque_control": 0, "angle_limit_cw": 300})
    desk.write("0x00", 900)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(300, abs=3)


def test_angle_limits_do_not_stop_a_speed_or_a_torque() -> None:
    for name in ("0x01", "0x02"):
        desk = Desk(rom=FREE | {"angle_limit_cw": 300, "extended_angle": 1})
        desk.write(name, 30)
        desk.wait(3.0)
        assert (desk.read("0x08") or 0) > 1_000


def test_a_narrower_limit_moves_a_horn_that_stands_outside() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x00", 900)
    desk.settle()
    desk.write("0x38", 500)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(500, abs=3)


@pytest.mark.parametrize(("rpm", "held", "bit"), [(100, 40, SPEED_CW), (-100, -30, SPEED_CCW)])
def test_a_speed_beyond_its_limit_is_held_at_it(rpm: int, held: int, bit: int) -> None:
    desk = Desk(rom=FREE | {"speed_limit_cw": 40, "speed_limit_ccw": -30})
    desk.write("0x01", rpm)
    desk.wait(1.0)
    assert desk.read("0x09") == pytest.approx(held, abs=1)
    assert (desk.read("0x19") or 0) & bit


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


@pytest.mark.parametrize(("name", "raw"), [("0x00", 900), ("0x01", 50), ("0x02", 90)])
def test_torque_limits_hold_for_all_three_commands(name: str, raw: int) -> None:
    desk = Desk(rom=FREE | {"torque_limit_cw": 25})
    desk.servo.conditions.load_pct = -25.0
    desk.wait(0.1)
    desk.write(name, raw)
    desk.wait(0.5)
    assert desk.read("0x0A") == pytest.approx(25, abs=1)
    assert (desk.read("0x19") or 0) & TORQUE_CW


def test_torque_limits_do_nothing_without_0x25() -> None:
    desk = Desk(rom=FREE | {"speed_torque_control": 0, "torque_limit_ccw": -10})
    desk.servo.conditions.load_pct = 60.0
    desk.wait(0.5)
    assert (desk.read("0x0A") or 0) < -50
    assert not (desk.read("0x19") or 0) & TORQUE_CCW
