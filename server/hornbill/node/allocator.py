"""Which node id a node without one is given, as a function of what it sends and when."""

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
"""A half-told unique id is forgotten when its next part does not come in time (FOLLOWUP_TIMEOUT_MS)."""

ANSWER_PRIORITY: Final = 24
"""The servos' own for Allocation (table 2-2); among equals the low type id still wins the bus."""

RECYCLE_AFTER_S: Final = 30 * 86_400.0
"""How long a node must have been away before its id may be given to another, and only when no id is left.

Long enough for a servo on the shelf or a bench on holiday; a station that commissions servo after servo
would otherwise stand still at the 126th. A pinned id is never recycled.
"""

_PARTS: Final = (6, 6, 4)
"""Bytes of unique id in the three requests (table 2-7)."""

_SETTLE_S: Final = 0.5
"""How long to listen before new ids are given: servos with an id say Status ten times a second."""

_RIVAL_GONE_AFTER: Final = 3
"""First parts without an answer, after which another allocator is taken for gone."""


class Lasting(Protocol):
    """A change that is on its way to where it lasts; an asyncio.Future is one."""

    def add_done_callback(self, fn: Callable[[Any], object], /) -> None:
        """Call `fn` when the change lasts, or cannot."""
        ...

    def exception(self) -> BaseException | None:
        """Why it cannot; once it is done."""
        ...


class AllocationTable(Protocol):
    """Who has which node id."""

    def entries(self) -> dict[Uid, NodeId]:
        """Every unique id that ever got a node id or was pinned to one."""
        ...

    def pinned(self, uid: Uid) -> bool:
        """Whether a person chose this node's id, so that no other may be given."""
        ...

    def record(self, uid: Uid, node_id: NodeId) -> Lasting | None:
        """Keep that a node was given an id now; None when that lasts already."""
        ...

    def idle(self, longer_than_s: float) -> list[Uid]:
        """Nodes without a pin that were last seen longer ago than that, the longest unseen first."""
        ...

    def drop(self, uid: Uid, /) -> None:
        """Free a node's id."""
        ...


class Residents(Protocol):
    """Who lives on the bus already; Directory is one."""

    def known(self) -> set[int]:
        """Node ids that belong to somebody, who may only be switched off."""
        ...

    def occupied(self, now: Instant) -> set[int]:
        """Node ids in use now."""
        ...

    def resident(self, node_id: int) -> bytes | None:
        """The unique id at a node id, where it is known."""
        ...

    def home(self, unique_id: bytes) -> int | None:
        """The node id a unique id was last met at, or None."""
        ...

    def last_heard(self, node_id: int) -> Instant | None:
        """When anything last came from a node id."""
        ...


@dataclass(frozen=True, slots=True)
class Rival:
    """Another allocator that answers on this bus."""

    node_id: int
    heard: Instant
    answers: int


_NOT_KEPT: Final = AllocationRefusal(
    "table_failed", "The allocation table cannot be read or written. Check the data folder."
)


class AllocationMode(StrEnum):
    """What was chosen: to answer unless another allocator does, never, or whoever else answers."""

    ON = "on"
    OFF = "off"
    INSIST = "insist"


class AllocatorStatus(StrEnum):
    """What the allocator does, in one word."""

    ON = "on"
    OFF = "off"
    STANDING_DOWN = "standing_down"


class _Claim(Enum):
    """Whose a node id is, when the node it is kept for asks for one."""

    ITS_OWN = 1
    ANOTHERS = 2
    UNCLEAR = 3


class Allocator:
    """Answers Allocation messages by the rules of uavcan.protocol.dynamic_node_id.Allocation.

    The same unique id gets the same node id for as long as the table has it. A new one gets the nearest free
    id to the one it would like, searching upward first; without a wish the id it was met at before, else the
    highest free one up to 125. An id somebody else uses is never given. When none is left, the id of the
    node that was away for longest, RECYCLE_AFTER_S at least, goes to the new one; without such a node it is
    refused. While another allocator answers, or another program has our node id, this one is silent unless it insists.
    """

    def __init__(
        self,
        table: AllocationTable,
        *,
        own_ids: frozenset[int],
        residents: Residents,
        mode: AllocationMode = AllocationMode.ON,
        listening_since: Instant = float("-inf"),
    ) -> None:
        """`own_ids` are never given; `listening_since` is when `residents` began to hear the bus."""
        self.mode = mode
        """When off, requests are followed and shown all the same."""
        self.listening_since = listening_since
        self.rival: Rival | None = None
        self.own_id_shared = False
        """Another program speaks with our node id: a node cannot tell its answers from ours."""
        self.on_answer: Hooks[AllocationMessage] = Hooks()
        """Called with the answer that gives a node its id, when that lasts only after `handle` has returned."""
        self.on_granted: Hooks[Uid, NodeId] = Hooks()
        self.on_refused: Hooks[AllocationRequest] = Hooks()
        """Called once for each reason a node cannot be given an id; its `partial` is the whole unique id."""
        self.on_recycled: Hooks[Uid, NodeId] = Hooks()
        """Called with the node that lost an id to another, and that id."""
        self.on_unclear: Hooks[int] = Hooks()
        """Called with a node id whose owner asks for it again while nobody knows who uses it: ask who it is.
        The owner gets its id, or another, when it asks the next time."""
        self.on_rival: Hooks[Rival] = Hooks()
        """Called when another allocator is first heard."""
        self.on_rival_gone: Hooks[Rival] = Hooks()
        """Called when another allocator has left several nodes without an answer."""
        self._table = table
        self._own_ids = own_ids
        self._residents = residents
        self._gathered = b""
        self._last_activity: Instant = float("-inf")
        self._began: Instant = float("-inf")
        self._waiting = AllocationRequests()
        self._keeping: set[Uid] = set()
        self._unanswered = 0
        # Two of us on one bus stand down for each other; they must not come back at the same request.
        self._patience = _RIVAL_GONE_AFTER + (127 - max(own_ids, default=127)) % 8

    @property
    def state(self) -> AllocatorStatus:
        """Off by choice, standing down for another allocator, or on."""
        match self.mode:
            case AllocationMode.OFF:
                return AllocatorStatus.OFF
            case AllocationMode.ON if self.rival is not None or self.own_id_shared:
                return AllocatorStatus.STANDING_DOWN
            case _:
                return AllocatorStatus.ON

    def free(self, now: Instant) -> int:
        """How many node ids can still be given to nodes that never had one."""
        taken = self._own_ids | set(self._table.entries().values()) | self._residents.occupied(now)
        return sum(each not in taken for each in range(1, HIGHEST_DYNAMIC + 1))

    def handle(self, message: AllocationMessage, transfer: Transfer, now: Instant) -> AllocationMessage | None:
        """Take one Allocation message from the bus, ours excepted; the answer to broadcast at once, or None.

        A node is told its id when the table keeps it for good: at once, or by `on_answer`.

        Never raises: a node is refused when the table fails.
        """
        if transfer.source:
            self._meet(transfer.source, message, now)
            return None
        if now - self._last_activity > FOLLOW_UP_TIMEOUT_S:
            self._gathered = b""
        stage = self._stage(message)
        if stage == 0:
            return None
        if stage == 1:
            self._gathered = b""
            self._began = now
            self._reconsider_rival()
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
        except Exception:  # a full disk must not end the answers to others
            log.exception("the allocation table failed")
            self._refuse(unique_id, _NOT_KEPT)
            return None
        return None if node_id is None else AllocationMessage(node_id, False, unique_id)

    def pending(self, now: Instant) -> list[AllocationRequest]:
        """Nodes heard asking within the last minute that have no id yet, the longest waiting first."""
        return self._waiting.all(now)

    def resume(self) -> None:
        """Answer again although another allocator or our own node id was heard; hearing it again silences us again."""
        self.rival = None
        self.own_id_shared = False
        self._unanswered = 0

    def _stage(self, message: AllocationMessage) -> int:
        """Which part of a unique id this is, 1 to 3; 0 when it fits nothing we wait for.

        A first part always begins anew: hearing it has already made every other node give up its turn.
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
        kept = entries.get(uid)
        if kept is not None:
            claim = self._claim(kept, unique_id, now)
            if claim is _Claim.ITS_OWN:
                return self._give(uid, unique_id, kept)
            if claim is _Claim.UNCLEAR:
                self.on_unclear.tell(kept)
                return None
            if self._table.pinned(uid):
                text = f"Node id {kept} is pinned to it, but another node uses that id."
                self._refuse(unique_id, AllocationRefusal("pinned_id_in_use", text, {"node_id": kept}))
                return None
            log.warning("node id %d of %s is used by another node: it gets a new one", kept, uid)
        if now - self.listening_since < _SETTLE_S:
            return None  # it asks again within a second, and then we know who else is here
        found = self._find(unique_id, preferred, set(entries.values()), now) or self._recycle(entries, now)
        if found is None:
            text = f"All {HIGHEST_DYNAMIC} node ids are taken. Forget allocations of nodes that are gone."
            self._refuse(unique_id, AllocationRefusal("all_taken", text, {"node_ids": HIGHEST_DYNAMIC}))
            return None
        return self._give(uid, unique_id, NodeId(found))

    def _give(self, uid: Uid, unique_id: bytes, node_id: NodeId) -> NodeId | None:
        """Keep it first: whoever hears the answer has the id, whatever becomes of us. None: it is not kept yet."""
        if uid in self._keeping:
            return None  # it asks again because the store is slow: one answer is enough
        lasting = self._table.record(uid, node_id)
        if lasting is not None:
            self._keeping.add(uid)
            lasting.add_done_callback(lambda done: self._kept(done, uid, unique_id, node_id))
            return None
        self._given(uid, unique_id, node_id)
        return node_id

    def _given(self, uid: Uid, unique_id: bytes, node_id: NodeId) -> None:
        self._waiting.drop(unique_id)
        log.info("node id %d given to %s", node_id, uid)
        self.on_granted.tell(uid, node_id)

    def _kept(self, done: Lasting, uid: Uid, unique_id: bytes, node_id: NodeId) -> None:
        self._keeping.discard(uid)
        if done.exception() is not None:
            self._refuse(unique_id, _NOT_KEPT)
        elif self.state is AllocatorStatus.ON:
            self._given(uid, unique_id, node_id)
            self.on_answer.tell(AllocationMessage(node_id, False, unique_id))

    def _find(self, unique_id: bytes, preferred: int, kept: set[NodeId], now: Instant) -> int | None:
        """A node id for a node that has none in the table, or None when every one belongs to somebody."""
        taken: set[int] = {*self._own_ids, *kept}
        home = None if preferred else self._residents.home(unique_id)
        if home is not None and home not in taken and self._claim(home, unique_id, now) is _Claim.ITS_OWN:
            return home
        found = find_free(preferred, taken | self._residents.known())
        return find_free(preferred, taken | self._residents.occupied(now)) if found is None else found

    def _recycle(self, entries: dict[Uid, NodeId], now: Instant) -> int | None:
        """The id of the node that was away for longest, which is forgotten; None when nobody was away for long."""
        taken = self._own_ids | self._residents.occupied(now)
        for uid in self._table.idle(RECYCLE_AFTER_S):
            node_id = entries.get(uid)
            if node_id is not None and node_id not in taken and 1 <= node_id <= HIGHEST_DYNAMIC:
                self._table.drop(uid)
                log.warning("node id %d of %s is given to another node: no other was left", node_id, uid)
                self.on_recycled.tell(uid, node_id)
                return node_id
        return None

    def _claim(self, node_id: int, unique_id: bytes, now: Instant) -> _Claim:
        """Whether the id kept for a node that asks now can be given to it."""
        if node_id in self._own_ids or not 1 <= node_id <= HIGHEST_DYNAMIC:
            return _Claim.ANOTHERS
        last = self._residents.last_heard(node_id)
        if last is None or node_id not in self._residents.occupied(now):
            return _Claim.ITS_OWN
        if last > self._began:
            return _Claim.ANOTHERS  # who asks for an id has none to speak from
        resident = self._residents.resident(node_id)
        if resident is not None:
            return _Claim.ITS_OWN if resident == unique_id else _Claim.ANOTHERS
        # A node is silent for at least 0.6 s before it asks. What came from its id since then is another's.
        return _Claim.ANOTHERS if last >= self._began - FOLLOW_UP_TIMEOUT_S else _Claim.UNCLEAR

    def _refuse(self, unique_id: bytes, why: AllocationRefusal) -> None:
        entry = self._waiting.refuse(unique_id, why)
        if entry is not None:
            log.warning("no node id for %s: %s", unique_id.hex(), why.text)
            self.on_refused.tell(entry)

    def _meet(self, node_id: int, message: AllocationMessage, now: Instant) -> None:
        """Another allocator answered: its exchange is not ours, and two must not answer one node."""
        before, self.rival = self.rival, Rival(node_id, now, self.rival.answers + 1 if self.rival else 1)
        if before is None:
            log.warning("node %d allocates node ids too", node_id)
            self.on_rival.tell(self.rival)
        self._unanswered = 0
        # Whom it has got how far, so that we can show who waits and do not mistake the next part.
        self._gathered = message.unique_id if len(message.unique_id) < sum(_PARTS) else b""
        self._last_activity = now
        if message.node_id and len(message.unique_id) == sum(_PARTS):
            self._waiting.drop(message.unique_id)

    def _reconsider_rival(self) -> None:
        """Come back when the other allocator left several requests in a row without an answer."""
        if self.rival is None:
            return
        self._unanswered += 1
        if self._unanswered > self._patience:
            gone = self.rival
            log.warning("node %d no longer allocates node ids", gone.node_id)
            self.rival = None
            self._unanswered = 0
            self.on_rival_gone.tell(gone)
