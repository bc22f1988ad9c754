"""Section 4.33: the torque limits: for all three commands with 0x25 on, and for none without."""

import pytest

from unit.sim.desk import FREE, Desk

TORQUE_CW, TORQUE_CCW = 1 << 12, 1 << 13


@pytest.mark.states("B91", "B54")
@pytest.mark.parametrize(("name", "raw"), [("0x00", 900), ("0x01", 50), ("0x02", 90)])
def test_torque_limits_hold_for_all_three_commands(name: str, raw: int) -> None:
    desk = Desk(rom=FREE | {"torque_limit_cw": 25})
    desk.servo.conditions.load_pct = -25.0
    desk.wait(0.1)
    desk.write(name, raw)
    desk.wait(0.5)
    assert desk.read("0x0A") == pytest.approx(25, abs=1)
    assert (desk.read("0x19") or 0) & TORQUE_CW


@pytest.mark.states("B91", "B54")
@pytest.mark.parametrize(("name", "raw"), [("0x00", -900), ("0x01", -50), ("0x02", -90)])
def test_and_on_the_other_side(name: str, raw: int) -> None:
    desk = Desk(rom=FREE | {"torque_limit_ccw": -35}).under(load_pct=35.0)
    desk.write(name, raw)
    desk.wait(0.5)
    assert desk.read("0x0A") == pytest.approx(-35, abs=1)
    assert (desk.read("0x19") or 0) & TORQUE_CCW
    desk.under(load_pct=0.0)
    desk.write("0x00", 0)
    desk.settle()
    assert desk.read("0x19") == 0


@pytest.mark.states("B91")
def test_torque_limits_do_nothing_without_0x25() -> None:
    desk = Desk(rom=FREE | {"speed_torque_control": 0, "torque_limit_ccw": -10})
    desk.servo.conditions.load_pct = 60.0
    desk.wait(0.5)
    assert (desk.read("0x0A") or 0) < -50
    assert not (desk.read("0x19") or 0) & TORQUE_CCW


@pytest.mark.states("B91")
def test_a_load_beyond_the_limit_turns_the_horn_away() -> None:
    for limit, holds in ((30, True), (10, False)):
        desk = Desk(rom=FREE | {"torque_limit_cw": limit}).under(load_pct=-20.0)
        desk.write("0x00", 0)
        desk.wait(1.0)
        assert (abs(desk.servo.angle_deg) < 1) is holds
