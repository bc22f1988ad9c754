"""Sections 4.5 and 4.6: speed and torque can be read whatever the servo is doing."""

import pytest

from unit.sim.desk import FREE, Desk


@pytest.mark.states("B40")
def test_0_to_0x0c_are_readable_with_speed_torque_control_off() -> None:
    desk = Desk(rom={"timeout_action": 0})
    desk.write("0x00", 1_500)
    desk.wait(0.15)
    assert (desk.read("0x09") or 0) > 50
    assert desk.read("0x0A") is not None


@pytest.mark.states("B40")
@pytest.mark.parametrize(("name", "raw"), [("0x00", 1_700), ("0x01", 80), ("0x02", 20)])
def test_speed_is_what_the_horn_does_under_every_kind_of_command(name: str, raw: int) -> None:
    desk = Desk(rom=FREE)
    desk.write(name, raw)
    desk.wait(0.12)
    assert (desk.read("0x09") or 0) > 20
    assert desk.read("0x09") == pytest.approx(desk.servo.speed_rpm, abs=0.6)


@pytest.mark.states("B40")
@pytest.mark.parametrize("cascade", [0, 1])
@pytest.mark.parametrize("load_pct", [-45.0, 45.0])
def test_torque_is_what_it_takes_to_hold_a_load(load_pct: float, cascade: int) -> None:
    desk = Desk(rom=FREE | {"speed_torque_control": cascade})
    desk.write("0x00", 0)
    desk.under(load_pct=load_pct).wait(2.0)
    assert desk.read("0x0A") == pytest.approx(-load_pct, abs=4)


@pytest.mark.states("B40")
def test_both_read_without_output_too() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 100)
    desk.wait(1.0)
    desk.write("0x20", 1)
    desk.wait(0.02)
    assert (desk.read("0x09") or 0) > 30
    desk.wait(2.0)
    assert (desk.read("0x09"), desk.read("0x0A")) == (0, 0)


@pytest.mark.states("B40")
def test_neither_leaves_the_range_of_its_register() -> None:
    desk = Desk(rom=FREE, behaviour=None).under(load_pct=500.0)
    desk.write("0x02", 100)
    desk.wait(1.0)
    assert desk.servo.speed_rpm > 300
    assert desk.read("0x09") == 300
    assert abs(desk.read("0x0A") or 0) <= 150
