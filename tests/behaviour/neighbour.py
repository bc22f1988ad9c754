"""A node of another make on the embedded bus, as talkative and as deaf as a test wants it."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from hornbill.units import Instant
from hornbill.wire.datatype import DataType, Kind, Structure
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorStatus, Mode, NodeHealth, NodeStatus
from hornbill.wire.port import CanPort
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import (
    EMPTY,
    GetNodeInfoRequest,
    GetNodeInfoResponse,
    GetSetRequest,
    GetSetResponse,
    HardwareVersion,
    SoftwareVersion,
    ValueKind,
)
from hornbill.wire.transfer import Transfer, split
from hornbill.wire.types import BY_KEY, decode

NOTHING = GetSetResponse(EMPTY, EMPTY, EMPTY, EMPTY, "")


def refuse(_request: GetSetRequest) -> GetSetResponse:
    """The answer of a node that has no such parameter."""
    return NOTHING


@dataclass
class Neighbour:
    """Says NodeStatus once a second from `speak` on, and Status of an actuator ten times if it is one.

    `name` None: it does not answer GetNodeInfo. `register` None: it does not answer GetSet.
    """

    port: CanPort
    node_id: int
    name: str | None = "org.example.gps"
    register: Callable[[GetSetRequest], GetSetResponse] | None = None
    actuator: bool = False
    unique_id: bytes = bytes(range(100, 116))
    uptime: int = 500
    asked: list[tuple[Instant, Structure]] = field(default_factory=list[tuple[Instant, Structure]])

    def __post_init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._reassembler = Reassembler(self.node_id)
        self._timer: asyncio.TimerHandle | None = None
        self._number = 0
        self.port.listen(self._receive)

    @property
    def infos(self) -> int:
        """How often it was asked who it is."""
        return sum(isinstance(request, GetNodeInfoRequest) for _, request in self.asked)

    @property
    def reads(self) -> list[str]:
        """The registers somebody read from it."""
        return [one.name for _, one in self.asked if isinstance(one, GetSetRequest) and one.value == EMPTY]

    @property
    def writes(self) -> list[str]:
        """The registers somebody wrote to it."""
        return [
            one.name
            for _, one in self.asked
            if isinstance(one, GetSetRequest) and one.value.kind is not ValueKind.EMPTY
        ]

    def speak(self) -> "Neighbour":
        """Say who it is from now on."""
        self._tick()
        return self

    def hush(self) -> None:
        """Say nothing of itself any more; it still answers."""
        if self._timer is not None:
            self._timer.cancel()

    def say(self, kind: Kind, structure: Structure, *, destination: int = 0, transfer_id: int = 0) -> None:
        """Any transfer of a known type from this node."""
        data_type = BY_KEY[structure.TYPE.service, structure.TYPE.id]
        self.send(data_type, structure.encode(), kind, destination, transfer_id)

    def send(
        self, data_type: DataType, payload: bytes, kind: Kind = Kind.MESSAGE, destination: int = 0, transfer_id: int = 0
    ) -> None:
        """Any transfer from this node."""
        transfer = Transfer(kind, data_type.id, self.node_id, destination, 20, transfer_id, payload)
        self.port.send(split(transfer, data_type))

    def _tick(self) -> None:
        if self._number % 10 == 0:
            self.say(
                Kind.MESSAGE, NodeStatus(self.uptime, NodeHealth.OK, Mode.OPERATIONAL), transfer_id=self.uptime & 31
            )
            self.uptime += 1
        if self.actuator:
            self.say(Kind.MESSAGE, ActuatorStatus(7, 0.25, 0.0, 0.0, 0), transfer_id=self._number & 31)
        self._number += 1
        self._timer = self._loop.call_later(0.1, self._tick)

    def _receive(self, frames: Sequence[Frame]) -> None:
        for transfer in self._reassembler.feed(frames, self._loop.time()):
            request = decode(transfer)
            if transfer.kind is not Kind.REQUEST or request is None:
                continue
            self.asked.append((self._loop.time(), request))
            answer: Structure | None = None
            if isinstance(request, GetNodeInfoRequest) and self.name is not None:
                answer = GetNodeInfoResponse(
                    NodeStatus(self.uptime, NodeHealth.OK, Mode.OPERATIONAL), SoftwareVersion(1, 4, 1, 0xBEEF),
                    HardwareVersion(3, 1, self.unique_id), self.name,
                )  # fmt: skip
            elif isinstance(request, GetSetRequest) and self.register is not None:
                answer = self.register(request)
            if answer is not None:
                self.say(Kind.RESPONSE, answer, destination=transfer.source, transfer_id=transfer.transfer_id)
