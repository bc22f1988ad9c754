"""Node ID allocation as a function of the messages received and their times."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, StrEnum
from typing import Any, Final, Protocol

from hornbill.node.hooks import Hooks
from hornbill.node.node_ids import HIGHEST_DYNAMIC, find_free
from hornbill.node.waiting import AllocationRefusal, AllocationRequest, AllocationRequests
from hornbill.units import Instant, NodeId, Uid
from hornbill.wire.messages import AllocationMessage
from hornbill.wire.transfer import Transfer

log = logging.getLogger(__name__)

FOLLOW_UP_TIMEOUT_S: Final = 0.5
"""An incomplete unique ID is discarded when its next part is late (FOLLOWUP_TIMEOUT_MS)."""

RESPONSE_PRIORITY: Final = 24
"""The priority servos use for Allocation (table 2-2). Among equal priorities the low type ID wins arbitration."""

RECYCLE_AFTER_S: Final = 30 * 86_400.0
"""How long a node must be offline before its ID may be reassigned. IDs are reassigned only when none is free.

Long enough for a servo in storage or an unused bench. Without recycling, a commissioning station would stop at its
126th servo. A pinned ID is never recycled.
"""

_PARTS: Final = (6, 6, 4)
"""Bytes of unique ID in each of the three requests (table 2-7)."""

_SETTLE_S: Final = 0.5
"""Listening time before new IDs are assigned. Servos with an ID publish Status ten times a second."""

_COMPETITOR_GONE_AFTER: Final = 3
"""Number of unanswered first parts after which a competing allocator is considered gone."""


class PendingWrite(Protocol):
    """A write in progress, such as an asyncio.Future."""

    def add_done_callback(self, fn: Callable[[Any], object], /) -> None:
        """Call `fn` when the write has completed or failed."""
        ...

    def exception(self) -> BaseException | None:
        """The error of a failed write. Valid once done."""
        ...


class AllocationTable(Protocol):
    """Persistent assignments of node IDs to unique IDs."""

    def entries(self) -> dict[Uid, NodeId]:
        """All assignments, including pinned node IDs."""
        ...

    def pinned(self, uid: Uid) -> bool:
        """Whether an operator fixed this node's ID, so that no other may be assigned."""
        ...

    def record(self, uid: Uid, node_id: NodeId) -> PendingWrite | None:
        """Store an assignment made now. None if it is stored already."""
        ...

    def idle(self, longer_than_s: float) -> list[Uid]:
        """Unpinned nodes not seen for longer than that, least recently seen first."""
        ...

    def drop(self, uid: Uid, /) -> None:
        """Delete a node's assignment."""
        ...


class KnownNodes(Protocol):
    """Nodes on the bus. Directory implements it."""

    def known(self) -> set[int]:
        """Node IDs that belong to a node, which may be switched off."""
        ...

    def occupied(self, now: Instant) -> set[int]:
        """Node IDs in use now."""
        ...

    def unique_id_at(self, node_id: int) -> bytes | None:
        """Unique ID of the node at a node ID. None if unknown."""
        ...

    def node_id_of(self, unique_id: bytes) -> int | None:
        """Node ID at which a unique ID was last seen. None if never."""
        ...

    def last_seen(self, node_id: int) -> Instant | None:
        """Time of the last transfer from a node ID."""
        ...


@dataclass(frozen=True, slots=True)
class CompetingAllocator:
    """Another allocator that responds on this bus."""

    node_id: int
    last_seen: Instant
    responses: int


_NOT_STORED: Final = AllocationRefusal(
    "table_failed", "The allocation table cannot be read or written. Check the data folder."
)


class AllocationMode(StrEnum):
    """Selected mode: respond unless another allocator does (on), never (off), or always (force)."""

    ON = "on"
    OFF = "off"
    FORCE = "force"


class AllocatorStatus(StrEnum):
    """Effective state. Standby: on, but another allocator or program takes precedence."""

    ON = "on"
    OFF = "off"
    STANDBY = "standby"


class _Claim(Enum):
    """Whether the node ID stored for a requesting node can be assigned to it."""

    AVAILABLE = 1
    TAKEN = 2
    UNCLEAR = 3


class Allocator:
    """Responds to Allocation messages by the rules of uavcan.protocol.dynamic_node_id.Allocation.

    A unique ID gets the same node ID as long as the table has it. A new one gets the free ID nearest to the one it
    prefers, searching upward first. Without a preference it gets the ID at which it was last seen, else the highest
    free ID up to 125. An ID in use is never assigned. When none is free, the ID of the node offline for longest
    (at least RECYCLE_AFTER_S) is reassigned; without such a node the request is refused. While another allocator
    responds, or another program uses our node ID, this one sends nothing except in mode `force`.
    """

    def __init__(
        self,
        table: AllocationTable,
        *,
        own_ids: frozenset[int],
        known_nodes: KnownNodes,
        mode: AllocationMode = AllocationMode.ON,
        listening_since: Instant = float("-inf"),
    ) -> None:
        """`own_ids` are never assigned. `listening_since` is when `known_nodes` began to receive from the bus."""
        self.mode = mode
        """In mode `off`, requests are still tracked and shown."""
        self.listening_since = listening_since
        self.competitor: CompetingAllocator | None = None
        self.own_id_shared = False
        """Whether another program uses our node ID. Nodes cannot distinguish its responses from ours."""
        self.on_response: Hooks[AllocationMessage] = Hooks()
        """Called with an assignment that was stored only after `handle` had returned."""
        self.on_granted: Hooks[Uid, NodeId] = Hooks()
        self.on_refused: Hooks[AllocationRequest] = Hooks()
        """Called once per reason for refusing a node. `partial` is the whole unique ID."""
        self.on_recycled: Hooks[Uid, NodeId] = Hooks()
        """Called with the node whose ID was reassigned, and that ID."""
        self.on_unclear: Hooks[int] = Hooks()
        """Called with a stored node ID that an unidentified node uses while its owner requests it. The subscriber
        identifies that node; the owner gets this or another ID with its next request."""
        self.on_competitor_found: Hooks[CompetingAllocator] = Hooks()
        """Called when a competing allocator is first seen."""
        self.on_competitor_gone: Hooks[CompetingAllocator] = Hooks()
        """Called when a competing allocator has left several requests unanswered."""
        self._table = table
        self._own_ids = own_ids
        self._known_nodes = known_nodes
        self._gathered = b""
        self._last_activity: Instant = float("-inf")
        self._began: Instant = float("-inf")
        self._waiting = AllocationRequests()
        self._storing: set[Uid] = set()
        self._unanswered = 0
        # Two of us on one bus yield to each other. Different limits keep them from resuming at the same request.
        self._unanswered_limit = _COMPETITOR_GONE_AFTER + (127 - max(own_ids, default=127)) % 8

    @property
    def state(self) -> AllocatorStatus:
        """Off by mode, standby because of another allocator or program, or on."""
        match self.mode:
            case AllocationMode.OFF:
                return AllocatorStatus.OFF
            case AllocationMode.ON if self.competitor is not None or self.own_id_shared:
                return AllocatorStatus.STANDBY
            case _:
                return AllocatorStatus.ON

    def free(self, now: Instant) -> int:
        """Number of node IDs that can still be assigned to new nodes."""
        taken = self._own_ids | set(self._table.entries().values()) | self._known_nodes.occupied(now)
        return sum(each not in taken for each in range(1, HIGHEST_DYNAMIC + 1))

    def handle(self, message: AllocationMessage, transfer: Transfer, now: Instant) -> AllocationMessage | None:
        """Process one Allocation message of another node. Returns the response to broadcast at once, or None.

        A node ID is sent only after it is stored: as the return value, or by `on_response`.

        Never raises: if the table fails, the node is refused.
        """
        if transfer.source:
            self._note_competitor(transfer.source, message, now)
            return None
        if now - self._last_activity > FOLLOW_UP_TIMEOUT_S:
            self._gathered = b""
        stage = self._stage(message)
        if stage == 0:
            return None
        if stage == 1:
            self._gathered = b""
            self._began = now
            self._reconsider_competitor()
        self._gathered += message.unique_id
        self._last_activity = now
        self._waiting.note(self._gathered, stage, now)
        if self.state is not AllocatorStatus.ON:
            return None
        unique_id = self._gathered
        if stage < len(_PARTS):
            return AllocationMessage(0, False, unique_id)
        self._gathered = b""
        try:
            node_id = self._grant(unique_id, message.node_id, now)
        except Exception:  # a full disk must not stop responses to other nodes
            log.exception("the allocation table failed")
            self._refuse(unique_id, _NOT_STORED)
            return None
        return None if node_id is None else AllocationMessage(node_id, False, unique_id)

    def pending(self, now: Instant) -> list[AllocationRequest]:
        """Nodes without an ID that requested one within the last minute, longest waiting first."""
        return self._waiting.all(now)

    def resume(self) -> None:
        """Leave standby. Another allocator, or our node ID in use elsewhere, starts it again when next seen."""
        self.competitor = None
        self.own_id_shared = False
        self._unanswered = 0

    def _stage(self, message: AllocationMessage) -> int:
        """Which part of a unique ID this is, 1 to 3. 0 if it does not continue the current request.

        A first part always starts a new exchange: on receiving it, all other nodes have abandoned theirs.
        """
        length = len(message.unique_id)
        if message.first_part_of_unique_id:
            return 1 if length == _PARTS[0] else 0
        for stage in (2, 3):
            if len(self._gathered) == sum(_PARTS[: stage - 1]) and length == _PARTS[stage - 1]:
                return stage
        return 0

    def _grant(self, unique_id: bytes, preferred: int, now: Instant) -> NodeId | None:
        uid = Uid(unique_id.hex())
        entries = self._table.entries()
        stored = entries.get(uid)
        if stored is not None:
            claim = self._claim(stored, unique_id, now)
            if claim is _Claim.AVAILABLE:
                return self._assign(uid, unique_id, stored)
            if claim is _Claim.UNCLEAR:
                self.on_unclear.notify(stored)
                return None
            if self._table.pinned(uid):
                text = f"Node ID {stored} is pinned to this node, but another node uses it."
                self._refuse(unique_id, AllocationRefusal("pinned_id_in_use", text, {"node_id": stored}))
                return None
            log.warning("node ID %d of %s is used by another node: assigning a new one", stored, uid)
        if now - self.listening_since < _SETTLE_S:
            return None  # it repeats its request within a second; by then the other nodes are known
        found = self._find(unique_id, preferred, set(entries.values()), now) or self._recycle(entries, now)
        if found is None:
            text = f"All {HIGHEST_DYNAMIC} node IDs are taken. Remove allocations of nodes no longer in use."
            self._refuse(unique_id, AllocationRefusal("all_taken", text, {"node_ids": HIGHEST_DYNAMIC}))
            return None
        return self._assign(uid, unique_id, NodeId(found))

    def _assign(self, uid: Uid, unique_id: bytes, node_id: NodeId) -> NodeId | None:
        """Store first: a node that receives the response keeps the ID even if we stop. None while not yet stored."""
        if uid in self._storing:
            return None  # a repeated request while the store is slow: one response is enough
        write = self._table.record(uid, node_id)
        if write is not None:
            self._storing.add(uid)
            write.add_done_callback(lambda done: self._stored(done, uid, unique_id, node_id))
            return None
        self._assigned(uid, unique_id, node_id)
        return node_id

    def _assigned(self, uid: Uid, unique_id: bytes, node_id: NodeId) -> None:
        self._waiting.drop(unique_id)
        log.info("node ID %d assigned to %s", node_id, uid)
        self.on_granted.notify(uid, node_id)

    def _stored(self, done: PendingWrite, uid: Uid, unique_id: bytes, node_id: NodeId) -> None:
        self._storing.discard(uid)
        if done.exception() is not None:
            self._refuse(unique_id, _NOT_STORED)
        elif self.state is AllocatorStatus.ON:
            self._assigned(uid, unique_id, node_id)
            self.on_response.notify(AllocationMessage(node_id, False, unique_id))

    def _find(self, unique_id: bytes, preferred: int, assigned: set[NodeId], now: Instant) -> int | None:
        """A node ID for a node without one in the table. None if all are taken."""
        taken: set[int] = {*self._own_ids, *assigned}
        last = None if preferred else self._known_nodes.node_id_of(unique_id)
        if last is not None and last not in taken and self._claim(last, unique_id, now) is _Claim.AVAILABLE:
            return last
        found = find_free(preferred, taken | self._known_nodes.known())
        return find_free(preferred, taken | self._known_nodes.occupied(now)) if found is None else found

    def _recycle(self, entries: dict[Uid, NodeId], now: Instant) -> int | None:
        """Free and return the ID of the node offline for longest. None if no node was offline long enough."""
        taken = self._own_ids | self._known_nodes.occupied(now)
        for uid in self._table.idle(RECYCLE_AFTER_S):
            node_id = entries.get(uid)
            if node_id is not None and node_id not in taken and 1 <= node_id <= HIGHEST_DYNAMIC:
                self._table.drop(uid)
                log.warning("node ID %d of %s reassigned to another node: no free ID left", node_id, uid)
                self.on_recycled.notify(uid, node_id)
                return node_id
        return None

    def _claim(self, node_id: int, unique_id: bytes, now: Instant) -> _Claim:
        """Whether the node ID stored for a requesting node can be assigned to it."""
        if node_id in self._own_ids or not 1 <= node_id <= HIGHEST_DYNAMIC:
            return _Claim.TAKEN
        last = self._known_nodes.last_seen(node_id)
        if last is None or node_id not in self._known_nodes.occupied(now):
            return _Claim.AVAILABLE
        if last > self._began:
            return _Claim.TAKEN  # a node that requests an ID has none to send from
        known = self._known_nodes.unique_id_at(node_id)
        if known is not None:
            return _Claim.AVAILABLE if known == unique_id else _Claim.TAKEN
        # A node is silent for at least 0.6 s before its request. Later traffic from its ID is another node's.
        return _Claim.TAKEN if last >= self._began - FOLLOW_UP_TIMEOUT_S else _Claim.UNCLEAR

    def _refuse(self, unique_id: bytes, why: AllocationRefusal) -> None:
        entry = self._waiting.refuse(unique_id, why)
        if entry is not None:
            log.warning("no node ID for %s: %s", unique_id.hex(), why.text)
            self.on_refused.notify(entry)

    def _note_competitor(self, node_id: int, message: AllocationMessage, now: Instant) -> None:
        """Another allocator responded. Two allocators must not respond to one node."""
        before, self.competitor = (
            self.competitor,
            CompetingAllocator(node_id, now, self.competitor.responses + 1 if self.competitor else 1),
        )
        if before is None:
            log.warning("node %d is a competing node ID allocator", node_id)
            self.on_competitor_found.notify(self.competitor)
        self._unanswered = 0
        # Follow its exchange, to show pending requests and to interpret the next part correctly.
        self._gathered = message.unique_id if len(message.unique_id) < sum(_PARTS) else b""
        self._last_activity = now
        if message.node_id and len(message.unique_id) == sum(_PARTS):
            self._waiting.drop(message.unique_id)

    def _reconsider_competitor(self) -> None:
        """Resume when the competing allocator left several requests in a row unanswered."""
        if self.competitor is None:
            return
        self._unanswered += 1
        if self._unanswered > self._unanswered_limit:
            gone = self.competitor
            log.warning("node %d no longer allocates node IDs", gone.node_id)
            self.competitor = None
            self._unanswered = 0
            self.on_competitor_gone.notify(gone)
