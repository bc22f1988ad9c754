"""Encoding and decoding, side by side with pydronecan: CPU seconds, alternating, median of the ratios."""

import random
import statistics
import time
from collections.abc import Callable, Iterator
from typing import Any

import dronecan
from dronecan.driver import CANFrame
from dronecan.transport import Frame as TheirFrame
from dronecan.transport import Transfer as TheirTransfer
from dronecan.transport import TransferManager

from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorStatus, ArrayCommand, Command, Health, Mode, NodeStatus
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import EMPTY, GetSetResponse, integer
from hornbill.wire.transfer import Transfer, split
from hornbill.wire.types import decode

ROUNDS = 5


def saturated_mix(seconds: float = 1.0) -> list[Frame]:
    """What a host hears in one second of a full bus: 60 servos streaming, and GetSet answers in what is left."""
    chance = random.Random(1)
    frames: list[tuple[float, list[Frame]]] = []
    for node in range(1, 61):
        for number in range(int(10 * seconds)):
            status = ActuatorStatus(node, chance.uniform(-1.8, 1.8), 0.0, 0.0, 0)
            sent = Transfer(Kind.MESSAGE, ActuatorStatus.TYPE.id, node, 0, 16, number % 32, status.encode())
            frames.append((chance.random() * seconds, split(sent, ActuatorStatus.TYPE)))
        alive = NodeStatus(chance.randrange(10_000), Health.OK, Mode.OPERATIONAL)
        sent = Transfer(Kind.MESSAGE, NodeStatus.TYPE.id, node, 0, 16, 0, alive.encode())
        frames.append((chance.random() * seconds, split(sent, NodeStatus.TYPE)))
    for number in range(int(1576 * seconds)):
        node = 1 + number % 60
        answer = GetSetResponse(integer(chance.randrange(-9999, 9999)), EMPTY, EMPTY, EMPTY, "0x38")
        sent = Transfer(Kind.RESPONSE, GetSetResponse.TYPE.id, node, 127, 24, (number // 60) % 32, answer.encode())
        frames.append((chance.random() * seconds, split(sent, GetSetResponse.TYPE)))
    return [frame for _, transfer in sorted(frames, key=lambda pair: pair[0]) for frame in transfer]


def ratio(ours: Callable[[], object], theirs: Callable[[], object], scale: int) -> dict[str, float]:
    """Median seconds of both, `theirs` done `scale` times less, and the median of the pairwise ratios."""
    pairs = [(cpu(ours), cpu(theirs) * scale) for _ in range(ROUNDS)]
    return {
        "ours_s": round(statistics.median(pair[0] for pair in pairs), 5),
        "peer_s": round(statistics.median(pair[1] for pair in pairs), 5),
        "ratio": round(statistics.median(pair[1] / pair[0] for pair in pairs), 1),
    }


def cpu(work: Callable[[], object]) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began


def figures() -> Iterator[dict[str, Any]]:
    """Decode the saturated mix to typed objects; encode ArrayCommand of 15."""
    mix = saturated_mix()

    def ours() -> None:
        reassembler = Reassembler(127)
        for start in range(0, len(mix), 64):
            for transfer in reassembler.feed(mix[start : start + 64], 0.0):
                decode(transfer)

    part = mix[: len(mix) // 5]
    raw = [CANFrame(frame.id, frame.data, True, ts_monotonic=1.0, ts_real=1.0) for frame in part]

    def theirs() -> None:
        manager: Any = TransferManager()
        for message in raw:
            frame = TheirFrame(message.id, message.data, ts_monotonic=1.0, ts_real=1.0)
            whole = manager.receive_frame(frame)
            if whole:
                transfer: Any = TheirTransfer()
                transfer.from_frames(whole)

    yield {
        "bench": "decode saturated mix",
        "frames": len(mix),
        "peer": "pydronecan",
        "must": 15,
        **ratio(ours, theirs, 5),
    }

    commands = tuple(Command(n, 1, n / 100) for n in range(1, 16))

    def encode_ours() -> None:
        for number in range(500):
            payload = ArrayCommand(commands).encode()
            split(Transfer(Kind.MESSAGE, ArrayCommand.TYPE.id, 127, 0, 16, number % 32, payload), ArrayCommand.TYPE)

    def encode_theirs() -> None:
        peer: Any = dronecan  # its types are made at run time
        actuator = peer.uavcan.equipment.actuator
        for number in range(100):
            message = actuator.ArrayCommand()
            for n in range(1, 16):
                message.commands.append(actuator.Command(actuator_id=n, command_type=1, command_value=n / 100))
            TheirTransfer(
                payload=message, source_node_id=127, transfer_id=number % 32, transfer_priority=16
            ).to_frames()

    yield {
        "bench": "encode ArrayCommand of 15",
        "peer": "pydronecan",
        "must": 30,
        **ratio(encode_ours, encode_theirs, 5),
    }
