"""Section 2.2 and tables 2-17 to 2-22: what a servo broadcasts, how often, at which priority, in which unit."""

from itertools import pairwise

import pytest

from behaviour.servo_story import follow
from hornbill.wire.messages import Mode, NodeHealth
from unit.sim.desk import FREE, NODE, Desk

NODE_STATUS, STATUS = 341, 1011


@pytest.mark.states("B17", "B27")
def test_node_status_every_second_and_status_every_100_ms_with_priority_16() -> None:
    broadcasts = Desk().wait(10.0)
    assert {(each.type_id, each.priority, each.source) for each in broadcasts} == {
        (NODE_STATUS, 16, NODE),
        (STATUS, 16, NODE),
    }
    for type_id, period, count in ((NODE_STATUS, 1.0, 10), (STATUS, 0.1, 100)):
        sent = [each for each in broadcasts if each.type_id == type_id]
        assert abs(len(sent) - count) <= 1
        assert all(later.at - earlier.at == pytest.approx(period) for earlier, later in pairwise(sent))
        assert [each.transfer_id for each in sent[:4]] == [(sent[0].transfer_id + n) & 31 for n in range(4)]


@pytest.mark.states("B03", "B16")
def test_nothing_is_broadcast_without_a_node_id() -> None:
    assert {each.type_id for each in Desk(node_id=0).wait(5.0)} == {1}


@pytest.mark.states("B16", "B17", "B18")
def test_uptime_counts_whole_seconds_since_the_last_start_and_the_mode_is_operational() -> None:
    desk = Desk()
    desk.wait(5.0)
    desk.power_cycle()
    statuses = desk.node_statuses(desk.received)
    assert [status.uptime_sec for status in statuses] == [0, 1, 2, 3, 4, 5, 0]
    assert {status.mode for status in statuses} == {Mode.OPERATIONAL}


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
        assert desk.node_statuses(desk.received)[-1].health is not NodeHealth.CRITICAL
    assert desk.node_statuses(desk.wait(1.1))[-1].health is NodeHealth.ERROR


@pytest.mark.states("B16")
def test_during_a_software_update_only_node_info_is_served() -> None:
    desk = Desk(rom={"soft_start": 0})
    desk.servo.conditions.software_update = True
    statuses = desk.node_statuses(desk.wait(2.1))
    assert {status.mode for status in statuses[1:]} == {Mode.SOFTWARE_UPDATE}
    assert (desk.read("0x50"), desk.write("0x2C", 77), desk.opcode(0)) == (None, None, False)
    info = desk.node_info()
    assert info is not None
    assert info.status.mode is Mode.SOFTWARE_UPDATE
    desk.array(7, 1, 0.5)
    follow(desk, {"output": 1}, 0.5, {"angle_deg": 0.0})
    desk.servo.conditions.software_update = False
    follow(desk, 0.3, {"starts": 2, "0x2C": 40})
    assert desk.node_statuses(desk.wait(1.1))[-1].mode is Mode.OPERATIONAL


@pytest.mark.states("B28")
@pytest.mark.parametrize("servo_id", [9, 0])
def test_status_carries_the_servo_id(servo_id: int) -> None:
    desk = Desk(servo_id=servo_id)
    assert {status.actuator_id for status in desk.statuses(desk.wait(1.0))} == {servo_id}


@pytest.mark.states("B27")
def test_status_follows_the_horn() -> None:
    desk = Desk(rom=FREE)
    desk.write("0x01", 10)
    for _ in range(5):
        sent = desk.statuses(desk.wait(0.1))[-1]
        assert sent.position == pytest.approx(desk.servo.angle_deg / 100, abs=0.07)


@pytest.mark.states("B27")
def test_force_speed_and_power_of_status_remain_0() -> None:
    desk = Desk(rom=FREE).under(load_pct=-20.0)
    desk.write("0x01", 80)
    statuses = desk.statuses(desk.wait(1.0))
    assert desk.value("0x09") > 20
    assert {(each.force, each.speed, each.power_rating_pct) for each in statuses} == {(0.0, 0.0, 0)}


def test_a_muted_servo_sends_nothing_and_still_acts() -> None:
    desk = Desk()
    desk.servo.conditions.mute = True
    assert desk.send_write("0x00", 300) == []
    assert desk.wait(1.0) == []
    desk.servo.conditions.mute = False
    assert desk.read("0x00") == 300
