"""Our own node: status, node info, subscriptions, hooks and counters."""

import asyncio

import pytest

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.errors import BusDisconnected
from hornbill.node.participant import Participant
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import ActuatorStatus, Mode, NodeHealth, NodeStatus
from hornbill.wire.services import GetNodeInfoRequest, GetNodeInfoResponse, GetSetRequest, SoftwareVersion
from hornbill.wire.transfer import Transfer, split
from hornbill.wire.types import decode
from unit.node.peer import HOST, Peer, participant
from unit.node.recording import RecordingPort
from unit.node.requesting import pair


def statuses(peer: Peer) -> list[tuple[float, NodeStatus]]:
    found = [(each.at, decode(each)) for each in peer.others]
    return [(at, each) for at, each in found if isinstance(each, NodeStatus)]


async def test_node_status_is_sent_at_once_and_every_second() -> None:
    bus = MemoryBus()
    peer = Peer(bus.port("peer"), 42)
    host = participant(bus.port("host"))
    began = host.clock()
    host.start()
    host.start()
    await asyncio.sleep(3.5)
    sent = statuses(peer)
    assert [round(at - began, 2) for at, _ in sent] == [0, 1, 2, 3]
    assert [each for _, each in sent] == [NodeStatus(n, NodeHealth.OK, Mode.OPERATIONAL) for n in range(4)]
    assert [(each.source, each.transfer_id) for each in peer.others] == [(HOST, n) for n in range(4)]
    await host.close()
    await asyncio.sleep(3)
    assert len(statuses(peer)) == 4


@pytest.mark.parametrize("payload", [b"", b"\0", b"\1\2\3"], ids=["none", "the printed byte", "more"])
async def test_get_node_info_is_answered_with_any_payload(payload: bytes) -> None:
    _, _, peer = pair()
    await asyncio.sleep(2.5)
    peer.others.clear()
    peer.port.send(split(Transfer(Kind.REQUEST, 1, 42, HOST, 19, 7, payload), GetNodeInfoRequest.TYPE))
    await asyncio.sleep(0.01)
    (transfer,) = peer.others
    assert (transfer.source, transfer.destination, transfer.priority, transfer.transfer_id) == (HOST, 42, 19, 7)
    response = decode(transfer)
    assert isinstance(response, GetNodeInfoResponse)
    assert response.name == "org.hornbill"
    assert response.hardware_version.unique_id == bytes(range(16))
    assert response.software_version == SoftwareVersion(0, 1)
    assert response.status == NodeStatus(2, NodeHealth.OK, Mode.OPERATIONAL)


async def test_subscribers_receive_messages_of_their_type_until_they_unsubscribe_even_if_one_fails(
    caplog: pytest.LogCaptureFixture,
) -> None:
    _, host, peer = pair()
    received: list[tuple[str, int, ActuatorStatus]] = []

    def fail(_transfer: Transfer, _message: ActuatorStatus) -> None:
        raise RuntimeError("a bug")

    host.subscribe(ActuatorStatus, fail)
    unsubscribe = host.subscribe(ActuatorStatus, lambda t, m: received.append(("first", t.source, m)))
    host.subscribe(ActuatorStatus, lambda t, m: received.append(("second", t.source, m)))
    status = ActuatorStatus(5, 1.5, 0.0, 0.0, 0)
    peer.send(Kind.MESSAGE, status)
    peer.say_status(3)
    await asyncio.sleep(0.01)
    assert received == [("first", 42, status), ("second", 42, status)]
    unsubscribe()
    unsubscribe()
    peer.send(Kind.MESSAGE, status, transfer_id=1)
    await asyncio.sleep(0.01)
    assert [who for who, _, _ in received] == ["first", "second", "second"]
    assert caplog.text.count("RuntimeError: a bug") == 2
    with pytest.raises(ValueError, match="not a message"):
        host.subscribe(GetSetRequest, lambda _t, _m: None)


async def test_another_node_with_our_id_is_counted_and_ignored(caplog: pytest.LogCaptureFixture) -> None:
    bus = MemoryBus()
    host = participant(bus.port("host"))
    twin = Peer(bus.port("twin"), HOST)
    host.start()
    received: list[int] = []
    host.subscribe(NodeStatus, lambda t, _: received.append(t.source))
    await asyncio.sleep(0.01)
    twin.say_status(1)
    twin.say_status(2)
    await asyncio.sleep(0.01)
    assert received == []
    assert HOST not in host.last_seen
    assert host.shared_id.frames == 2
    assert host.shared_id.last_seen == pytest.approx(host.clock(), abs=0.02)
    await host.close()
    assert caplog.text.count("another node uses our node ID 127") == 1


async def test_without_a_bus_nothing_is_sent_until_it_is_back() -> None:
    port = RecordingPort()
    host = participant(port)
    host.start()
    port.state = port.state.LOST
    await asyncio.sleep(5)
    with pytest.raises(BusDisconnected, match="recording:0 is not connected"):
        host.broadcast(NodeStatus(0, NodeHealth.OK, Mode.OPERATIONAL), priority=24)
    assert len(port.sent) == 1
    port.state = port.state.ACTIVE
    await asyncio.sleep(1.1)
    assert len(port.sent) == 2


async def test_a_malformed_message_is_counted_and_after_closing_all_are_ignored() -> None:
    port = RecordingPort()
    host = participant(port)
    host.start()
    received: list[NodeStatus] = []
    host.subscribe(NodeStatus, lambda _, m: received.append(m))
    port.deliver(split(Transfer(Kind.MESSAGE, 341, 42, 0, 16, 0, b"\1\2"), NodeStatus.TYPE))
    assert (received, host.subscriptions.malformed, list(host.last_seen)) == ([], 1, [42])
    await host.close()
    port.deliver(split(Transfer(Kind.MESSAGE, 341, 43, 0, 16, 0, bytes(7)), NodeStatus.TYPE))
    assert (received, list(host.last_seen), port.closed) == ([], [42], False)


async def test_invalid_arguments_are_refused() -> None:
    for node_id in (0, 128):
        with pytest.raises(ValueError, match="outside 1 to 127"):
            participant(RecordingPort(), node_id=node_id)
    with pytest.raises(ValueError, match="unique_id"):
        Participant(RecordingPort(), node_id=1, name="x", unique_id=b"short", software_version=SoftwareVersion(0, 1))
