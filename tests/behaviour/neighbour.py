"""A foreign node on the embedded bus."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

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

NO_PARAMETER = GetSetResponse(EMPTY, EMPTY, EMPTY, EMPTY, "")


def refuse(_request: GetSetRequest) -> GetSetResponse:
    """The response of a node without that parameter."""
    return NO_PARAMETER


@dataclass
class Neighbour:
    """Sends NodeStatus once a second from `start` on, and Status ten times a second if it is an actuator.

    Without `name`, it does not respond to GetNodeInfo; without `register`, not to GetSet.
    """

    port: CanPort
    node_id: int
    name: str | None = "org.example.gps"
    register: Callable[[GetSetRequest], GetSetResponse] | None = None
    actuator: bool = False
    unique_id: bytes = bytes(range(100, 116))
    uptime: int = 500
    requests: list[Structure] = field(default_factory=list[Structure])

    def __post_init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._reassembler = Reassembler(self.node_id)
        self._number = 0
        self.port.listen(self._receive)

    @property
    def info_requests(self) -> int:
        """Number of GetNodeInfo requests it received."""
        return sum(isinstance(request, GetNodeInfoRequest) for request in self.requests)

    @property
    def reads(self) -> list[str]:
        """The parameters that were read from it."""
        return [one.name for one in self.requests if isinstance(one, GetSetRequest) and one.value == EMPTY]

    @property
    def writes(self) -> list[str]:
        """The parameters that were written to it."""
        return [
            one.name
            for one in self.requests
            if isinstance(one, GetSetRequest) and one.value.kind is not ValueKind.EMPTY
        ]

    def start(self) -> "Neighbour":
        """Send its status from now on."""
        self._tick()
        return self

    def send(self, kind: Kind, structure: Structure, *, destination: int = 0, transfer_id: int = 0) -> None:
        """Send a transfer of a known type."""
        data_type = BY_KEY[structure.TYPE.service, structure.TYPE.id]
        self.send_payload(data_type, structure.encode(), kind, destination, transfer_id)

    def send_payload(
        self, data_type: DataType, payload: bytes, kind: Kind = Kind.MESSAGE, destination: int = 0, transfer_id: int = 0
    ) -> None:
        """Send any transfer."""
        transfer = Transfer(kind, data_type.id, self.node_id, destination, 20, transfer_id, payload)
        self.port.send(split(transfer, data_type))

    def _tick(self) -> None:
        if self._number % 10 == 0:
            self.send(
                Kind.MESSAGE, NodeStatus(self.uptime, NodeHealth.OK, Mode.OPERATIONAL), transfer_id=self.uptime & 31
            )
            self.uptime += 1
        if self.actuator:
            self.send(Kind.MESSAGE, ActuatorStatus(7, 0.25, 0.0, 0.0, 0), transfer_id=self._number & 31)
        self._number += 1
        self._loop.call_later(0.1, self._tick)

    def _receive(self, frames: Sequence[Frame]) -> None:
        for transfer in self._reassembler.feed(frames, self._loop.time()):
            request = decode(transfer)
            if transfer.kind is not Kind.REQUEST or request is None:
                continue
            self.requests.append(request)
            response: Structure | None = None
            if isinstance(request, GetNodeInfoRequest) and self.name is not None:
                response = GetNodeInfoResponse(
                    NodeStatus(self.uptime, NodeHealth.OK, Mode.OPERATIONAL), SoftwareVersion(1, 4, 1, 0xBEEF),
                    HardwareVersion(3, 1, self.unique_id), self.name,
                )  # fmt: skip
            elif isinstance(request, GetSetRequest) and self.register is not None:
                response = self.register(request)
            if response is not None:
                self.send(Kind.RESPONSE, response, destination=transfer.source, transfer_id=transfer.transfer_id)
