"""Pending node ID requests, their progress and reasons for refusal."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from hornbill.domain.bus import RefusalCode
from hornbill.domain.fields import Param
from hornbill.units import Instant

RETAIN_S: Final = 60.0
_MAX_ENTRIES: Final = 256
_KEY_BYTES: Final = 6


@dataclass(frozen=True, slots=True)
class AllocationRefusal:
    """Reason a node gets no ID: a code with its values, and the same in English."""

    code: RefusalCode
    text: str
    params: Mapping[str, Param] = field(default_factory=dict[str, Param])


@dataclass(frozen=True, slots=True)
class AllocationRequest:
    """A node waiting for an ID. `partial` is the known part of its unique ID, in hex (12, 24 or 32 digits).

    `stage` is the largest number of the three parts received in one attempt, `attempts` the number of first parts,
    `refused` the reason if it was refused.
    """

    partial: str
    stage: int
    first_seen: Instant
    last_seen: Instant
    attempts: int
    refused: AllocationRefusal | None = None

    @property
    def refusal(self) -> str | None:
        """Reason for the refusal as text. None if not refused."""
        return None if self.refused is None else self.refused.text


class AllocationRequests:
    """Requests of the last minute, at most 256. Nodes with the same first six bytes share an entry."""

    def __init__(self) -> None:
        self._entries: dict[bytes, AllocationRequest] = {}

    def note(self, gathered: bytes, stage: int, now: Instant) -> None:
        """Record a request at `stage` 1..3. `gathered` is the unique ID so far (6, 12 or 16 bytes)."""
        key = gathered[:_KEY_BYTES]
        before = self._entries.get(key)
        if before is None:
            if len(self._entries) >= _MAX_ENTRIES:
                del self._entries[min(self._entries, key=lambda each: self._entries[each].last_seen)]
            before = AllocationRequest("", 0, now, now, 0)
        partial = gathered.hex()
        further = len(partial) > len(before.partial) or not before.partial.startswith(partial)
        self._entries[key] = replace(
            before,
            partial=partial if further else before.partial,
            stage=stage if further else before.stage,
            last_seen=now,
            attempts=before.attempts + (stage == 1),
        )

    def refuse(self, unique_id: bytes, why: AllocationRefusal) -> AllocationRequest | None:
        """Record the refusal of a node noted before. Returns its entry if the reason is new, else None."""
        key = unique_id[:_KEY_BYTES]
        before = self._entries[key]
        entry = self._entries[key] = replace(before, refused=why)
        return entry if before.refused != why else None

    def drop(self, unique_id: bytes) -> None:
        """Remove a node that got an ID. Idempotent."""
        self._entries.pop(unique_id[:_KEY_BYTES], None)

    def all(self, now: Instant) -> list[AllocationRequest]:
        """Current requests, longest waiting first."""
        self._entries = {key: each for key, each in self._entries.items() if now - each.last_seen < RETAIN_S}
        return sorted(self._entries.values(), key=lambda each: each.first_seen)
