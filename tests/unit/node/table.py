"""The environment of an allocator, without a database and without a bus."""

from dataclasses import dataclass, field

from hornbill.node.allocator import Allocator, PendingWrite
from hornbill.units import NodeId, Uid
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import AllocationMessage
from hornbill.wire.transfer import Transfer


class MemoryTable:
    """An AllocationTable in memory."""

    def __init__(self, entries: dict[str, int] | None = None, pins: frozenset[str] = frozenset()) -> None:
        self.kept = dict(entries or {})
        self.pins = pins
        self.recorded: list[tuple[str, int]] = []
        self.away_s: dict[str, float] = {}
        self.broken = False
        self.write: PendingWrite | None = None
        """Returned by `record`: None if a write is done at once."""

    def entries(self) -> dict[Uid, NodeId]:
        """All allocations."""
        return {Uid(uid): NodeId(node_id) for uid, node_id in self.kept.items()}

    def pinned(self, uid: Uid) -> bool:
        """Whether it is among the pins."""
        return uid in self.pins

    def record(self, uid: Uid, node_id: NodeId) -> PendingWrite | None:
        """Store an allocation. Raises OSError while `broken`."""
        if self.broken:
            raise OSError("the disk is full")
        self.recorded.append((uid, node_id))
        self.kept[uid] = node_id
        return self.write

    def idle(self, longer_than_s: float) -> list[Uid]:
        """Unique IDs absent for longer, according to `away_s`, longest first."""
        gone = [uid for uid, away in self.away_s.items() if away > longer_than_s and uid in self.kept]
        return [Uid(uid) for uid in sorted(gone, key=lambda uid: -self.away_s[uid]) if uid not in self.pins]

    def drop(self, uid: Uid) -> None:
        """Remove an allocation."""
        del self.kept[uid]


@dataclass
class Neighbours:
    """KnownNodes of a bus, set by the test."""

    seen: dict[int, float] = field(default_factory=dict[int, float])
    uids: dict[int, bytes] = field(default_factory=dict[int, bytes])

    def known(self) -> set[int]:
        """All nodes ever seen."""
        return set(self.seen)

    def occupied(self, now: float) -> set[int]:
        """Node IDs seen within three seconds."""
        return {node_id for node_id, at in self.seen.items() if now - at < 3}

    def unique_id_at(self, node_id: int) -> bytes | None:
        """The unique ID of a node, if known."""
        return self.uids.get(node_id)

    def node_id_of(self, unique_id: bytes) -> int | None:
        """The node ID of a unique ID."""
        return next((node_id for node_id, uid in self.uids.items() if uid == unique_id), None)

    def last_seen(self, node_id: int) -> float | None:
        """When the node ID was last seen."""
        return self.seen.get(node_id)


def request(
    allocator: Allocator, part: bytes, now: float, *, first: bool = False, preferred: int = 0
) -> AllocationMessage | None:
    """The response to one anonymous request."""
    message = AllocationMessage(preferred, first, part)
    return allocator.handle(message, Transfer(Kind.MESSAGE, 1, 0, 0, 24, 0, message.encode(), now), now)


def competing_response(
    allocator: Allocator, source: int, message: AllocationMessage, now: float
) -> AllocationMessage | None:
    """Receive a response of another allocator."""
    return allocator.handle(message, Transfer(Kind.MESSAGE, 1, source, 0, 24, 0, message.encode(), now), now)


def exchange(allocator: Allocator, unique_id: bytes, now: float, *, preferred: int = 0) -> int | None:
    """All three stages from `now` on, 0.1 s apart. Returns the allocated node ID."""
    first = request(allocator, unique_id[:6], now, first=True, preferred=preferred)
    assert first == AllocationMessage(0, False, unique_id[:6])
    second = request(allocator, unique_id[6:12], now + 0.1, preferred=preferred)
    assert second == AllocationMessage(0, False, unique_id[:12])
    last = request(allocator, unique_id[12:], now + 0.2, preferred=preferred)
    if last is None:
        return None
    assert (last.unique_id, last.first_part_of_unique_id) == (unique_id, False)
    return last.node_id
