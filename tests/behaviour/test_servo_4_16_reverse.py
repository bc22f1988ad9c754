"""Section 4.16: reverse turns round commands and readings alike."""

import pytest

from hornbill.wire.messages import CommandType
from unit.sim.desk import FREE, Desk


@pytest.mark.states("B70")
def test_reverse_turns_command_and_readings_round() -> None:
    desk = Desk(rom=FREE | {"reverse": 1})
    desk.write("0x00", 450)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(450, abs=3)
    assert desk.servo.angle_deg == pytest.approx(-45.0, abs=0.4)
    desk.write("0x01", 60)
    desk.wait(1.0)
    assert desk.read("0x09") == pytest.approx(60, abs=1)
    assert desk.servo.speed_rpm == pytest.approx(-60, abs=1)


@pytest.mark.states("B70")
def test_a_torque_pushes_the_other_way_and_reads_as_commanded() -> None:
    desk = Desk(rom=FREE | {"reverse": 1}).under(load_pct=30.0)
    desk.write("0x02", 30)
    desk.wait(0.3)
    assert desk.read("0x0A") == 30
    desk.under(load_pct=0.0).wait(0.3)
    assert desk.servo.speed_rpm < -20


@pytest.mark.states("B70", "B27")
def test_the_bus_sees_it_like_the_registers() -> None:
    desk = Desk(rom=FREE | {"reverse": 1})
    desk.array(7, CommandType.POSITION, 0.5)
    desk.settle()
    assert desk.servo.angle_deg == pytest.approx(-50.0, abs=0.4)
    assert desk.statuses(desk.wait(0.2))[-1].position == pytest.approx(0.5, abs=0.005)


@pytest.mark.states("B70")
def test_turning_the_direction_round_only_changes_the_sign_of_the_reading() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 100)
    while desk.servo.angle_deg < 3_590:
        desk.wait(0.01)
    desk.write("0x01", 0)
    desk.wait(0.5)
    desk.write("0x20", 1)
    desk.write("0x00", 0)
    before = desk.read("0x08") or 0
    desk.write("0x23", 1)
    assert desk.read("0x08") == -before
    desk.write("0x23", 0)
    assert desk.read("0x08") == before


@pytest.mark.states("B70", "B90")
def test_reverse_swaps_which_way_the_limits_point() -> None:
    desk = Desk(rom=FREE | {"reverse": 1, "speed_limit_cw": 20, "speed_limit_ccw": -80})
    for rpm, held in ((100, 20), (-100, -80)):
        desk.write("0x01", rpm)
        desk.wait(1.0)
        assert desk.read("0x09") == pytest.approx(held, abs=1)


@pytest.mark.states("B70", "B31")
@pytest.mark.parametrize(("target", "held", "bit"), [(900, 300, 8), (-900, -200, 9)])
def test_angle_limits_keep_the_sign_of_commands(target: int, held: int, bit: int) -> None:
    desk = Desk(rom=FREE | {"reverse": 1, "angle_limit_cw": 300, "angle_limit_ccw": -200})
    desk.write("0x00", target)
    desk.settle()
    assert desk.read("0x08") == pytest.approx(held, abs=3)
    assert desk.servo.angle_deg == pytest.approx(-held / 10, abs=0.4)
    assert desk.read("0x19") == 1 << bit


@pytest.mark.states("B70", "B91")
def test_torque_limits_keep_the_sign_of_commands() -> None:
    desk = Desk(rom=FREE | {"reverse": 1, "torque_limit_cw": 20, "torque_limit_ccw": -60})
    for percent, held in ((100, 20), (-100, -60)):
        desk.under(load_pct=held)
        desk.write("0x02", percent)
        desk.wait(0.3)
        assert desk.read("0x0A") == pytest.approx(held, abs=1)
