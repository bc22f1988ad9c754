"""Section 4.17: turns made by speed or torque, and the meaning of 0° after them."""

import pytest

from behaviour.servo_story import follow, go, near
from unit.sim.desk import FREE, Desk


@pytest.mark.states("B71", "B39")
@pytest.mark.parametrize(("name", "raw"), [("0x01", 100), ("0x02", 20)])
@pytest.mark.parametrize("extended", [0, 1])
def test_ten_turns_are_discarded_without_it_and_undone_by_0_degrees_with_it(extended: int, name: str, raw: int) -> None:
    desk = Desk(rom=FREE | {"extended_angle": extended})
    desk.write(name, raw)
    readings: list[int] = []
    while desk.servo.angle_deg < 3_590:
        desk.wait(0.01)
        readings.append(desk.value("0x08"))
    assert (readings == sorted(readings)) is bool(extended)
    assert max(readings) > 35_000 if extended else max(readings) <= 1_799 and min(readings) >= -1_800
    desk.run("0x01", 0, 0.5)
    assert 3_580 < desk.servo.angle_deg < 3_700
    assert (desk.value("0x08") > 35_000) is bool(extended)
    desk.go(0, 10.0)
    assert desk.servo.angle_deg == pytest.approx(0 if extended else 3_600, abs=0.4)


@pytest.mark.states("B71")
def test_turns_between_angle_commands_are_counted_without_it() -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 36_000})
    for target in (7_200, 3_600, 0):
        follow(desk, go(target), {"angle_deg": near(target / 10, 0.4)})
