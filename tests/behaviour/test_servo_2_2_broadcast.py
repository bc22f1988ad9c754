"""Section 2.2 and tables 2-17 to 2-22: what a servo says unasked, how often, at which priority, in which unit."""

from itertools import pairwise
from math import radians

import pytest

from hornbill.sim.behaviour import Behaviour, PositionUnit
from hornbill.wire.messages import Mode, NodeHealth
from hornbill.wire.transfer import Transfer
from unit.sim.desk import FREE, NODE, Desk

NODE_STATUS, STATUS = 341, 1011


def of_type(transfers: list[Transfer], type_id: int) -> list[Transfer]:
    return [transfer for transfer in transfers if transfer.type_id == type_id]


@pytest.mark.states("B17", "B27")
def test_node_status_every_second_and_status_every_100_ms() -> None:
    desk = Desk()
    heard = desk.wait(10.0)
    for type_id, period, count in ((NODE_STATUS, 1.0, 10), (STATUS, 0.1, 100)):
        sent = of_type(heard, type_id)
        assert abs(len(sent) - count) <= 1
        assert all(later.at - earlier.at == pytest.approx(period) for earlier, later in pairwise(sent))
        assert [each.transfer_id for each in sent[:4]] == [(sent[0].transfer_id + n) & 31 for n in range(4)]


@pytest.mark.states("B17", "B27")
def test_both_have_priority_16_and_come_from_the_node_id() -> None:
    desk = Desk()
    heard = desk.wait(2.0)
    assert {(each.type_id, each.priority, each.source) for each in heard} == {
        (NODE_STATUS, 16, NODE),
        (STATUS, 16, NODE),
    }


@pytest.mark.states("B03", "B16")
def test_nothing_is_broadcast_without_a_node_id() -> None:
    desk = Desk(node_id=0)
    heard = desk.wait(5.0)
    assert heard
    assert {each.type_id for each in heard} == {1}


@pytest.mark.states("B18")
def test_uptime_counts_whole_seconds_from_the_start() -> None:
    desk = Desk()
    desk.wait(5.0)
    assert [status.uptime_sec for status in desk.node_statuses(desk.heard)] == [0, 1, 2, 3, 4, 5]


@pytest.mark.states("B15")
def test_health_follows_warnings_and_failures_but_not_notifications() -> None:
    desk = Desk()

    def health() -> NodeHealth:
        return desk.node_statuses(desk.wait(1.1))[-1].health

    desk.write("0x38", 100)
    desk.write("0x00", 900)
    assert desk.read("0x19") != 0
    assert health() is NodeHealth.OK
    desk.servo.faults.inject("sensor_weak", True)
    assert health() is NodeHealth.WARNING
    desk.servo.faults.inject("motor_signal", True)
    assert health() is NodeHealth.ERROR


@pytest.mark.states("B15")
def test_critical_is_never_used() -> None:
    desk = Desk("BLA21-06U-AB")
    for key in desk.servo.faults.keys:
        desk.servo.faults.inject(key, True)
        desk.wait(0.3)
        assert desk.node_statuses(desk.heard)[-1].health is not NodeHealth.CRITICAL
    assert desk.node_statuses(desk.wait(1.1))[-1].health is NodeHealth.ERROR


@pytest.mark.states("B16")
def test_mode_is_operational_once_there_is_a_node_id() -> None:
    assert {status.mode for status in Desk().node_statuses(Desk().wait(3.0))} == {Mode.OPERATIONAL}


@pytest.mark.states("B16")
def test_during_a_software_update_the_mode_says_so_and_nothing_but_node_info_is_served() -> None:
    desk = Desk(rom={"soft_start": 0})
    desk.servo.conditions.software_update = True
    statuses = desk.node_statuses(desk.wait(2.1))
    assert {status.mode for status in statuses[1:]} == {Mode.SOFTWARE_UPDATE}
    assert desk.servo.output == 1
    assert (desk.read("0x50"), desk.write("0x2C", 77), desk.opcode(0)) == (None, None, False)
    info = desk.node_info()
    assert info is not None
    assert info.status.mode is Mode.SOFTWARE_UPDATE
    desk.array(7, 1, 0.5)
    desk.wait(0.5)
    assert desk.servo.angle_deg == 0.0
    desk.servo.conditions.software_update = False
    desk.wait(0.3)
    assert desk.servo.starts == 2
    assert desk.node_statuses(desk.wait(1.1))[-1].mode is Mode.OPERATIONAL
    assert desk.read("0x2C") == 40


@pytest.mark.states("B28")
def test_status_carries_the_servo_id() -> None:
    for servo_id in (9, 0):
        desk = Desk(servo_id=servo_id)
        assert {status.actuator_id for status in desk.statuses(desk.wait(1.0))} == {servo_id}


@pytest.mark.states("B27")
def test_force_speed_and_power_of_status_stay_0_whatever_the_motor_does() -> None:
    desk = Desk(rom=FREE).under(load_pct=-20.0)
    desk.write("0x01", 80)
    statuses = desk.statuses(desk.wait(1.0))
    assert (desk.read("0x09") or 0) > 20
    assert {(each.force, each.speed, each.power_rating_pct) for each in statuses} == {(0.0, 0.0, 0)}


@pytest.mark.states("B27")
def test_status_follows_the_horn() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 10)
    for _ in range(5):
        sent = desk.statuses(desk.wait(0.1))[-1]
        assert sent.position == pytest.approx(desk.servo.angle_deg / 100, abs=0.07)


@pytest.mark.states("B17", "B18")
def test_uptime_is_that_of_the_last_start_and_the_first_status_comes_with_it() -> None:
    desk = Desk()
    desk.wait(3.0)
    desk.power_cycle()
    heard = desk.node_statuses(desk.heard)
    assert heard[-1].uptime_sec == 0
    assert heard[-2].uptime_sec == 3


@pytest.mark.states("B23", "B27")
@pytest.mark.parametrize(
    ("unit", "position"), [("hundred_degrees", 0.9), ("radian", radians(90)), ("degree", 90.0), ("tenth_degree", 900.0)]
)
def test_the_position_is_current_angle_in_the_unit_the_servo_speaks(unit: PositionUnit, position: float) -> None:
    desk = Desk(behaviour=Behaviour(position_unit=unit), rom={"soft_start": 0, "torque_mode": 1}, angle_deg=90.0)
    assert desk.read("0x08") == 900
    assert desk.statuses(desk.wait(0.3))[-1].position == pytest.approx(position, rel=1e-3)


def test_a_muted_servo_sends_nothing_but_still_acts() -> None:
    desk = Desk()
    desk.servo.conditions.mute = True
    assert desk.send_write("0x00", 300) == []
    assert desk.wait(1.0) == []
    desk.servo.conditions.mute = False
    assert desk.read("0x00") == 300
