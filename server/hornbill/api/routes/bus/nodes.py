"""Routes of nodes and node ids: who is on the bus, the allocation table, and the allocator's mode."""

from typing import Final, Literal

from pydantic import Field

from hornbill.api import present
from hornbill.api.dependencies import LeaseHeader, TheHost, UidPath
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.bus import AllocatorChoice, AllocatorState, HealthCode, PendingAllocation
from hornbill.domain.fields import Model, Params, UidField
from hornbill.domain.note import Note, NoteCode
from hornbill.node.allocator import AllocationMode
from hornbill.node.directory import OFFLINE_AFTER_S
from hornbill.servo.device.servo import State, mode_name
from hornbill.servo.host import Connection, Host
from hornbill.store.allocations import AllocationEntry
from hornbill.store.audit import NewAuditEntry
from hornbill.units import Instant, Uid
from hornbill.wire.messages import NodeHealth, NodeStatus
from hornbill.wire.services import GetNodeInfoResponse, SoftwareVersion

routes = Routes("bus")


class AllocatorMode(Model):
    """What the allocator shall do."""

    mode: AllocatorChoice = Field(
        description="on: allocate node IDs; off: do not; force: also beside another allocator."
    )


class Node(Model):
    """Whoever is heard on this bus, servo or not, and this server itself (table 2-17).

    One that never said NodeStatus has mode `unknown`, health `warning` and uptime 0. Nodes that ask for a node id
    stand as one, with node id 0.
    """

    node_id: int = Field(description="Node ID, 1 to 127. 0 for nodes without one.")
    kind: Literal["servo", "hornbill", "foreign", "unknown"] = Field(
        description="Kind of node. unknown: not identified yet, or no response."
    )
    online: bool = Field(description="Received recently.")
    name: str | None = Field(description="Name from GetNodeInfo. Null if unknown.")
    uid: str | None = Field(description="Unique ID of the servo, 32 hex digits. Null if it concerns none.")
    health: HealthCode = Field(description="Health from NodeStatus.")
    mode: str = Field(description="Mode from NodeStatus.")
    uptime_s: int = Field(description="Time since its start, s.")
    age_s: float = Field(description="Time since it was last received, s.")
    restarts: int = Field(description="Number of observed restarts.")
    software_version: str | None = Field(description="Software version from GetNodeInfo. Null if unknown.")
    hardware_version: str | None = Field(description="Hardware version from GetNodeInfo.")
    note: str | None = Field(description="Reason why it is not a servo, or a peculiarity. Null if none.")
    note_code: NoteCode | None = Field(description="Code of the note. Null if none.")
    note_params: Params


class Allocation(Model):
    """One row of the allocation table."""

    uid: UidField
    node_id: int = Field(description="Node ID, 1 to 127.")
    pinned: bool = Field(description="Assigned manually and reserved for this node.")
    last_seen: float | None = Field(description="Last contact, seconds since 1970 UTC. Null if unknown.")
    online: bool = Field(description="Received recently.")


class Allocations(Model):
    """The allocation table and who is waiting."""

    allocations: list[Allocation] = Field(description="Rows of the allocation table, one per node.")
    pending: list[PendingAllocation] = Field(description="Nodes that request a node ID now.")
    free: int = Field(description="Number of free node IDs.")


class AllocationChange(Allocation):
    """A row as it is now, or as it was before it was forgotten."""

    note: str = Field(description="Time at which the change takes effect, one sentence.")
    note_code: NoteCode = Field(description="Code of the note.")
    note_params: Params


class Recycle(Model):
    """Which ids to free: those of nodes not seen for longer than this. When a node was seen is kept once a minute."""

    idle_longer_than_s: float = Field(
        ge=60, allow_inf_nan=False, description="Minimum time since the node was last seen, s."
    )


class Recycled(Model):
    """Rows that were freed, as they were."""

    freed: list[Allocation] = Field(description="Removed rows, as they were.")
    free: int = Field(description="Number of free node IDs.")


class Pin(Model):
    """The node id a node shall have."""

    node_id: int = Field(description="Node ID, 1 to 127.")


Kind = Literal["servo", "hornbill", "foreign", "unknown"]

_HAS_COMMIT: Final = 1
"""OPTIONAL_FIELD_FLAG_VCS_COMMIT of uavcan.protocol.SoftwareVersion."""

_BUSY: Final = {State.SAVING: "is saving", State.RESTARTING: "is restarting"}


@routes.get("/nodes", Role.VIEW)
async def list_nodes(host: TheHost) -> list[Node]:
    """Every node heard since the bus was connected, by node id. Empty without a bus."""
    connection = host.connection
    if connection is None:
        return []
    now, directory = host.base.now(), connection.directory
    found = [_node(host, connection, node_id, now) for node_id in directory.seen()]
    if directory.anonymous_seen is not None:
        found.append(_anonymous(host, directory.anonymous_seen, now))
    return sorted([*found, _ourselves(connection, now)], key=lambda one: one.node_id)


@routes.get("/allocations", Role.VIEW)
async def list_allocations(host: TheHost) -> Allocations:
    """The allocation table, and which nodes wait for an id."""
    return Allocations(
        allocations=[_allocation(host, entry) for entry in host.store.allocations.rows()],
        pending=present.pending(host),
        free=host.allocating.allocator.free(host.base.now()),
    )


@routes.put("/allocations/{uid}", Role.CONFIGURE, "out_of_range", "invalid_value")
async def pin_allocation(host: TheHost, uid: UidPath, body: Pin, lease: LeaseHeader = None) -> AllocationChange:
    """Choose the id, 1 to 125, a node is given when it asks the next time, met before or not. No other may have it."""
    before = host.store.allocations.entries().get(Uid(uid))
    note = await host.allocating.pin(Uid(uid), body.node_id)
    if (fixed := _fixed_id(host, uid)) is not None:
        text = f"It has the fixed node id {fixed} (0x46) and asks for none. The pin counts once 0x46 is 0."
        note = Note(text, "pin_after_fixed", {"node_id": fixed})
    _note(host, lease, "pin", uid, before, body.node_id, note)
    return _change(host, host.store.allocations.get(Uid(uid)), note)


@routes.delete("/allocations/{uid}", Role.CONFIGURE, "unknown_uid", "busy", "invalid_value")
async def forget_allocation(host: TheHost, uid: UidPath, lease: LeaseHeader = None) -> AllocationChange:
    """Free a node's id, and take its pin away. A node that is online keeps its id until it starts anew."""
    entry = host.store.allocations.get(Uid(uid))
    note = await host.allocating.forget(Uid(uid), _why_busy(host, uid))
    _note(host, lease, "forget", uid, entry.node_id, None, note)
    return _change(host, entry, note)


@routes.post("/allocations/recycle", Role.CONFIGURE, "invalid_value")
async def recycle_allocations(host: TheHost, body: Recycle, lease: LeaseHeader = None) -> Recycled:
    """Free the ids of nodes not seen for so long. Pinned ones, and those of nodes online or restarting, stay."""
    rows = {entry.uid: _allocation(host, entry) for entry in host.store.allocations.rows()}
    spared = {uid for uid, row in rows.items() if row.online or _why_busy(host, uid) is not None}
    freed = await host.allocating.recycle(body.idle_longer_than_s, spared)
    note = Note(f"Not seen for {body.idle_longer_than_s:g} s.", "not_seen_for", {"idle_s": body.idle_longer_than_s})
    for uid in freed:
        _note(host, lease, "forget", uid, rows[uid].node_id, None, note)
    free = host.allocating.allocator.free(host.base.now())
    return Recycled(freed=[rows[uid] for uid in freed], free=free)


@routes.put("/bus/allocator", Role.CONFIGURE, "invalid_value")
async def set_allocator(host: TheHost, body: AllocatorMode, lease: LeaseHeader = None) -> AllocatorState:
    """Give node ids unless somebody else does (on), never (off), or whoever else does (force). It is kept.

    A mode given on the command line or in the environment counts again at the next start.
    """
    before = host.allocating.allocator.mode
    await host.allocating.choose(AllocationMode(body.mode))
    _note(host, lease, "allocator", None, before.value, body.mode)
    return present.allocator(host)


def _note(
    host: Host, lease: str | None, action: str, uid: str | None, before: int | str | None, after: int | str | None,
    *notes: Note,
) -> None:  # fmt: skip
    """Keep in the audit what was decided about node ids."""
    by, key = host.leases.who(lease, host.base.now()), "mode" if uid is None else "node_id"
    host.audit.note(
        NewAuditEntry(by, action, "applied", None if uid is None else Uid(uid), key, before, after, after, notes)
    )


def _allocation(host: Host, entry: AllocationEntry) -> Allocation:
    online = entry.uid in host.allocating.online() or _servo_online(host, entry.uid)
    return Allocation(
        uid=entry.uid,
        node_id=entry.node_id,
        pinned=entry.pinned,
        last_seen=host.base.utc_now() if online else entry.last_seen,
        online=online,
    )


def _change(host: Host, entry: AllocationEntry, note: Note) -> AllocationChange:
    row = _allocation(host, entry).model_dump()
    return AllocationChange(**row, note=note.text, note_code=note.code, note_params=note.params)


def _servo_online(host: Host, uid: str) -> bool:
    return host.fleet.knows(uid) and host.fleet.get(uid).online


def _why_busy(host: Host, uid: str) -> str | None:
    servo = host.fleet.get(uid) if host.fleet.knows(uid) else None
    why = None if servo is None or servo.busy is None else _BUSY.get(servo.busy)
    return None if servo is None or why is None else f"{servo.title} {why}."


def _fixed_id(host: Host, uid: str) -> int | None:
    """What 0x46 of a servo holds, when it is not 0: then it never asks for an id (section 4.38)."""
    return (host.fleet.get(uid).raw("node_id") if host.fleet.knows(uid) else None) or None


def _node(host: Host, connection: Connection, node_id: int, now: Instant) -> Node:
    directory = connection.directory
    record = directory.records.get(node_id)
    heard = directory.last_seen(node_id) or 0.0
    if record is None:
        text = "It sends, but never said NodeStatus, which every node must once a second."
        return _silent(node_id, "unknown", "warning", heard, now, Note(text, "no_status"))
    kind: Kind = host.fleet.kind(node_id)
    note = host.fleet.note(node_id)
    if kind != "servo" and record.info is not None and record.info.name == connection.participant.info().name:
        kind, note = "hornbill", Note("Another hornbill.", "another_hornbill")
    return _speaking(node_id, kind, record.status, record.info, heard, now, record.restarts, note)


def _ourselves(connection: Connection, now: Instant) -> Node:
    info = connection.participant.info()
    note = Note("This server.", "this_server")
    return _speaking(connection.participant.node_id, "hornbill", info.status, info, now, now, 0, note)


def _anonymous(host: Host, heard: Instant, now: Instant) -> Node:
    waiting = len(host.allocating.allocator.pending(now))
    count = "1 node asks" if waiting == 1 else f"{waiting or 'No'} nodes ask"
    note = Note(f"{count} for a node id now: see the allocations.", "asking_for_id", {"count": waiting})
    return _silent(0, "initialization", "ok", heard, now, note)


def _speaking(
    node_id: int,
    kind: Kind,
    status: NodeStatus,
    info: GetNodeInfoResponse | None,
    heard: Instant,
    now: Instant,
    restarts: int,
    note: Note | None,
) -> Node:
    return Node(
        node_id=node_id,
        kind=kind,
        online=now - heard < OFFLINE_AFTER_S,
        name=None if info is None else info.name,
        uid=None if info is None else info.hardware_version.unique_id.hex(),
        health=NodeHealth(status.health).name.lower(),  # pyright: ignore[reportArgumentType] - there are four
        mode=mode_name(status.mode),
        uptime_s=status.uptime_sec,
        age_s=round(now - heard, 3),
        restarts=restarts,
        software_version=None if info is None else _software(info.software_version),
        hardware_version=None if info is None else f"{info.hardware_version.major}.{info.hardware_version.minor}",
        note=None if note is None else note.text,
        note_code=None if note is None else note.code,
        note_params={} if note is None else note.params,
    )


def _silent(node_id: int, mode: str, health: HealthCode, heard: Instant, now: Instant, note: Note) -> Node:
    """A node that has not said NodeStatus."""
    return Node(
        node_id=node_id, kind="unknown", online=now - heard < OFFLINE_AFTER_S, name=None, uid=None, health=health,
        mode=mode, uptime_s=0, age_s=round(now - heard, 3), restarts=0, software_version=None, hardware_version=None,
        note=note.text, note_code=note.code, note_params=note.params,
    )  # fmt: skip


def _software(version: SoftwareVersion) -> str:
    """The commit only where the node says that it means something (errata A9)."""
    commit = f"+{version.vcs_commit:08x}" if version.optional_field_flags & _HAS_COMMIT else ""
    return f"{version.major}.{version.minor}{commit}"
