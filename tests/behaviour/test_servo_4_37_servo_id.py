"""Section 4.37: the servo id: which commands are for it, from when on, and what 0 means."""

import pytest

from hornbill.wire.messages import ActuatorCommand, ArrayCommand, CommandType
from unit.sim.desk import Desk

POSITION = CommandType.POSITION


@pytest.mark.states("B95", "B28")
@pytest.mark.parametrize("servo_id", [0, 1, 127, 254])
def test_every_id_from_0_to_254_can_be_had_and_holds_at_once(servo_id: int) -> None:
    desk = Desk(servo_id=7)
    assert desk.write("0x45", servo_id) == servo_id
    assert desk.statuses(desk.wait(0.2))[-1].actuator_id == servo_id
    desk.array(servo_id, POSITION, 0.5)
    assert desk.read("0x00") == 500


@pytest.mark.states("B95")
@pytest.mark.parametrize("servo_id", [-1, 255, 256])
def test_no_other_can(servo_id: int) -> None:
    desk = Desk(servo_id=7)
    assert desk.write("0x45", servo_id) is None
    assert desk.read("0x45") == 7


@pytest.mark.states("B95")
def test_it_is_lost_at_power_off_unless_saved() -> None:
    desk = Desk(servo_id=7)
    desk.write("0x45", 8)
    desk.power_cycle()
    assert desk.read("0x45") == 7
    desk.write("0x45", 8)
    desk.write("0x12", 1)
    desk.wait(0.3)
    desk.power_cycle()
    assert desk.read("0x45") == 8


@pytest.mark.states("B21", "B95")
def test_two_servos_of_one_id_both_obey() -> None:
    one, other = Desk(node_id=20, servo_id=9), Desk(node_id=21, servo_id=9)
    for desk in (one, other):
        desk.send(ArrayCommand((ActuatorCommand(3, POSITION, 0.1), ActuatorCommand(9, POSITION, 0.5))))
        assert desk.read("0x00") == 500


@pytest.mark.states("B22")
def test_as_delivered_it_is_0_and_no_other_but_255_reaches_it() -> None:
    desk = Desk(servo_id=0)
    assert desk.read("0x45") == 0
    for other in range(1, 255):
        desk.array(other, POSITION, 0.5)
    assert desk.read("0x00") == 0
    desk.array(255, POSITION, 0.5)
    assert desk.read("0x00") == 500
