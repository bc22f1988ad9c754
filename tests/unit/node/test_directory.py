"""Nodes on the bus: appearing, going offline, restarting."""

import asyncio

import pytest

from hornbill.node.directory import Directory, NodeRecord
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import ActuatorStatus, AllocationMessage, Mode, NodeHealth, NodeStatus
from hornbill.wire.services import GetNodeInfoResponse, HardwareVersion, SoftwareVersion
from hornbill.wire.transfer import Transfer, split
from unit.node.peer import Peer
from unit.node.requesting import pair


def status(uptime: int, health: NodeHealth = NodeHealth.OK) -> NodeStatus:
    return NodeStatus(uptime, health, Mode.OPERATIONAL)


def info(unique_id: bytes) -> GetNodeInfoResponse:
    return GetNodeInfoResponse(status(1), SoftwareVersion(1, 0), HardwareVersion(1, 0, unique_id), "org.example")


def restarts_of(directory: Directory) -> list[int]:
    """Node IDs of the restarts reported from now on."""
    node_ids: list[int] = []
    directory.on_restarted.append(lambda record: node_ids.append(record.node_id))
    return node_ids


def test_a_node_is_online_until_three_seconds_after_its_last_status() -> None:
    directory = Directory()
    directory.record_status(42, status(5), 100.0)
    directory.record_status(42, status(6, NodeHealth.WARNING), 101.0)
    record = directory.records[42]
    assert record == NodeRecord(42, status(6, NodeHealth.WARNING), 101.0, 100.0)
    assert directory.is_online(42, 103.9)
    assert not directory.is_online(42, 104.0)
    assert not directory.is_online(43, 103.9)
    directory.record_status(7, status(1), 103.0)
    assert directory.online(103.9) == [directory.records[7], record]
    assert directory.online(104.0) == [directory.records[7]]


@pytest.mark.parametrize(
    ("before", "after", "seconds", "restarts"),
    [
        (5, 16, 11.0, 0),  # out of sight, with the expected uptime
        (5, 20, 60.0, 1),  # out of sight, with a lagging uptime
        (500, 0, 1.0, 1),
        (1, 0, 0.7, 1),
    ],
)
def test_a_restart_is_detected_by_the_uptime(before: int, after: int, seconds: float, restarts: int) -> None:
    directory = Directory()
    found = restarts_of(directory)
    directory.record_status(42, status(before), 100.0)
    directory.identify(42, info(bytes(16)))
    directory.record_status(42, status(after), 100.0 + seconds)
    assert found == [42] * restarts
    record = directory.records[42]
    assert (record.restarts, record.leaps, record.boot_count) == (restarts, 0, restarts)
    assert record.unique_id == (None if restarts else bytes(16))


@pytest.mark.parametrize("delay", [-0.9, 0.0, 0.9, 1.5])
def test_late_and_early_statuses_are_not_restarts(delay: float) -> None:
    directory = Directory()
    found = restarts_of(directory)
    for second in range(10):
        directory.record_status(42, status(second), 100.0 + second + (delay if second % 2 else 0.0))
    assert found == []
    assert directory.records[42].leaps == 0


def test_two_nodes_with_one_id_count_as_restarts_and_leaps() -> None:
    directory = Directory()
    for second in range(5):
        directory.record_status(42, status(1000 + second), 100.0 + second)
        directory.record_status(42, status(second), 100.5 + second)
    record = directory.records[42]
    assert (record.restarts, record.leaps) == (5, 4)


def test_the_unique_id_of_a_known_node_is_retained_with_its_last_node_id() -> None:
    directory = Directory()
    directory.identify(42, info(bytes(16)))
    assert directory.unique_id_at(42) is None
    assert directory.node_id_of(bytes(16)) is None
    for at, node_id in ((0.0, 42), (5.0, 43)):
        directory.record_status(node_id, status(1), at)
        directory.identify(node_id, info(bytes(range(16))))
        directory.record_status(node_id, status(2), at + 1)
    assert directory.unique_id_at(42) == directory.unique_id_at(43) == bytes(range(16))
    assert directory.node_id_of(bytes(range(16))) == 43
    assert directory.node_id_of(bytes(16)) is None


def test_remembered_ids_are_known_but_not_seen() -> None:
    directory = Directory(remembered=(7, 9))
    directory.record_status(9, status(1), 0.0)
    assert directory.known() == {7, 9}
    assert directory.seen() == directory.occupied(1.0) == {9}


async def test_on_a_bus_nodes_without_status_are_known_too() -> None:
    bus, host, _ = pair()
    directory = Directory()
    leave = directory.follow(host)
    talker, mute = Peer(bus.port("talker"), 42), Peer(bus.port("mute"), 43)
    talker.say_status(1)
    mute.send(Kind.MESSAGE, ActuatorStatus(1, 0.0, 0.0, 0.0, 0))
    await asyncio.sleep(1)
    now = host.clock()
    assert list(directory.records) == [42]
    assert directory.occupied(now) == directory.known() == {42, 43}
    assert directory.last_seen(43) == pytest.approx(now - 1, abs=0.01)
    assert directory.last_seen(44) is None
    await asyncio.sleep(3)
    assert directory.occupied(host.clock()) == set()
    assert directory.known() == {42, 43}
    # A node is online while it sends anything.
    talker.say_status(5)
    await asyncio.sleep(2.5)
    talker.send(Kind.MESSAGE, ActuatorStatus(1, 0.0, 0.0, 0.0, 0))
    await asyncio.sleep(2.5)
    assert [record.node_id for record in directory.online(host.clock())] == [42]
    directory.forget(42)
    directory.forget(43)
    assert directory.known() == set()
    assert directory.anonymous_seen is None
    anonymous = AllocationMessage(0, True, bytes(6))
    mute.port.send(split(Transfer(Kind.MESSAGE, 1, 0, 0, 24, 0, anonymous.encode()), AllocationMessage.TYPE))
    await asyncio.sleep(0.01)
    assert directory.anonymous_seen == pytest.approx(host.clock(), abs=0.01)
    leave()
    talker.say_status(5)
    await asyncio.sleep(0.01)
    assert directory.records == {}
