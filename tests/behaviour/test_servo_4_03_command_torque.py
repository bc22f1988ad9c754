"""Section 4.3: the torque command: a share of the greatest torque, as much as supply and load let it be."""

import pytest

from hornbill.schema.parameter import DUMMY
from unit.sim.desk import FREE, Desk


@pytest.mark.states("B38")
def test_a_torque_pushes_as_hard_as_it_is_told_against_a_load() -> None:
    desk = Desk(rom=FREE)
    desk.servo.conditions.load_pct = -40.0
    desk.write("0x02", 40)
    desk.wait(1.0)
    assert desk.read("0x0A") == 40
    assert desk.read("0x09") == 0


@pytest.mark.states("B38")
@pytest.mark.parametrize("percent", [5, -30, 31, 75, -100])
def test_what_is_pushed_is_what_was_commanded(percent: int) -> None:
    desk = Desk(rom=FREE).under(load_pct=-percent)
    desk.write("0x02", percent)
    desk.wait(0.3)
    assert desk.read("0x0A") == percent


@pytest.mark.states("B38")
def test_a_horn_without_load_turns_and_turns_faster_under_more_torque() -> None:
    speeds: list[int] = []
    for percent in (10, 20, 30):
        desk = Desk(rom=FREE)
        desk.write("0x02", percent)
        desk.wait(2.0)
        speeds.append(desk.read("0x09") or 0)
    assert 0 < speeds[0] < speeds[1] < speeds[2]


@pytest.mark.states("B38")
@pytest.mark.parametrize(("volts", "lifts"), [(7.4, True), (5.0, False)])
def test_100_percent_needs_the_nominal_supply(volts: float, lifts: bool) -> None:
    desk = Desk(rom=FREE).under(load_pct=-80.0, voltage_v=volts)
    began = desk.servo.angle_deg
    desk.write("0x02", 100)
    desk.wait(0.5)
    assert (desk.servo.angle_deg > began) is lifts


@pytest.mark.states("B32")
@pytest.mark.parametrize("between", ["0x00", "0x01"])
def test_the_same_torque_entered_again_after_another_kind_pushes_again(between: str) -> None:
    desk = Desk(rom=FREE | {"angle_limit_cw": 360_000_000}).under(load_pct=-25.0)
    desk.write("0x02", 25)
    desk.write(between, 0)
    assert desk.read("0x02") == DUMMY
    desk.wait(0.5)
    assert desk.write("0x02", 25) == 25
    desk.wait(0.3)
    assert desk.read("0x0A") == 25
