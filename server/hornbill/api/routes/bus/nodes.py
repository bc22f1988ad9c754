"""Routes of nodes, the allocation table and the node ID allocator."""

import math
from typing import Final, Literal

from pydantic import Field

from hornbill.api import present
from hornbill.api.dependencies import LeaseHeader, TheHost, UidPath
from hornbill.api.paging import Every
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.bus import AllocatorChoice, AllocatorState, HealthCode, PendingAllocation
from hornbill.domain.fields import Model, Params, UidField
from hornbill.domain.note import Note, NoteCode
from hornbill.domain.servo import Commander
from hornbill.node.allocator import AllocationMode
from hornbill.node.directory import OFFLINE_AFTER_S
from hornbill.servo.device.position_estimate import DEGREES, LITERAL
from hornbill.servo.device.servo import State, mode_name
from hornbill.servo.host import Connection, Host
from hornbill.store.allocations import AllocationEntry
from hornbill.store.audit import NewAuditEntry
from hornbill.units import Instant, Uid
from hornbill.wire.messages import NodeHealth, NodeStatus
from hornbill.wire.services import GetNodeInfoResponse, SoftwareVersion

routes = Routes("bus")


class AllocatorMode(Model):
    """Mode of the node ID allocator."""

    mode: AllocatorChoice = Field(
        description="on: allocate node IDs; off: do not; force: also beside another allocator."
    )


class Node(Model):
    """A node on the bus, or this server itself (table 2-17).

    A node that never sent NodeStatus has mode `unknown`, health `warning` and uptime 0. All nodes that request a node
    ID are listed as one entry with node ID 0.
    """

    node_id: int = Field(description="Node ID, 1 to 127. 0 for nodes without one.")
    kind: Literal["servo", "hornbill", "foreign", "unknown"] = Field(
        description="Kind of node. unknown: not identified yet, or no response."
    )
    online: bool = Field(description="Received recently.")
    name: str | None = Field(description="Name from GetNodeInfo. Null if unknown.")
    uid: str | None = Field(description="Unique ID from GetNodeInfo, 32 hex digits. Null if unknown.")
    health: HealthCode = Field(description="Health from NodeStatus.")
    mode: str = Field(description="Mode from NodeStatus.")
    uptime_s: int = Field(description="Time since its start, s.")
    age_s: float = Field(description="Time since it was last received, s.")
    restarts: int = Field(description="Number of observed restarts.")
    software_version: str | None = Field(description="Software version from GetNodeInfo. Null if unknown.")
    hardware_version: str | None = Field(description="Hardware version from GetNodeInfo. Null if unknown.")
    actuator_id: int | None = Field(
        default=None, description="Servo ID in its Status. Null if it broadcasts no actuator's Status."
    )
    angle_deg: float | None = Field(
        default=None,
        description="Angle in its Status, °; in Futaba's unit if it is not identified. Null if it broadcasts none.",
    )
    commanded_by: list[Commander] = Field(
        default_factory=list[Commander], description="Other nodes that command its servo ID now."
    )
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
    """Allocation table and pending requests."""

    allocations: list[Allocation] = Field(description="Rows of the allocation table, one per node.")
    pending: list[PendingAllocation] = Field(description="Nodes that request a node ID now.")
    free: int = Field(description="Number of free node IDs.")


class AllocationChange(Allocation):
    """The changed row, or the deleted row as it was."""

    note: str = Field(description="When the change takes effect, one sentence.")
    note_code: NoteCode = Field(description="Code of the note.")
    note_params: Params


class Recycle(Model):
    """Criterion for the node IDs to free. Last contacts are stored once per minute."""

    idle_longer_than_s: float = Field(
        ge=60, allow_inf_nan=False, description="Minimum time since the node was last seen, s."
    )


class Recycled(Model):
    """Result of recycling."""

    freed: list[Allocation] = Field(description="Removed rows, as they were.")
    free: int = Field(description="Number of free node IDs.")


class Pin(Model):
    """Node ID to reserve."""

    node_id: int = Field(description="Node ID, 1 to 127.")


Kind = Literal["servo", "hornbill", "foreign", "unknown"]

_HAS_COMMIT: Final = 1
"""OPTIONAL_FIELD_FLAG_VCS_COMMIT of uavcan.protocol.SoftwareVersion."""

_BUSY: Final = {State.SAVING: "is saving", State.RESTARTING: "is restarting"}


@routes.get("/nodes", Role.VIEW)
async def list_nodes(host: TheHost, page: Every) -> list[Node]:
    """List all nodes seen since the bus was connected, by node ID. Empty without a bus."""
    connection = host.connection
    if connection is None:
        return []
    now, directory = host.base.now(), connection.directory
    found = [_node(host, connection, node_id, now) for node_id in directory.seen()]
    if directory.anonymous_seen is not None:
        found.append(_anonymous(host, directory.anonymous_seen, now))
    found = sorted([*found, _ourselves(connection, now)], key=lambda one: one.node_id)
    return page.of(found, lambda one: one.node_id)


@routes.get("/allocations", Role.VIEW)
async def list_allocations(host: TheHost) -> Allocations:
    """Get the allocation table and the nodes waiting for a node ID."""
    return Allocations(
        allocations=[_allocation(host, entry) for entry in host.store.allocations.rows()],
        pending=present.pending(host),
        free=host.allocating.allocator.free(host.base.now()),
    )


@routes.put("/allocations/{uid}", Role.CONFIGURE, "unknown_servo", "out_of_range", "invalid_value")
async def pin_allocation(host: TheHost, uid: UidPath, body: Pin, lease: LeaseHeader = None) -> AllocationChange:
    """Reserve a node ID, 1 to 125, for a node, which receives it with its next request. The node may be unknown."""
    before = host.store.allocations.entries().get(Uid(uid))
    note = await host.allocating.pin(Uid(uid), body.node_id)
    if (fixed := _fixed_id(host, uid)) is not None:
        text = f"The node has the fixed node ID {fixed} (0x46) and requests none. The pin applies once 0x46 is 0."
        note = Note(text, "pin_after_fixed", {"node_id": fixed})
    _note(host, lease, "pin", uid, before, body.node_id, note)
    return _change(host, host.store.allocations.get(Uid(uid)), note)


@routes.delete("/allocations/{uid}", Role.CONFIGURE, "unknown_servo", "unknown_uid", "busy", "invalid_value")
async def forget_allocation(host: TheHost, uid: UidPath, lease: LeaseHeader = None) -> AllocationChange:
    """Free the node ID of a node and remove its pin. A node that is online keeps its ID until it restarts."""
    entry = host.store.allocations.get(Uid(uid))
    note = await host.allocating.forget(Uid(uid), _why_busy(host, uid))
    _note(host, lease, "forget", uid, entry.node_id, None, note)
    return _change(host, entry, note)


@routes.post("/allocations/recycle", Role.CONFIGURE, "invalid_value")
async def recycle_allocations(host: TheHost, body: Recycle, lease: LeaseHeader = None) -> Recycled:
    """Free the node IDs of nodes not seen for the given time, except pinned ones and nodes online or restarting."""
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
    """Set the allocator's mode: allocate unless another allocator responds (on), never (off), or always (force).

    The mode is stored. A mode given on the command line or in the environment overrides it at the next start.
    """
    before = host.allocating.allocator.mode
    await host.allocating.choose(AllocationMode(body.mode))
    _note(host, lease, "allocator", None, before.value, body.mode)
    return present.allocator(host)


def _note(
    host: Host, lease: str | None, action: str, uid: str | None, before: int | str | None, after: int | str | None,
    *notes: Note,
) -> None:  # fmt: skip
    """Record a decision about node IDs in the audit."""
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
    """Fixed node ID of a servo (0x46), or None: with a fixed ID it never requests one (section 4.38)."""
    return (host.fleet.get(uid).raw("node_id") if host.fleet.knows(uid) else None) or None


def _node(host: Host, connection: Connection, node_id: int, now: Instant) -> Node:
    directory = connection.directory
    record = directory.records.get(node_id)
    seen = directory.last_seen(node_id) or 0.0
    if record is None:
        text = "The node sends frames but no NodeStatus, which is required once per second."
        return _without_status(node_id, "unknown", "warning", seen, now, Note(text, "no_status"))
    kind: Kind = host.fleet.kind(node_id)
    note = host.fleet.note(node_id)
    if kind != "servo" and record.info is not None and record.info.name == connection.participant.info().name:
        kind, note = "hornbill", Note("Another hornbill.", "another_hornbill")
    if note is None and kind == "unknown" and host.requests.silent:
        note = Note(
            "Not identified: its identity has not been heard. An observer requests nothing.", "identity_not_received"
        )
    node = _with_status(node_id, kind, record.status, record.info, seen, now, record.restarts, note)
    return node.model_copy(update=_actuator(host, node_id))


def _actuator(host: Host, node_id: int) -> dict[str, object]:
    """Servo ID, angle and commanders of a node that broadcasts an actuator's Status, as fields of Node."""
    servo = host.fleet.online_on(node_id)
    if servo is not None:
        return {
            "actuator_id": servo.servo_id,
            "angle_deg": servo.angle_deg,
            "commanded_by": present.commanders(host, servo.uid, servo.angle_deg),
        }
    status = host.fleet.actuator(node_id)
    if status is None:
        return {}
    angle = round(status.position * DEGREES[LITERAL], 2) if math.isfinite(status.position) else None
    return {
        "actuator_id": status.actuator_id,
        "angle_deg": angle,
        "commanded_by": present.commanders(host, node_id, angle),
    }


def _ourselves(connection: Connection, now: Instant) -> Node:
    info = connection.participant.info()
    note = Note("This server.", "this_server")
    return _with_status(connection.participant.node_id, "hornbill", info.status, info, now, now, 0, note)


def _anonymous(host: Host, seen: Instant, now: Instant) -> Node:
    waiting = len(host.allocating.allocator.pending(now))
    count = "1 node requests" if waiting == 1 else f"{waiting or 'No'} nodes request"
    note = Note(f"{count} a node ID. See the allocations.", "requesting_id", {"count": waiting})
    return _without_status(0, "initialization", "ok", seen, now, note)


def _with_status(
    node_id: int,
    kind: Kind,
    status: NodeStatus,
    info: GetNodeInfoResponse | None,
    seen: Instant,
    now: Instant,
    restarts: int,
    note: Note | None,
) -> Node:
    return Node(
        node_id=node_id,
        kind=kind,
        online=now - seen < OFFLINE_AFTER_S,
        name=None if info is None else info.name,
        uid=None if info is None else info.hardware_version.unique_id.hex(),
        health=NodeHealth(status.health).name.lower(),  # pyright: ignore[reportArgumentType] - there are four
        mode=mode_name(status.mode),
        uptime_s=status.uptime_sec,
        age_s=round(now - seen, 3),
        restarts=restarts,
        software_version=None if info is None else _software(info.software_version),
        hardware_version=None if info is None else f"{info.hardware_version.major}.{info.hardware_version.minor}",
        note=None if note is None else note.text,
        note_code=None if note is None else note.code,
        note_params={} if note is None else note.params,
    )


def _without_status(node_id: int, mode: str, health: HealthCode, seen: Instant, now: Instant, note: Note) -> Node:
    """A node that has not sent NodeStatus."""
    return Node(
        node_id=node_id, kind="unknown", online=now - seen < OFFLINE_AFTER_S, name=None, uid=None, health=health,
        mode=mode, uptime_s=0, age_s=round(now - seen, 3), restarts=0, software_version=None, hardware_version=None,
        note=note.text, note_code=note.code, note_params=note.params,
    )  # fmt: skip


def _software(version: SoftwareVersion) -> str:
    """Version, with the commit only if the node flags it as valid (errata A9)."""
    commit = f"+{version.vcs_commit:08x}" if version.optional_field_flags & _HAS_COMMIT else ""
    return f"{version.major}.{version.minor}{commit}"
