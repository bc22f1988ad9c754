"""Which nodes ask for a node id, how far each has come, and why one gets none."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from hornbill.domain.bus import RefusalCode
from hornbill.domain.fields import Param
from hornbill.units import Instant

KEPT_S: Final = 60.0
_MOST: Final = 256
_KEY_BYTES: Final = 6


@dataclass(frozen=True, slots=True)
class AllocationRefusal:
    """Why a node gets no id: a code with its values, and the same in English."""

    code: RefusalCode
    text: str
    params: Mapping[str, Param] = field(default_factory=dict[str, Param])


@dataclass(frozen=True, slots=True)
class AllocationRequest:
    """A node that waits for an id. `partial` is what is known of its unique id, in hex (12, 24 or 32 digits).

    `stage` is how many of the three parts were heard when it got furthest, `attempts` counts first parts,
    and `refused` says why it gets none.
    """

    partial: str
    stage: int
    first_heard: Instant
    last_heard: Instant
    attempts: int
    refused: AllocationRefusal | None = None

    @property
    def refusal(self) -> str | None:
        """Why it gets none, as a text."""
        return None if self.refused is None else self.refused.text


class AllocationRequests:
    """Nodes heard asking within the last minute, at most 256. Those with the same first six bytes share an entry."""

    def __init__(self) -> None:
        self._entries: dict[bytes, AllocationRequest] = {}

    def note(self, gathered: bytes, stage: int, now: Instant) -> None:
        """A node was heard at `stage` 1..3; `gathered` is its unique id so far (6, 12 or 16 bytes)."""
        key = gathered[:_KEY_BYTES]
        before = self._entries.get(key)
        if before is None:
            if len(self._entries) >= _MOST:
                del self._entries[min(self._entries, key=lambda each: self._entries[each].last_heard)]
            before = AllocationRequest("", 0, now, now, 0)
        partial = gathered.hex()
        further = len(partial) > len(before.partial) or not before.partial.startswith(partial)
        self._entries[key] = replace(
            before,
            partial=partial if further else before.partial,
            stage=stage if further else before.stage,
            last_heard=now,
            attempts=before.attempts + (stage == 1),
        )

    def refuse(self, unique_id: bytes, why: AllocationRefusal) -> AllocationRequest | None:
        """A node noted just now gets no id; its entry when that reason is new, else None."""
        key = unique_id[:_KEY_BYTES]
        before = self._entries[key]
        entry = self._entries[key] = replace(before, refused=why)
        return entry if before.refused != why else None

    def drop(self, unique_id: bytes) -> None:
        """A node got an id. One that was not noted is no error."""
        self._entries.pop(unique_id[:_KEY_BYTES], None)

    def all(self, now: Instant) -> list[AllocationRequest]:
        """The longest waiting first."""
        self._entries = {key: each for key, each in self._entries.items() if now - each.last_heard < KEPT_S}
        return sorted(self._entries.values(), key=lambda each: each.first_heard)
