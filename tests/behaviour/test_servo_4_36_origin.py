"""Section 4.36: the origin moves the zero of commands, readings and soft start."""

import pytest

from hornbill.sim.behaviour import Behaviour
from unit.sim.desk import FREE, Desk


@pytest.mark.states("B94", "B66")
def test_the_origin_moves_0_degrees() -> None:
    desk = Desk(rom={"origin": 450, "timeout_action": 0})
    desk.settle()
    assert desk.read("0x08") == pytest.approx(0, abs=3)
    assert desk.servo.angle_deg == pytest.approx(45.0, abs=0.4)


@pytest.mark.states("B94")
@pytest.mark.parametrize(("reverse", "horn"), [(0, 55.0), (1, -55.0)])
def test_commands_count_from_it_in_the_direction_of_the_servo(reverse: int, horn: float) -> None:
    desk = Desk(rom=FREE | {"origin": 450, "reverse": reverse})
    desk.write("0x00", 100)
    desk.settle()
    assert desk.servo.angle_deg == pytest.approx(horn, abs=0.4)


@pytest.mark.states("B94")
def test_setting_it_changes_the_reading_and_moves_nothing_without_output() -> None:
    desk = Desk(rom=FREE | {"torque_mode": 1}, angle_deg=60.0)
    assert desk.read("0x08") == 600
    assert desk.write("0x44", 450) == 450
    assert desk.read("0x08") == 150
    desk.wait(1.0)
    assert desk.servo.angle_deg == 60.0


@pytest.mark.states("B94", "B33")
@pytest.mark.parametrize(("origin", "reading"), [(0, -1_750), (-1_800, 50), (1_799, 51)])
def test_at_power_on_readings_stay_within_a_turn_around_it(origin: int, reading: int) -> None:
    assert Desk(rom=FREE | {"origin": origin}, angle_deg=185.0).read("0x08") == reading


@pytest.mark.states("B94")
@pytest.mark.switch("limits_follow_origin")
@pytest.mark.parametrize(("follow", "horn"), [(True, 75.0), (False, 30.0)])
def test_the_limits_move_with_it_or_stay_where_they_were_on_the_horn(follow: bool, horn: float) -> None:
    rom = FREE | {"origin": 450, "angle_limit_cw": 300}
    desk = Desk(rom=rom, behaviour=Behaviour(limits_follow_origin=follow))
    desk.write("0x00", 1_200)
    desk.settle()
    assert desk.servo.angle_deg == pytest.approx(horn, abs=0.4)
    assert desk.read("0x19") == 1 << 8
