"""The stack compared with pydronecan: decoding, encoding, and a request with its response."""

import asyncio
import random
from collections import deque
from collections.abc import Iterator
from typing import Any

import dronecan
from dronecan.driver import CANFrame
from dronecan.node import Node

from bench.crowd import HOST, CannedPort, Crowd
from bench.line import PYDRONECAN, compare_with_peer, line
from hornbill.node.guard import GuardedPort
from hornbill.node.participant import Participant
from hornbill.schema.catalog import Catalog
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import (
    ActuatorCommand,
    ActuatorStatus,
    AllocationMessage,
    ArrayCommand,
    Mode,
    NodeHealth,
    NodeStatus,
)
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse, SoftwareVersion, integer
from hornbill.wire.transfer import Transfer, split
from hornbill.wire.types import AnyStructure, decode

ROUNDS = 7
PEER_SHARE = 5
"""The peer does a fifth of the work, and its time counts five times: a run should not take minutes."""

BURST_S = 0.001
"""Frames per batch of an adapter: those of a millisecond."""

BETWEEN_S = 0.0008
"""Distance between two frames of a transfer: about five others are in between."""

SECONDS = 3
"""Longer than the timeout of an incomplete transfer, so that the check for timeouts is included."""

NODES = 16
READS = 8000
READ = GetSetRequest(0, EMPTY, "0x38")

_peer: Any = dronecan  # its types are made at run time


def figures() -> Iterator[dict[str, Any]]:
    """Decode the saturated mix to typed objects, encode ArrayCommand of 15, request GetSet and receive the response."""
    yield decoding()
    yield encoding()
    yield requesting()


def saturated_mix(seconds: int = SECONDS) -> list[Frame]:
    """The frames of a full bus: 60 servos streaming, GetSet responses in the rest, ten allocations a second.

    Transfers of several senders are interleaved. Frames carry the instants they would have, evenly apart.
    """
    chance = random.Random(1)
    sent: list[tuple[float, Frame]] = []

    def say(structure: AnyStructure, source: int, number: int, at: float, *, priority: int = 16) -> None:
        data_type = structure.TYPE
        destination = HOST if data_type.service else 0
        payload = structure.encode()
        transfer = Transfer(structure.KIND, data_type.id, source, destination, priority, number % 32, payload)
        sent.extend((at + place * BETWEEN_S, frame) for place, frame in enumerate(split(transfer, data_type)))

    for node in range(1, 61):
        for number in range(10 * seconds):
            status = ActuatorStatus(node, chance.uniform(-1.8, 1.8), 0.0, 0.0, 0)
            say(status, node, number, (number + node / 60) / 10)
        for number in range(seconds):
            say(NodeStatus(3600 + number, NodeHealth.OK, Mode.OPERATIONAL), node, number, number + node / 61)
    for number in range(1576 * seconds):
        response = GetSetResponse(integer(chance.randrange(-9999, 9999)), EMPTY, EMPTY, EMPTY, "0x38")
        say(response, 1 + number % 60, number // 60, number / 1576, priority=24)
    for number in range(10 * seconds):
        say(AllocationMessage(0, True, chance.randbytes(6)), 0, number, (number + chance.random()) / 10, priority=24)
    frames = [frame for _, frame in sorted(sent, key=lambda pair: pair[0])]
    apart = seconds / len(frames)
    return [frame._replace(at=1000.0 + apart * place) for place, frame in enumerate(frames)]


def decoding() -> dict[str, Any]:
    """Frames, in batches of a millisecond, to typed objects, including timeouts and counters."""
    mix = saturated_mix()
    bursts: dict[int, list[Frame]] = {}
    for frame in mix:
        bursts.setdefault(int(frame.at / BURST_S), []).append(frame)
    transfers = len(Reassembler(HOST).feed(mix))
    took: list[object] = []

    def ours() -> None:
        reassembler = Reassembler(HOST)
        took.clear()
        for burst in bursts.values():
            took.extend(map(decode, reassembler.feed(burst, burst[-1].at)))
        assert len(took) == transfers == reassembler.counters.transfers
        assert None not in took

    part = mix[: len(mix) // PEER_SHARE]
    raw = [CANFrame(frame.id, frame.data, True, ts_monotonic=frame.at, ts_real=frame.at) for frame in part]
    figures = compare_with_peer(ours, lambda: decode_with_peer(raw), scale=len(mix) / len(part), rounds=ROUNDS)
    figures |= {"frames": len(mix), "frames_per_s": round(len(mix) / figures["ours_s"])}
    return line("decode saturated mix", figures, must=15, aim=25, peer=PYDRONECAN)


def decode_with_peer(frames: list[Any]) -> None:
    """Decode CANFrames with pydronecan."""
    took: list[object] = []

    def receive(event: Any) -> None:
        took.append(event.message)

    def hook(transfer: Any) -> None:
        if transfer.service_not_message:
            took.append(transfer.payload)

    node: Any = Node(_Driver(), node_id=HOST)
    node.add_handler(_peer.uavcan.equipment.actuator.Status, receive)
    node.add_handler(_peer.uavcan.protocol.NodeStatus, receive)
    node.add_transfer_hook(hook)
    for frame in frames:
        node._recv_frame(frame)
    assert len(took) > 0.3 * len(frames)


def encoding() -> dict[str, Any]:
    """From fifteen ids and numbers to nine frames."""
    wanted = [(n, n / 100) for n in range(1, 16)]
    count = 1000

    def ours() -> None:
        for number in range(count):
            message = ArrayCommand([ActuatorCommand(actuator, 1, value) for actuator, value in wanted])
            payload = message.encode()
            split(Transfer(Kind.MESSAGE, ArrayCommand.TYPE.id, HOST, 0, 16, number % 32, payload), ArrayCommand.TYPE)

    node: Any = Node(_Driver(), node_id=HOST)
    actuator = _peer.uavcan.equipment.actuator

    def theirs() -> None:
        for _ in range(count // PEER_SHARE):
            message = actuator.ArrayCommand()
            for number, value in wanted:
                message.commands.append(actuator.Command(actuator_id=number, command_type=1, command_value=value))
            node.broadcast(message, priority=16)

    figures = compare_with_peer(ours, theirs, scale=PEER_SHARE, rounds=ROUNDS)
    figures |= {"per_s": round(count / figures["ours_s"])}
    return line("encode ArrayCommand of 15", figures, must=30, aim=60, peer=PYDRONECAN)


def requesting() -> dict[str, Any]:
    """A read request to each of sixteen nodes, with its frames, its response and the bookkeeping."""
    crowd = Crowd(Catalog.load(), NODES)
    (request,) = split(Transfer(Kind.REQUEST, 11, HOST, 1, 24, 0, READ.encode()), READ.TYPE)
    (received,) = Reassembler(HOST).feed(crowd.respond(request))
    response = GetSetResponse.decode(received.payload)
    assert response is not None
    expected = response.value

    async def request_ours() -> None:
        port = CannedPort(crowd)
        guarded = GuardedPort(port, writable=frozenset({"0x38"}))
        host = Participant(
            guarded, node_id=HOST, name="org.hornbill", unique_id=bytes(16), software_version=SoftwareVersion(0, 1)
        )
        host.start()

        async def request(node: int) -> None:
            for _ in range(READS // NODES):
                response = await host.request(node, READ, timeout=0.12, tries=10)
                assert response.value == expected

        await asyncio.gather(*(request(node) for node in range(1, NODES + 1)))
        await host.close()

    driver = _Driver(crowd)
    node: Any = Node(driver, node_id=HOST)
    responses = 0

    def take(event: Any) -> None:
        nonlocal responses
        responses += event.response.value.integer_value == expected.value

    def request_theirs() -> None:
        nonlocal responses
        responses = 0
        get_set = _peer.uavcan.protocol.param.GetSet
        rounds = READS // NODES // PEER_SHARE
        for _ in range(rounds):
            for destination in range(1, NODES + 1):
                node.request(get_set.Request(name="0x38"), destination, take, priority=24, timeout=0.12)
            node.spin(0)
        assert responses == rounds * NODES

    figures = compare_with_peer(lambda: asyncio.run(request_ours()), request_theirs, scale=PEER_SHARE, rounds=ROUNDS)
    figures |= {"us_each": round(figures["ours_s"] / READS * 1e6, 1)}
    return line("GetSet read request and its response", figures, must=13, aim=16, peer=PYDRONECAN)


class _Driver:
    """A pydronecan driver with a crowd that responds, or without."""

    def __init__(self, crowd: Crowd | None = None) -> None:
        self._crowd = crowd
        self._due: deque[CANFrame] = deque()
        self._ready: dict[tuple[int, bytes], list[CANFrame]] = {}

    def send(self, message_id: int, message: bytes, extended: bool = True, canfd: bool = False) -> None:
        if self._crowd is None:
            return
        key = message_id, bytes(message)
        if key not in self._ready:
            response = self._crowd.respond(Frame(*key))
            self._ready[key] = [CANFrame(one.id, one.data, True, ts_monotonic=1.0, ts_real=1.0) for one in response]
        self._due += self._ready[key]

    def receive(self, timeout: float) -> CANFrame | None:
        return self._due.popleft() if self._due else None

    def close(self) -> None:
        self._due.clear()
