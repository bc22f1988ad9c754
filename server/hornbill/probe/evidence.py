"""What one recording tells of one servo, transfer by transfer. Judges nothing."""

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

ANSWERED_WITHIN_S: Final = 1.0
"""An answer that comes later belongs to nobody: transfer ids begin anew after 32 requests."""

_Shape = TypeVar("_Shape")


class Told(NamedTuple):
    """One transfer, and what it carries."""

    transfer: Transfer
    structure: AnyStructure

    @property
    def at(self) -> Instant:
        """When it was on the bus, in seconds."""
        return self.transfer.at


class Exchange(NamedTuple):
    """A request to the servo and its answer, if one came."""

    request: Told
    answer: Told | None

    @property
    def took_s(self) -> float | None:
        """From the last frame of the request to the last of the answer."""
        return None if self.answer is None else self.answer.at - self.request.at


@dataclass(frozen=True)
class ProbeEvidence:
    """Everything known transfers told in a recording, in order; `nodes` are the ids the servo had meanwhile."""

    told: list[Told]
    nodes: frozenset[int]

    @classmethod
    def read(cls, file: Path, nodes: Iterable[int]) -> "ProbeEvidence":
        """From a recording of the bus. Raises LogFailed when it cannot be read."""
        recording = LogReader.open(file)
        try:
            return cls(list(_walk(recording)), frozenset(nodes))
        finally:
            recording.close()

    def said(self, shape: type[_Shape]) -> list[tuple[Instant, _Shape]]:
        """Messages of one type that the servo broadcast, with their times."""
        return [
            (one.at, one.structure)
            for one in self.told
            if isinstance(one.structure, shape) and one.transfer.source in self.nodes
        ]

    def statuses(self) -> list[tuple[Instant, ActuatorStatus]]:
        """uavcan.equipment.actuator.Status, one every 100 ms (table 2-2)."""
        return self.said(ActuatorStatus)

    def node_statuses(self) -> list[tuple[Instant, NodeStatus]]:
        """uavcan.protocol.NodeStatus, one a second (table 2-2)."""
        return self.said(NodeStatus)

    def asked(self, shape: type[object]) -> list[Exchange]:
        """Requests of one type to the servo, each with the answer to the same transfer id within a second."""
        found: list[Exchange] = []
        for place, one in enumerate(self.told):
            if one.transfer.destination in self.nodes and isinstance(one.structure, shape):
                found.append(Exchange(one, self._answer(place, one)))
        return found

    def readings(self, name: str) -> list[tuple[Instant, int | None]]:
        """What a register (`0x08`) answered when it was read or written: raw, None for an answer without a value."""
        found: list[tuple[Instant, int | None]] = []
        for request, answer in self.asked(GetSetRequest):
            if not isinstance(request.structure, GetSetRequest) or request.structure.name != name or answer is None:
                continue
            if isinstance(answer.structure, GetSetResponse):
                value = answer.structure.value.value
                found.append((answer.at, int(value) if isinstance(value, int) else None))
        return found

    def _answer(self, place: int, request: Told) -> Told | None:
        wanted = request.transfer
        for one in self.told[place + 1 :]:
            if one.at - request.at > ANSWERED_WITHIN_S:
                return None
            seen = one.transfer
            if (
                seen.kind is Kind.RESPONSE
                and (seen.source, seen.destination) == (wanted.destination, wanted.source)
                and (seen.type_id, seen.transfer_id) == (wanted.type_id, wanted.transfer_id)
            ):
                return one
        return None


def _walk(recording: LogReader) -> Iterator[Told]:
    reassembler = Reassembler()
    for frame, _channel, _sent in recording:
        for transfer in reassembler.feed((frame,)):
            structure = decode(transfer)
            if structure is not None:
                yield Told(transfer, structure)
