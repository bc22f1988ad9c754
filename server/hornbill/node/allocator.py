"""Owns Allocator: which node id a node without one is given, as a function of what it sends and when."""

import logging
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final, Protocol

from hornbill.node.hooks import Hooks
from hornbill.node.node_ids import HIGHEST_DYNAMIC, find_free
from hornbill.units import Instant, NodeId, Uid
from hornbill.wire.messages import Allocation
from hornbill.wire.transfer import Transfer

log = logging.getLogger(__name__)

FOLLOW_UP_TIMEOUT_S: Final = 0.5
"""A half-told unique id is forgotten when its next part does not come in time (FOLLOWUP_TIMEOUT_MS)."""

ANSWER_PRIORITY: Final = 24
"""The servos' own for Allocation (table 2-2); among equals the low type id still wins the bus."""

_PARTS: Final = (6, 6, 4)
"""Bytes of unique id in the three requests (table 2-7)."""

_SETTLE_S: Final = 0.5
"""How long to listen before new ids are given: servos with an id say Status ten times a second."""

_PENDING_KEPT_S: Final = 60.0
_PENDING_MOST: Final = 256
_RIVAL_GONE_AFTER: Final = 3
"""First parts without an answer, after which another allocator is taken for gone."""


class AllocationTable(Protocol):
    """Who has which node id: `record` and `forget` must last before they return."""

    def entries(self) -> dict[Uid, NodeId]:
        """Every unique id that ever got a node id or was pinned to one."""
        ...

    def pinned(self, uid: Uid) -> bool:
        """Whether a person chose this node's id, so that no other may be given."""
        ...

    def record(self, uid: Uid, node_id: NodeId) -> None:
        """Keep that a node was given an id now."""
        ...


class Residents(Protocol):
    """Who lives on the bus already; Directory is one."""

    def known(self) -> set[int]:
        """Node ids anything was ever heard from."""
        ...

    def occupied(self, now: Instant) -> set[int]:
        """Node ids in use now."""
        ...

    def resident(self, node_id: int) -> bytes | None:
        """The unique id at a node id, where it is known."""
        ...

    def last_heard(self, node_id: int) -> Instant | None:
        """When anything last came from a node id."""
        ...


@dataclass(frozen=True, slots=True)
class Pending:
    """A node that waits for an id. `partial` is what is known of its unique id, in hex (12, 24 or 32 digits).

    `stage` is how many of the three parts were heard when it got furthest, `attempts` counts first parts,
    and `refusal` says why it gets none.
    """

    partial: str
    stage: int
    first_heard: Instant
    last_heard: Instant
    attempts: int
    refusal: str | None = None


@dataclass(frozen=True, slots=True)
class Rival:
    """Another allocator that answers on this bus."""

    node_id: int
    heard: Instant
    answers: int


class AllocatorMode(StrEnum):
    """What was chosen: to answer unless another allocator does, never, or whoever else answers."""

    ON = "on"
    OFF = "off"
    INSIST = "insist"


class AllocatorState(StrEnum):
    """What the allocator does, in one word."""

    ON = "on"
    OFF = "off"
    STANDING_DOWN = "standing_down"


class Allocator:
    """Answers Allocation messages by the rules of uavcan.protocol.dynamic_node_id.Allocation.

    The same unique id gets the same node id for as long as the table has it. A new one gets the highest free
    id up to 125, or the nearest free one to the id it would like, searching upward first. An id somebody
    else uses is never given. While another allocator answers, this one is silent.
    """

    def __init__(
        self,
        table: AllocationTable,
        *,
        own_ids: frozenset[int],
        residents: Residents,
        listening_since: Instant = float("-inf"),
    ) -> None:
        """`own_ids` are never given; `listening_since` is when `residents` began to hear the bus."""
        self.mode = AllocatorMode.ON
        """When off, requests are followed and shown all the same."""
        self.listening_since = listening_since
        self.rival: Rival | None = None
        self.on_granted: Hooks[Uid, NodeId] = Hooks()
        self.on_refused: Hooks[Pending] = Hooks()
        """Called once for each reason a node cannot be given an id; its `partial` is the whole unique id."""
        self._table = table
        self._own_ids = own_ids
        self._residents = residents
        self._gathered = b""
        self._last_activity: Instant = float("-inf")
        self._began: Instant = float("-inf")
        self._pending: dict[bytes, Pending] = {}
        self._unanswered = 0
        # Two of us on one bus stand down for each other; they must not come back at the same request.
        self._patience = _RIVAL_GONE_AFTER + (127 - max(own_ids, default=127)) % 8

    @property
    def state(self) -> AllocatorState:
        """Off by choice, standing down for another allocator, or on."""
        match self.mode:
            case AllocatorMode.OFF:
                return AllocatorState.OFF
            case AllocatorMode.ON if self.rival is not None:
                return AllocatorState.STANDING_DOWN
            case _:
                return AllocatorState.ON

    def free(self, now: Instant) -> int:
        """How many node ids can still be given to nodes that never had one."""
        taken = self._own_ids | set(self._table.entries().values()) | self._residents.occupied(now)
        return sum(each not in taken for each in range(1, HIGHEST_DYNAMIC + 1))

    def handle(self, message: Allocation, transfer: Transfer, now: Instant) -> Allocation | None:
        """Take one Allocation message from the bus, ours excepted; the answer to broadcast at once, or None.

        Never raises for what is in the message; what the table raises comes through.
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
        self._note(stage, now)
        if self.state is not AllocatorState.ON:
            return None
        unique_id = self._gathered
        if stage < len(_PARTS):
            return Allocation(0, False, unique_id)
        self._gathered = b""
        node_id = self._grant(unique_id, message.node_id, now)
        return None if node_id is None else Allocation(node_id, False, unique_id)

    def pending(self, now: Instant) -> list[Pending]:
        """Nodes heard asking within the last minute that have no id yet, the longest waiting first."""
        self._pending = {k: p for k, p in self._pending.items() if now - p.last_heard < _PENDING_KEPT_S}
        return sorted(self._pending.values(), key=lambda each: each.first_heard)

    def resume(self) -> None:
        """Answer again although another allocator was heard; the next answer of it silences us again."""
        self.rival = None
        self._unanswered = 0

    def _stage(self, message: Allocation) -> int:
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
        node_id = entries.get(uid)
        if node_id is not None and not self._is_usable(node_id, unique_id, now):
            if self._table.pinned(uid):
                self._refuse(unique_id, f"Node id {node_id} is pinned to it, but another node uses that id.")
                return None
            log.warning("node id %d of %s is used by another node: it gets a new one", node_id, uid)
            node_id = None
        if node_id is None:
            if now - self.listening_since < _SETTLE_S:
                return None  # it asks again within a second, and then we know who else is here
            taken = self._own_ids | set(entries.values())
            found = find_free(preferred, taken | self._residents.known())
            if found is None:
                found = find_free(preferred, taken | self._residents.occupied(now))
            if found is None:
                self._refuse(
                    unique_id,
                    f"All {HIGHEST_DYNAMIC} node ids are taken. Forget allocations of nodes that are gone.",
                )
                return None
            node_id = NodeId(found)
        self._table.record(uid, node_id)
        self._pending.pop(unique_id[: _PARTS[0]], None)
        log.info("node id %d given to %s", node_id, uid)
        self.on_granted.tell(uid, node_id)
        return node_id

    def _is_usable(self, node_id: int, unique_id: bytes, now: Instant) -> bool:
        """Whether the id in the table can be given to its node again."""
        if node_id in self._own_ids or not 1 <= node_id <= HIGHEST_DYNAMIC:
            return False
        if node_id not in self._residents.occupied(now):
            return True
        resident = self._residents.resident(node_id)
        if resident is not None:
            return resident == unique_id
        # A node is silent for at least 0.6 s before it asks. What came from its id since then is another's.
        last = self._residents.last_heard(node_id)
        return last is None or last < self._began - FOLLOW_UP_TIMEOUT_S

    def _note(self, stage: int, now: Instant) -> None:
        """Keep who waits, for people to see. Nodes with the same first six bytes share an entry."""
        key = self._gathered[: _PARTS[0]]
        before = self._pending.get(key)
        if before is None:
            if len(self._pending) >= _PENDING_MOST:
                del self._pending[min(self._pending, key=lambda each: self._pending[each].last_heard)]
            before = Pending("", 0, now, now, 0)
        partial = self._gathered.hex()
        further = len(partial) > len(before.partial) or not before.partial.startswith(partial)
        self._pending[key] = replace(
            before,
            partial=partial if further else before.partial,
            stage=stage if further else before.stage,
            last_heard=now,
            attempts=before.attempts + (stage == 1),
        )

    def _refuse(self, unique_id: bytes, why: str) -> None:
        key = unique_id[: _PARTS[0]]
        entry = replace(self._pending[key], refusal=why)
        if self._pending[key].refusal != why:
            log.warning("no node id for %s: %s", unique_id.hex(), why)
            self.on_refused.tell(entry)
        self._pending[key] = entry

    def _meet(self, node_id: int, message: Allocation, now: Instant) -> None:
        """Another allocator answered: its exchange is not ours, and two must not answer one node."""
        if self.rival is None:
            log.warning("node %d allocates node ids too: standing down", node_id)
        self.rival = Rival(node_id, now, self.rival.answers + 1 if self.rival else 1)
        self._unanswered = 0
        # Whom it has got how far, so that we can show who waits and do not mistake the next part.
        self._gathered = message.unique_id if len(message.unique_id) < sum(_PARTS) else b""
        self._last_activity = now
        if message.node_id and len(message.unique_id) == sum(_PARTS):
            self._pending.pop(message.unique_id[: _PARTS[0]], None)

    def _reconsider_rival(self) -> None:
        """Come back when the other allocator left several requests in a row without an answer."""
        if self.rival is None:
            return
        self._unanswered += 1
        if self._unanswered > self._patience:
            log.warning("node %d no longer allocates node ids: taking over", self.rival.node_id)
            self.resume()
