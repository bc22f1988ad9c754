"""Transfers of one servo in a log, without evaluation."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple, TypeVar

from hornbill.bus.recordings.reader import LogReader
from hornbill.units import Instant
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import ActuatorStatus, NodeStatus
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import GetSetRequest, GetSetResponse
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import AnyStructure, decode

RESPONSE_TIMEOUT_S: Final = 1.0
"""Later responses are ignored: transfer IDs repeat after 32 requests."""

_Shape = TypeVar("_Shape")


class Observed(NamedTuple):
    """One transfer and its content."""

    transfer: Transfer
    structure: AnyStructure

    @property
    def at(self) -> Instant:
        """Time on the bus, s."""
        return self.transfer.at


class Exchange(NamedTuple):
    """A request to the servo and its response, if any."""

    request: Observed
    response: Observed | None

    @property
    def took_s(self) -> float | None:
        """Time from the last frame of the request to the last of the response."""
        return None if self.response is None else self.response.at - self.request.at


@dataclass(frozen=True)
class ProbeEvidence:
    """All known transfers of a log, in order. `nodes` are the node IDs of the servo in this time."""

    transfers: list[Observed]
    nodes: frozenset[int]

    @classmethod
    def read(cls, file: Path, nodes: Iterable[int]) -> "ProbeEvidence":
        """Read a log of the bus. Raises LogFailed if it cannot be read."""
        log = LogReader.open(file)
        try:
            return cls(list(_transfers(log)), frozenset(nodes))
        finally:
            log.close()

    def messages(self, shape: type[_Shape]) -> list[tuple[Instant, _Shape]]:
        """Messages of one type broadcast by the servo, with their times."""
        return [
            (one.at, one.structure)
            for one in self.transfers
            if isinstance(one.structure, shape) and one.transfer.source in self.nodes
        ]

    def statuses(self) -> list[tuple[Instant, ActuatorStatus]]:
        """uavcan.equipment.actuator.Status, one every 100 ms (table 2-2)."""
        return self.messages(ActuatorStatus)

    def node_statuses(self) -> list[tuple[Instant, NodeStatus]]:
        """uavcan.protocol.NodeStatus, one a second (table 2-2)."""
        return self.messages(NodeStatus)

    def exchanges(self, shape: type[object]) -> list[Exchange]:
        """Requests of one type to the servo, with the response of the same transfer ID within a second."""
        found: list[Exchange] = []
        for place, one in enumerate(self.transfers):
            if one.transfer.destination in self.nodes and isinstance(one.structure, shape):
                found.append(Exchange(one, self._response(place, one)))
        return found

    def readings(self, name: str) -> list[tuple[Instant, int | None]]:
        """Values of a register (`0x08`) in responses to reads and writes: raw, None for a response without a value."""
        found: list[tuple[Instant, int | None]] = []
        for request, response in self.exchanges(GetSetRequest):
            if not isinstance(request.structure, GetSetRequest) or request.structure.name != name or response is None:
                continue
            if isinstance(response.structure, GetSetResponse):
                value = response.structure.value.value
                found.append((response.at, int(value) if isinstance(value, int) else None))
        return found

    def _response(self, place: int, request: Observed) -> Observed | None:
        wanted = request.transfer
        for one in self.transfers[place + 1 :]:
            if one.at - request.at > RESPONSE_TIMEOUT_S:
                return None
            seen = one.transfer
            if (
                seen.kind is Kind.RESPONSE
                and (seen.source, seen.destination) == (wanted.destination, wanted.source)
                and (seen.type_id, seen.transfer_id) == (wanted.type_id, wanted.transfer_id)
            ):
                return one
        return None


def _transfers(log: LogReader) -> Iterator[Observed]:
    reassembler = Reassembler()
    for frame, _channel, _sent in log:
        for transfer in reassembler.feed((frame,)):
            structure = decode(transfer)
            if structure is not None:
                yield Observed(transfer, structure)
