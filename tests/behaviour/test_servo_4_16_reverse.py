"""Section 4.16: reverse changes the sign of commands and readings alike."""

import pytest

from behaviour.servo_story import follow, go, near, under
from hornbill.wire.messages import CommandType
from unit.sim.desk import FREE, Desk

REVERSED = FREE | {"reverse": 1}


@pytest.mark.states("B70", "B27")
def test_commands_and_readings_are_reversed_on_the_bus_as_in_the_registers() -> None:
    desk = Desk(rom=REVERSED)
    follow(desk, go(450), {"0x08": near(450), "angle_deg": near(-45.0, 0.4)})
    desk.array(7, CommandType.POSITION, 0.5)
    follow(desk, Desk.settle, {"angle_deg": near(-50.0, 0.4)})
    assert desk.statuses(desk.wait(0.2))[-1].position == pytest.approx(0.5, abs=0.005)
    follow(desk, ("0x01", 60, 1.0), {"0x09": near(60, 1), "speed_rpm": near(-60, 1)})


@pytest.mark.states("B70")
def test_a_torque_is_reversed_and_reads_as_commanded() -> None:
    desk = Desk(rom=REVERSED)
    follow(desk, under(load_pct=30.0), ("0x02", 30, 0.3), {"0x0A": 30}, under(load_pct=0.0), 0.3)
    assert desk.servo.speed_rpm < -20


@pytest.mark.states("B70")
def test_writing_it_changes_only_the_sign_of_the_reading() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 100)
    while desk.servo.angle_deg < 3_590:
        desk.wait(0.01)
    follow(desk, ("0x01", 0, 0.5), ("0x20", 1, 0), ("0x00", 0, 0))
    before = desk.value("0x08")
    follow(desk, ("0x23", 1, 0), {"0x08": -before}, ("0x23", 0, 0), {"0x08": before})


LIMITS = {
    "angle_limit_cw": 300, "angle_limit_ccw": -200, "speed_limit_cw": 20, "speed_limit_ccw": -80,
    "torque_limit_cw": 30, "torque_limit_ccw": -60,
}  # fmt: skip


@pytest.mark.states("B70", "B31", "B90", "B91")
@pytest.mark.parametrize(
    ("name", "raw", "reading", "limit", "bit"),
    [
        ("0x00", 900, "0x08", 300, 8), ("0x00", -900, "0x08", -200, 9), ("0x01", 100, "0x09", 20, 10),
        ("0x01", -100, "0x09", -80, 11), ("0x02", 100, "0x0A", 30, 12), ("0x02", -100, "0x0A", -60, 13),
    ],
)  # fmt: skip
def test_limits_keep_the_sign_of_commands(name: str, raw: int, reading: str, limit: int, bit: int) -> None:
    desk = Desk(rom=REVERSED | LIMITS).under(load_pct=limit if name == "0x02" else 0.0)
    desk.run(name, raw, 0.3 if name == "0x02" else 1.5)
    assert desk.read(reading) == pytest.approx(limit, abs=3 if name == "0x00" else 1)
    assert desk.value("0x19") & 1 << bit
