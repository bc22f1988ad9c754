"""Node ids as people see them: the allocator's mode and events, pins, and who was seen when."""

import logging
from collections.abc import Callable, Collection
from typing import Final

from hornbill.domain.fields import known
from hornbill.domain.note import Note
from hornbill.errors import Busy, InvalidValue
from hornbill.node.allocation import serve_allocation
from hornbill.node.allocator import AllocationMode, Allocator, AllocatorStatus, CompetingAllocator, PendingWrite
from hornbill.node.directory import Directory
from hornbill.node.node_ids import HIGHEST_DYNAMIC
from hornbill.node.participant import Participant
from hornbill.node.programs import MAKERS_PROGRAM
from hornbill.node.shared_id import SharedNodeId
from hornbill.node.waiting import AllocationRequest
from hornbill.servo.runtime.hub import BusChanged, Hub, LogEvent
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.store import Store
from hornbill.units import Instant, NodeId, Uid

log = logging.getLogger(__name__)

STORE_SEEN_S = 60.0
"""How often it is kept that the nodes which are online are there: what a crash may lose of their last_seen."""

SHARED_FOR_S: Final = 60.0
"""How long our node id must have been ours alone before node ids are given again."""

_SETTING = "allocator"


class NodeIdTable:
    """The allocator of the connected bus, if there is one, and what outlives it."""

    def __init__(
        self,
        store: Store,
        hub: Hub,
        base: TimeBase,
        identify: Callable[[int], None],
        *,
        own_id: int,
        mode: AllocationMode | None,
    ) -> None:
        """`identify` asks a node who it is; `mode` is what was asked for at the start, None what was chosen last."""
        self.own_id = own_id
        self._store = store
        self._hub = hub
        self._base = base
        self._identify = identify
        self._directory = Directory()
        self.allocator = self._make(mode or _stored_mode(store))
        """While no bus is connected one that hears nothing."""
        self._shared: SharedNodeId | None = None
        self._granted: dict[int, Instant] = {}
        self._seen_at: Instant = base.now()

    def join(self, participant: Participant, directory: Directory, *, recorded: bool = False) -> Allocator:
        """Give ids on this bus from now on; on one that is `recorded` nobody asks for one now."""
        self._directory, self._granted = directory, {}
        self.allocator = allocator = self._make(self.allocator.mode)
        allocator.on_granted.append(self._on_granted)
        allocator.on_refused.append(self._on_refused)
        allocator.on_recycled.append(self._on_recycled)
        allocator.on_unclear.append(self._identify)
        allocator.on_competitor_found.append(self._on_competitor_found)
        allocator.on_competitor_gone.append(self._on_competitor_gone)
        self._shared = participant.shared_id
        self._shared.on_seen.append(self._on_shared)
        if not recorded:
            serve_allocation(participant, allocator)
        return allocator

    def leave(self) -> None:
        """The bus is left: keep who was there. Twice is harmless."""
        self._store_seen()
        self._directory, self._granted = Directory(), {}
        if self._shared is not None:
            self._shared.on_seen.remove(self._on_shared)
            self._shared = None
        self.allocator = self._make(self.allocator.mode)

    def tick(self, now: Instant) -> None:
        """Call it every few seconds or more often."""
        shared = self._shared
        if shared is not None and self.allocator.own_id_shared and now - (shared.last_seen or now) >= SHARED_FOR_S:
            self._end_sharing(shared)
        if now - self._seen_at >= STORE_SEEN_S:
            self._store_seen()

    def granted_at(self, node_id: int) -> Instant | None:
        """When a node id was given on this bus, if it was."""
        return self._granted.get(node_id)

    def online(self) -> dict[Uid, NodeId]:
        """The nodes that are there and whose unique id is known, servos or not, with the id each is on."""
        found = self._directory.online(self._base.now())
        return {Uid(one.unique_id.hex()): NodeId(one.node_id) for one in found if one.unique_id is not None}

    async def choose(self, mode: AllocationMode) -> None:
        """Change the mode now, and for the next start. Another allocator that was heard is forgotten."""
        await self._store.run(self._store.settings.put, _SETTING, mode.value)
        self.allocator.mode = mode
        self.allocator.resume()
        self._hub.publish(
            LogEvent(
                "notice", "allocator_mode", f"The node-id allocator was set to {mode}.", params={"mode": mode.value}
            )
        )
        self._hub.publish(BusChanged())

    async def pin(self, uid: Uid, node_id: int) -> Note:
        """Choose a node's id, 1..125, and say when it takes effect. Raises OutOfRange and InvalidValue."""
        if node_id == self.own_id and node_id <= HIGHEST_DYNAMIC:
            raise InvalidValue(
                f"Node id {node_id} is hornbill's own. Choose another.", node_id=node_id, cause="own_node_id"
            )
        resident = self._directory.unique_id_at(node_id)
        foreign = resident is None or resident.hex() != uid
        if foreign and self._directory.is_online(node_id, self._base.now()):
            raise InvalidValue(
                f"Node id {node_id} is in use by another node. Choose another, or switch that node off first.",
                node_id=node_id,
                owner=None if resident is None else resident.hex(),
                cause="node_id_in_use",
            )
        await self._store.run(self._store.allocations.pin, uid, NodeId(node_id))
        now_on = self.online().get(uid)
        if now_on == node_id:
            return Note(f"It is on node id {node_id} already and keeps it.", "pin_unchanged", {"node_id": node_id})
        here = "" if now_on is None else f" Until then it stays on {now_on}."
        text = f"It gets node id {node_id} when it asks for one the next time: at its next start.{here}"
        return Note(text, "pin_at_restart", known(node_id=node_id, now_on=now_on))

    async def forget(self, uid: Uid, busy: str | None) -> Note:
        """Free a node's id, and say when that takes effect.

        `busy` names what the node is doing that must not be disturbed. Raises Unknown (unknown_uid) and Busy.
        """
        node_id = self._store.allocations.get(uid).node_id
        if busy is not None:
            raise Busy(
                f"{busy} Its node id cannot be forgotten before that has ended.",
                node_id=node_id,
                cause="allocation_busy",
            )
        await self._store.run(self._store.allocations.drop, uid)
        now_on = self.online().get(uid)
        if now_on is None:
            text = f"Node id {node_id} is free now. Should the node ask again, it is new."
            return Note(text, "id_freed", {"node_id": node_id})
        text = f"The node is online and keeps node id {now_on} until it starts anew; then it is given one as if new."
        return Note(text, "id_changes_at_restart", {"node_id": now_on})

    async def recycle(self, idle_longer_than_s: float, spared: Collection[Uid]) -> list[Uid]:
        """Free the ids of nodes without a pin not seen for so long, but for those `spared`; whose they were.

        Should one of them ask again, it is new.
        """
        freed = [uid for uid in self._store.allocations.idle(idle_longer_than_s) if uid not in spared]
        for uid in freed:
            await self._store.run(self._store.allocations.drop, uid)
        if freed:
            count = "1 node id was" if len(freed) == 1 else f"{len(freed)} node ids were"
            text = f"{count} freed: their nodes were not seen for {idle_longer_than_s:g} s."
            self._hub.publish(
                LogEvent("notice", "node_ids_freed", text, params={"count": len(freed), "idle_s": idle_longer_than_s})
            )
            self._hub.publish(BusChanged())
        return freed

    def _make(self, mode: AllocationMode) -> Allocator:
        own = frozenset((self.own_id,))
        return Allocator(_Table(self._store), own_ids=own, known_nodes=self._directory, mode=mode)

    def _on_granted(self, uid: Uid, node_id: NodeId) -> None:
        self._granted[node_id] = self._base.now()
        text = f"Node id {node_id} given to {uid[:8]}…"
        self._hub.publish(LogEvent("info", "allocated", text, params={"node_id": node_id, "uid": uid}))

    def _on_refused(self, pending: AllocationRequest) -> None:
        refusal = pending.refused
        assert refusal is not None
        text = f"No node id for {pending.partial}: {refusal.text}"
        params: dict[str, object] = {**refusal.params, "refusal": refusal.code, "uid": pending.partial}
        self._hub.publish(LogEvent("failure", "no_node_id", text, Uid(pending.partial), params))

    def _on_recycled(self, uid: Uid, node_id: NodeId) -> None:
        text = f"Node id {node_id} was taken from {uid}, not seen for a month, for a new node: no other was left."
        self._hub.publish(LogEvent("warning", "node_id_recycled", text, uid, {"node_id": node_id, "uid": uid}))

    def _on_competitor_found(self, competitor: CompetingAllocator) -> None:
        what = {
            AllocatorStatus.ON: "This one answers all the same, as it was told to.",
            AllocatorStatus.OFF: "This one is off.",
            AllocatorStatus.STANDBY: "This one stands down.",
        }[self.allocator.state]
        text = f"Node {competitor.node_id} gives node ids too. {what}"
        params: dict[str, object] = {"node_id": competitor.node_id, "allocator": self.allocator.state.value}
        self._hub.publish(LogEvent("warning", "second_allocator", text, params=params))
        self._hub.publish(BusChanged())

    def _on_competitor_gone(self, competitor: CompetingAllocator) -> None:
        what = "This one gives them again." if self.allocator.state is AllocatorStatus.ON else ""
        text = f"Node {competitor.node_id} no longer gives node ids. {what}".rstrip()
        params: dict[str, object] = {"node_id": competitor.node_id, "allocator": self.allocator.state.value}
        self._hub.publish(LogEvent("notice", "second_allocator_gone", text, params=params))
        self._hub.publish(BusChanged())

    def _on_shared(self, now: Instant) -> None:
        """Another program speaks with our node id: give no ids beside it."""
        allocator, shared = self.allocator, self._shared
        if shared is None or allocator.own_id_shared or not shared.is_program:
            return
        allocator.own_id_shared = True
        program = MAKERS_PROGRAM if shared.is_makers_program else "Another program"
        gives = {
            AllocatorStatus.ON: "hornbill gives node ids all the same, as it was told to.",
            AllocatorStatus.OFF: "hornbill gives no node ids: its allocator is off.",
            AllocatorStatus.STANDBY: f"hornbill gives no node ids until {SHARED_FOR_S:g} s after its last frame.",
        }[allocator.state]
        text = f"{program} uses hornbill's node id {self.own_id}. {gives} Close one of the two programs."
        params: dict[str, object] = {
            "node_id": self.own_id, "makers_program": shared.is_makers_program, "allocator": allocator.state.value,
            "shared_s": SHARED_FOR_S,
        }  # fmt: skip
        self._hub.publish(LogEvent("warning", "own_node_id", text, params=params))
        self._hub.publish(BusChanged())

    def _end_sharing(self, shared: SharedNodeId) -> None:
        self.allocator.own_id_shared = False
        gives = " It gives node ids again." if self.allocator.state is AllocatorStatus.ON else ""
        text = f"Node id {shared.node_id} has been hornbill's alone for {SHARED_FOR_S:g} s.{gives}"
        params: dict[str, object] = {"node_id": shared.node_id, "allocator": self.allocator.state.value}
        self._hub.publish(LogEvent("notice", "own_node_id_alone", text, params=params))
        self._hub.publish(BusChanged())

    def _store_seen(self) -> None:
        self._seen_at = self._base.now()
        try:
            self._store.allocations.seen(list(self.online()))
        except Exception:  # a full disk must not end the tick that watches leases
            log.exception("the allocation table could not be kept up to date")


class _Table:
    """The allocation table for the allocator: as it is now, and when what was recorded lasts."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def entries(self) -> dict[Uid, NodeId]:
        return self._store.allocations.entries()

    def pinned(self, uid: Uid) -> bool:
        return self._store.allocations.pinned(uid)

    def record(self, uid: Uid, node_id: NodeId) -> PendingWrite | None:
        self._store.allocations.record(uid, node_id)
        return self._store.posted(self._store.allocations)

    def idle(self, longer_than_s: float) -> list[Uid]:
        return self._store.allocations.idle(longer_than_s)

    def drop(self, uid: Uid) -> None:
        self._store.allocations.drop(uid)


def _stored_mode(store: Store) -> AllocationMode:
    kept = store.settings.get(_SETTING)
    return AllocationMode(kept) if kept in list(AllocationMode) else AllocationMode.ON
