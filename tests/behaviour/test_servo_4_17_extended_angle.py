"""Section 4.17: ten turns by speed or torque, and what 0° means then."""

import pytest

from unit.sim.desk import FREE, Desk


def turned_ten_times(extended: int, name: str = "0x01", raw: int = 100) -> Desk:
    desk = Desk(rom=FREE | {"extended_angle": extended})
    desk.write(name, raw)
    while desk.servo.angle_deg < 3_590:
        desk.wait(0.01)
    desk.write("0x01", 0)
    desk.wait(0.5)
    assert 3_580 < desk.servo.angle_deg < 3_700
    return desk


@pytest.mark.states("B71", "B39")
def test_without_extended_angle_ten_turns_are_forgotten() -> None:
    desk = turned_ten_times(0)
    assert -1_800 <= (desk.read("0x08") or 0) <= 1_799
    desk.write("0x00", 0)
    desk.settle()
    assert desk.servo.angle_deg == pytest.approx(3_600, abs=0.4)


@pytest.mark.states("B71", "B39")
def test_with_extended_angle_0_degrees_unwinds_them() -> None:
    desk = turned_ten_times(1)
    assert (desk.read("0x08") or 0) > 35_000
    desk.write("0x00", 0)
    desk.settle(10.0)
    assert desk.servo.angle_deg == pytest.approx(0, abs=0.4)


@pytest.mark.states("B71")
@pytest.mark.parametrize(("extended", "ends_at"), [(0, 3_600.0), (1, 0.0)])
def test_turns_by_torque_are_treated_alike(extended: int, ends_at: float) -> None:
    desk = turned_ten_times(extended, "0x02", 20)
    desk.write("0x00", 0)
    desk.settle(10.0)
    assert desk.servo.angle_deg == pytest.approx(ends_at, abs=0.4)


@pytest.mark.states("B71", "B39")
def test_the_reading_jumps_from_179_9_to_minus_180_0_without_and_goes_on_with_it() -> None:
    for extended in (0, 1):
        desk = Desk(rom=FREE | {"extended_angle": extended})
        desk.write("0x01", 60)
        readings: list[int] = []
        while desk.servo.angle_deg < 300:
            desk.wait(0.005)
            readings.append(desk.read("0x08") or 0)
        assert (readings == sorted(readings)) is bool(extended)
        assert max(readings) > 2_900 if extended else max(readings) <= 1_799 and min(readings) >= -1_800


@pytest.mark.states("B71")
def test_between_angle_commands_turns_are_kept_whatever_0x24_says() -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 36_000})
    for target in (7_200, 3_600, 0):
        desk.write("0x00", target)
        desk.settle()
        assert desk.servo.angle_deg == pytest.approx(target / 10, abs=0.4)
