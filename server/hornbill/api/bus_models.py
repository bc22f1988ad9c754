"""Owns the JSON shapes of the bus: adapter, allocator, nodes, findings, frames, logs, the server's health."""

from typing import Annotated, Any, Literal

from pydantic import Field

from hornbill.api.models import Model, UidField

LogFormat = Literal["candump", "asc", "blf", "csv"]


class AllocatorState(Model):
    """What the node-id allocator is doing."""

    state: Literal["on", "off", "standing_down"]
    mode: Literal["on", "off", "insist"] = Field(description="what was chosen; insist answers beside another allocator")
    granted: int
    pending: int
    free: int = Field(description="node ids that can still be given")
    rival_node_id: int | None = Field(description="another allocator that answers on this bus")


class AllocatorMode(Model):
    """What the allocator shall do."""

    mode: Literal["on", "off", "insist"]


class Bus(Model):
    """The bus as the adapter and the counters show it."""

    state: Literal["disconnected", "connecting", "active", "passive", "bus_off", "lost"]
    address: str | None
    bitrate: int | None
    sample_point: float | None = Field(description="0..1, null where the adapter does not tell")
    trouble: str | None = Field(description="what is wrong with the adapter and what helps; null while it works")
    retry_in_s: float | None = Field(description="when it is opened again by itself; null while it works")
    reopened: int = Field(description="how often it was opened again by itself")
    load_pct: float | None
    load_cap_pct: float = Field(description="load that polling keeps within, the budget of the bus")
    rx_fps: float
    tx_fps: float
    rx_frames: int
    tx_frames: int
    rx_dropped: int = Field(description="frames the adapter brought that we could not take")
    errors: int
    error_frames: int = Field(description="errors seen on the wire, whoever sent")
    unacknowledged: int = Field(description="our transmissions nobody acknowledged")
    ignored: int = Field(description="standard, remote and CAN FD frames: not DroneCAN on classic CAN")
    bus_offs: int
    allocator: AllocatorState | None


class BusAddress(Model):
    """Which adapter to open, in python-can's words."""

    address: str = Field(examples=["socketcan:can0", "slcan:/dev/ttyACM0", "file:recording.log", "bundle:NAME.zip"])
    bitrate: int = Field(
        default=1_000_000, gt=0, le=1_000_000, description="bit/s; the servos are delivered with 1000000"
    )


class Adapter(Model):
    """Something a bus can be opened on. `address` is what `PUT /bus` takes."""

    address: str
    interface: str
    channel: str
    name: str = Field(description="for people: product, serial number")
    state: Literal["ready", "connected", "down", "wrong_bitrate", "no_permission", "in_use", "no_driver"]
    usable: bool
    reason: str | None = Field(description="why it cannot be used now, or what is odd about it; null when all is well")
    remedy: str | None = Field(description="what to do about it; a command where one helps")
    bitrate: int | None
    sample_point: float | None


class Finding(Model):
    """One thing the doctor looked at. `ok` only with `all=true`."""

    code: str
    severity: Literal["ok", "notice", "warning", "failure"]
    text: str
    evidence: str
    remedy: str | None
    node_ids: list[int] = Field(default_factory=list[int])
    uids: list[str] = Field(default_factory=list[str])


class Node(Model):
    """Whoever is heard on this bus, servo or not, and this server itself (table 2-17).

    One that never said NodeStatus has mode `unknown`, health `warning` and uptime 0. Nodes that ask for a node id
    stand as one, with node id 0.
    """

    node_id: int
    kind: Literal["servo", "hornbill", "foreign", "unknown"] = Field(
        description="unknown: not asked yet, or it does not answer"
    )
    online: bool
    name: str | None = Field(description="from GetNodeInfo")
    uid: str | None
    health: Literal["ok", "warning", "error", "critical"]
    mode: str
    uptime_s: int
    age_s: float
    restarts: int
    software_version: str | None
    hardware_version: str | None
    note: str | None = Field(description="why it is not taken for a servo, or what is odd about it")


class Allocation(Model):
    """One row of the allocation table."""

    uid: UidField
    node_id: int
    pinned: bool
    last_seen: float | None
    online: bool


class PendingAllocation(Model):
    """A node heard asking for an id, and how far it has come."""

    uid_part: str = Field(description="what is known of the unique id, in hex")
    stage: int = Field(ge=0, le=3, description="how many of the three parts were heard")
    attempts: int
    waiting_s: float
    age_s: float
    refusal: str | None


class Allocations(Model):
    """The allocation table and who is waiting."""

    allocations: list[Allocation]
    pending: list[PendingAllocation]
    free: int = Field(description="ids that could be given to new nodes now")


class AllocationChange(Allocation):
    """A row as it is now, or as it was before it was forgotten."""

    note: str = Field(description="when the change takes effect")


class Recycle(Model):
    """Which ids to free: those of nodes not seen for longer than this. When a node was seen is kept once a minute."""

    idle_longer_than_s: float = Field(ge=60, allow_inf_nan=False)


class Recycled(Model):
    """Rows that were freed, as they were."""

    freed: list[Allocation]
    free: int = Field(description="ids that could be given to new nodes now")


class Pin(Model):
    """The node id a node shall have."""

    node_id: int


class LogRequest(Model):
    """What to log, and when to stop by itself."""

    format: LogFormat = "candump"
    name: str | None = Field(default=None, description="file name without ending; the time of the start unless told")
    limit_mb: Annotated[float, Field(gt=0, le=10_000)] = 100.0


class LogState(Model):
    """The log of frames being written, or the last one that was."""

    state: Literal["idle", "running", "stopped", "full", "failed"]
    name: str | None
    format: LogFormat | None
    started_at: float | None = Field(description="seconds since 1970 UTC")
    frames: int
    dropped: int
    bytes: int
    limit_bytes: int
    reason: str | None = Field(description="why it ended, unless it was stopped")


class LogFile(Model):
    """A log in the data folder."""

    name: str
    bytes: int
    modified_at: float


class DecodedTransfer(Model):
    """One transfer, in the form of `hornbill decode`, and a sentence on it for people."""

    timestamp: float = Field(description="seconds since 1970 UTC")
    type: str | None = Field(description="full DSDL name; null for a type that is not known")
    kind: Literal["message", "request", "response"]
    data_type_id: int
    source: int
    destination: int | None
    priority: int
    transfer_id: int
    fields: dict[str, Any] | None
    payload: str
    summary: str
    sent: bool
    can_id: str = Field(description="8 hex digits")
    frames: int


class RawFrame(Model):
    """One frame as it was on the bus; `problem` says why nothing could be made of it."""

    timestamp: float
    sent: bool
    can_id: str
    data: str
    problem: str | None


class Health(Model):
    """The server serves."""

    status: Literal["ok"]
    version: str
    uptime_s: float
    bus: str
    demo: bool
