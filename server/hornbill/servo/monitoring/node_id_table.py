"""Node IDs: mode and events of the allocator, pins, and when nodes were last seen."""

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
"""Interval at which last_seen of online nodes is stored. A crash may lose this much of it."""

SHARED_FOR_S: Final = 60.0
"""Time for which our node ID must be unshared before node IDs are allocated again."""

_SETTING = "allocator"


class NodeIdTable:
    """The allocator of the connected bus, and the data that outlasts it."""

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
        """`identify` identifies the node on an ID. `mode`: allocator mode from settings, None for the stored one."""
        self.own_id = own_id
        self._store = store
        self._hub = hub
        self._base = base
        self._identify = identify
        self._directory = Directory()
        self.allocator = self._make(mode or _stored_mode(store))
        """An idle one while no bus is connected."""
        self.serving = True
        """Whether the role on this bus permits allocation."""
        self._shared: SharedNodeId | None = None
        self._granted: dict[int, Instant] = {}
        self._seen_at: Instant = base.now()

    def join(self, participant: Participant, directory: Directory, *, serve: bool = True) -> Allocator:
        """Follow this bus, and allocate node IDs on it if `serve`: not in a recording, nor as guest or observer."""
        self.serving = serve
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
        if serve:
            serve_allocation(participant, allocator)
        return allocator

    def leave(self) -> None:
        """Leave the bus and store when its nodes were last seen. Idempotent."""
        self._store_seen()
        self._directory, self._granted = Directory(), {}
        if self._shared is not None:
            self._shared.on_seen.remove(self._on_shared)
            self._shared = None
        self.allocator = self._make(self.allocator.mode)

    def tick(self, now: Instant) -> None:
        """Update sharing and last_seen. Call at least every few seconds."""
        shared = self._shared
        if shared is not None and self.allocator.own_id_shared and now - (shared.last_seen or now) >= SHARED_FOR_S:
            self._end_sharing(shared)
        if now - self._seen_at >= STORE_SEEN_S:
            self._store_seen()

    def granted_at(self, node_id: int) -> Instant | None:
        """When a node ID was allocated on this bus. None if it was not."""
        return self._granted.get(node_id)

    def online(self) -> dict[Uid, NodeId]:
        """Online nodes with a known unique ID, servos or not, and their node IDs."""
        found = self._directory.online(self._base.now())
        return {Uid(one.unique_id.hex()): NodeId(one.node_id) for one in found if one.unique_id is not None}

    async def choose(self, mode: AllocationMode) -> None:
        """Set the mode, now and for the next start. Forgets any competing allocator seen so far."""
        await self._store.run(self._store.settings.put, _SETTING, mode.value)
        self.allocator.mode = mode
        self.allocator.resume()
        self._hub.publish(
            LogEvent("notice", "allocator_mode", f"Node ID allocator set to {mode}.", params={"mode": mode.value})
        )
        self._hub.publish(BusChanged())

    async def pin(self, uid: Uid, node_id: int) -> Note:
        """Pin a node to an ID, 1..125. Returns when it takes effect. Raises OutOfRange and InvalidValue."""
        if node_id == self.own_id and node_id <= HIGHEST_DYNAMIC:
            raise InvalidValue(
                f"Node ID {node_id} is used by hornbill itself. Choose another.", node_id=node_id, cause="own_node_id"
            )
        resident = self._directory.unique_id_at(node_id)
        foreign = resident is None or resident.hex() != uid
        if foreign and self._directory.is_online(node_id, self._base.now()):
            raise InvalidValue(
                f"Node ID {node_id} is used by another node. Choose another, or switch that node off first.",
                node_id=node_id,
                owner=None if resident is None else resident.hex(),
                cause="node_id_in_use",
            )
        await self._store.run(self._store.allocations.pin, uid, NodeId(node_id))
        now_on = self.online().get(uid)
        if now_on == node_id:
            return Note(f"It already uses node ID {node_id} and keeps it.", "pin_unchanged", {"node_id": node_id})
        here = "" if now_on is None else f" Until then it uses {now_on}."
        text = f"It will get node ID {node_id} at its next start.{here}"
        return Note(text, "pin_at_restart", known(node_id=node_id, now_on=now_on))

    async def forget(self, uid: Uid, busy: str | None) -> Note:
        """Free a node's ID. Returns when it takes effect.

        `busy`: text about a running operation of the node. Raises Unknown (unknown_uid) and Busy.
        """
        node_id = self._store.allocations.get(uid).node_id
        if busy is not None:
            raise Busy(
                f"{busy} Its node ID cannot be freed until that has ended.",
                node_id=node_id,
                cause="allocation_busy",
            )
        await self._store.run(self._store.allocations.drop, uid)
        now_on = self.online().get(uid)
        if now_on is None:
            text = f"Node ID {node_id} is free. If the node requests an ID again, it is treated as new."
            return Note(text, "id_freed", {"node_id": node_id})
        text = f"The node is online and keeps node ID {now_on} until it restarts. It then gets an ID as a new node."
        return Note(text, "id_changes_at_restart", {"node_id": now_on})

    async def recycle(self, idle_longer_than_s: float, spared: Collection[Uid]) -> list[Uid]:
        """Free the IDs of unpinned nodes not seen for this time, except those `spared`. Returns the nodes.

        A node that requests an ID again is treated as new.
        """
        freed = [uid for uid in self._store.allocations.idle(idle_longer_than_s) if uid not in spared]
        for uid in freed:
            await self._store.run(self._store.allocations.drop, uid)
        if freed:
            count = "1 node ID" if len(freed) == 1 else f"{len(freed)} node IDs"
            text = f"{count} freed: not seen for {idle_longer_than_s:g} s."
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
        text = f"Node ID {node_id} allocated to {uid[:8]}…"
        self._hub.publish(LogEvent("info", "allocated", text, params={"node_id": node_id, "uid": uid}))

    def _on_refused(self, pending: AllocationRequest) -> None:
        refusal = pending.refused
        assert refusal is not None
        text = f"No node ID allocated to {pending.partial}: {refusal.text}"
        params: dict[str, object] = {**refusal.params, "refusal": refusal.code, "uid": pending.partial}
        self._hub.publish(LogEvent("failure", "no_node_id", text, Uid(pending.partial), params))

    def _on_recycled(self, uid: Uid, node_id: NodeId) -> None:
        text = f"Node ID {node_id} of {uid}, not seen for a month, was reassigned to a new node: no other ID was free."
        self._hub.publish(LogEvent("warning", "node_id_recycled", text, uid, {"node_id": node_id, "uid": uid}))

    def _on_competitor_found(self, competitor: CompetingAllocator) -> None:
        what = {
            AllocatorStatus.ON: "hornbill continues to allocate, because it is forced.",
            AllocatorStatus.OFF: "hornbill's allocator is off.",
            AllocatorStatus.STANDBY: "hornbill's allocator is on standby.",
        }[self.allocator.state]
        text = f"Node {competitor.node_id} also allocates node IDs. {what}"
        params: dict[str, object] = {"node_id": competitor.node_id, "allocator": self.allocator.state.value}
        self._hub.publish(LogEvent("warning", "second_allocator", text, params=params))
        self._hub.publish(BusChanged())

    def _on_competitor_gone(self, competitor: CompetingAllocator) -> None:
        what = "hornbill allocates them again." if self.allocator.state is AllocatorStatus.ON else ""
        text = f"Node {competitor.node_id} no longer allocates node IDs. {what}".rstrip()
        params: dict[str, object] = {"node_id": competitor.node_id, "allocator": self.allocator.state.value}
        self._hub.publish(LogEvent("notice", "second_allocator_gone", text, params=params))
        self._hub.publish(BusChanged())

    def _on_shared(self, now: Instant) -> None:
        """Stop allocating while another program uses our node ID."""
        allocator, shared = self.allocator, self._shared
        if shared is None or allocator.own_id_shared or not shared.is_program:
            return
        allocator.own_id_shared = True
        program = MAKERS_PROGRAM if shared.is_makers_program else "Another program"
        gives = {
            AllocatorStatus.ON: "hornbill continues to allocate node IDs, because it is forced.",
            AllocatorStatus.OFF: "hornbill does not allocate node IDs: its allocator is off.",
            AllocatorStatus.STANDBY: f"hornbill allocates no node IDs until {SHARED_FOR_S:g} s after its last frame.",
        }[allocator.state]
        text = f"{program} uses hornbill's node ID {self.own_id}. {gives} Close one of the two programs."
        params: dict[str, object] = {
            "node_id": self.own_id, "makers_program": shared.is_makers_program, "allocator": allocator.state.value,
            "shared_s": SHARED_FOR_S,
        }  # fmt: skip
        self._hub.publish(LogEvent("warning", "own_node_id", text, params=params))
        self._hub.publish(BusChanged())

    def _end_sharing(self, shared: SharedNodeId) -> None:
        self.allocator.own_id_shared = False
        gives = " hornbill allocates node IDs again." if self.allocator.state is AllocatorStatus.ON else ""
        text = f"No other program has used hornbill's node ID {shared.node_id} for {SHARED_FOR_S:g} s.{gives}"
        params: dict[str, object] = {"node_id": shared.node_id, "allocator": self.allocator.state.value}
        self._hub.publish(LogEvent("notice", "own_node_id_alone", text, params=params))
        self._hub.publish(BusChanged())

    def _store_seen(self) -> None:
        self._seen_at = self._base.now()
        try:
            self._store.allocations.seen(list(self.online()))
        except Exception:  # a full disk must not stop the tick that expires leases
            log.exception("the allocation table could not be updated")


class _Table:
    """Allocation table for the allocator, with notice of when an entry is durable."""

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
    stored = store.settings.get(_SETTING)
    return AllocationMode(stored) if stored in list(AllocationMode) else AllocationMode.ON
