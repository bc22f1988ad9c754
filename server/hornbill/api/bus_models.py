"""JSON shapes of the bus: adapter, allocator, nodes, findings, frames, logs, the server's health."""

from typing import Annotated, Any, Literal

from pydantic import Field

from hornbill.domain.fields import Model, UidField, Utc

LogFormat = Literal["candump", "asc", "blf", "csv"]


class AllocatorState(Model):
    """What the node-id allocator is doing."""

    state: Literal["on", "off", "standing_down"] = Field(description="standing_down: another allocator responds.")
    mode: Literal["on", "off", "insist"] = Field(
        description="Selected mode. insist: responds beside another allocator, too."
    )
    granted: int = Field(description="Number of node IDs in the table.")
    pending: int = Field(description="Number of nodes that request a node ID now.")
    free: int = Field(description="Number of free node IDs.")
    rival_node_id: int | None = Field(description="Node ID of a competing allocator on this bus. Null if none.")
    own_id_shared: bool = Field(
        description="another program uses hornbill's node id: unless told to insist, hornbill gives no node ids until "
        "a minute after its last frame"
    )


class AllocatorMode(Model):
    """What the allocator shall do."""

    mode: Literal["on", "off", "insist"] = Field(
        description="on: allocate node IDs; off: do not; insist: also beside another allocator."
    )


class SerialLine(Model):
    """The serial line between this computer and a serial adapter."""

    baud: int = Field(description="Baud rate, bit/s.")
    budget: int | None = Field(
        description="Full frames per second that the line carries. Null for USB adapters without a serial line."
    )
    load_pct: float | None = Field(description="Share of the line used for receiving, %. Null without a budget.")
    found: bool = Field(description="hornbill detected the baud rate. false if the address gives it.")
    confirmed: bool = Field(description="Well-formed data was received at this baud rate.")
    serial_number: str | None = Field(description="USB serial number of the adapter")
    latency_ms: int | None = Field(
        description="Latency timer of an FTDI chip, ms. Null if the system does not report it."
    )


class AdapterNote(Model):
    """Something unusual about an adapter that is used all the same."""

    code: Literal[
        "adapter_silent", "bit_rate_fixed", "baud_unknown", "adapter_echoes", "line_noise", "latency_timer"
    ] = Field(description="Code for programs. Stable.")  # fmt: skip
    text: str = Field(description="One sentence for users.")
    params: dict[str, str | int | float] = Field(description="Values in the text, by name.")


class Bus(Model):
    """The bus as the adapter and the counters show it."""

    state: Literal["disconnected", "connecting", "active", "passive", "bus_off", "lost"] = Field(
        description="State of the adapter."
    )
    address: str | None = Field(description="INTERFACE:CHANNEL, as `PUT /bus` takes it.")
    bitrate: int | None = Field(description="Bit rate, bit/s. Null if unknown.")
    sample_point: float | None = Field(description="0..1, null where the adapter does not tell")
    trouble: str | None = Field(description="Problem of the adapter and its remedy. Null while it works.")
    trouble_code: Literal["nothing_received", "error_passive", "bus_off", "adapter_lost", "recording_over"] | None = (
        Field(description="Kind of problem, for programs. Null while it works.")
    )
    notes: list[AdapterNote] = Field(description="Unusual properties of the adapter.")
    serial_line: SerialLine | None = Field(description="Serial line. Null unless the adapter is a serial one.")
    limited_by: Literal["can", "serial_line"] | None = Field(
        description="The slower of CAN bus and serial line, whose budget limits polling. Null without a bus."
    )
    frame_gap_ms: float = Field(description="Pause between frames of one transfer, ms.")
    retry_in_s: float | None = Field(
        description="Time until the adapter is reopened automatically, s. Null while it works."
    )
    reopened: int = Field(description="Number of automatic reconnects.")
    load_pct: float | None = Field(description="Bus load, %. Null without a bus.")
    load_cap_pct: float = Field(
        description="Load limit of polling, %: the bus budget, or less on a slower serial line."
    )
    rx_fps: float = Field(description="Frames received per second.")
    tx_fps: float = Field(description="Frames sent per second.")
    rx_frames: int = Field(description="Frames received.")
    tx_frames: int = Field(description="Frames sent.")
    rx_dropped: int = Field(description="RX overruns: received frames that were dropped.")
    errors: int = Field(description="Error frames, and own frames that could not be sent.")
    error_frames: int = Field(description="Error frames seen on the bus from any node.")
    unacknowledged: int = Field(description="Transmitted frames that no node acknowledged.")
    ignored: int = Field(description="Standard, remote and CAN FD frames, which are not DroneCAN on classic CAN.")
    bus_offs: int = Field(description="Number of times the adapter went bus-off.")
    allocator: AllocatorState | None = Field(description="State of the node ID allocator. Null without a bus.")


class BusAddress(Model):
    """Which adapter to open, in python-can's words."""

    address: str = Field(
        examples=["socketcan:can0", "slcan:/dev/ttyACM0", "file:recording.log", "bundle:NAME.zip"],
        description="INTERFACE:CHANNEL, such as `socketcan:can0`. `GET /bus/adapters` lists connected adapters.",
    )
    bitrate: int = Field(
        default=1_000_000, gt=0, le=1_000_000, description="Bit rate, bit/s. Servos are delivered with 1000000."
    )
    frame_gap_ms: float | None = Field(
        default=None, ge=0, le=20, allow_inf_nan=False,
        description="Pause between frames of one transfer, ms. Default 0, or the address's " "?frame_gap_ms=3.",
    )  # fmt: skip


class Adapter(Model):
    """Something a bus can be opened on. `address` is what `PUT /bus` takes."""

    address: str = Field(description="INTERFACE:CHANNEL, as `PUT /bus` takes it.")
    interface: str = Field(description="python-can interface, such as `socketcan`.")
    channel: str = Field(description="Channel of that interface, such as `can0`.")
    name: str = Field(description="Display name: product, serial number.")
    state: Literal["ready", "connected", "down", "wrong_bitrate", "no_permission", "in_use", "no_driver"] = Field(
        description="Availability."
    )
    usable: bool = Field(description="It can be connected now.")
    reason: str | None = Field(description="Reason why it is unusable, or a peculiarity. Null if none.")
    remedy: str | None = Field(description="What to do about it, if possible as a command. Null if nothing.")
    bitrate: int | None = Field(description="Bit rate, bit/s. Null if unknown.")
    sample_point: float | None = Field(description="Sample point, 0 to 1. Null if unknown.")
    serial_number: str | None = Field(description="USB serial number")
    baud: int | None = Field(description="Baud rate of the last use of a serial adapter, bit/s. Null if unknown.")


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
    health: Literal["ok", "warning", "error", "critical"] = Field(description="Health from NodeStatus.")
    mode: str = Field(description="Mode from NodeStatus.")
    uptime_s: int = Field(description="Time since its start, s.")
    age_s: float = Field(description="Time since it was last received, s.")
    restarts: int = Field(description="Number of observed restarts.")
    software_version: str | None = Field(description="Software version from GetNodeInfo. Null if unknown.")
    hardware_version: str | None = Field(description="Hardware version from GetNodeInfo.")
    note: str | None = Field(description="Reason why it is not a servo, or a peculiarity. Null if none.")


class Allocation(Model):
    """One row of the allocation table."""

    uid: UidField
    node_id: int = Field(description="Node ID, 1 to 127.")
    pinned: bool = Field(description="Assigned manually and reserved for this node.")
    last_seen: float | None = Field(description="Last contact, seconds since 1970 UTC. Null if unknown.")
    online: bool = Field(description="Received recently.")


class PendingAllocation(Model):
    """A node heard asking for an id, and how far it has come."""

    uid_part: str = Field(description="Known part of the unique ID, hex.")
    stage: int = Field(ge=0, le=3, description="Number of parts received, 0 to 3.")
    attempts: int = Field(description="Number of allocation attempts started.")
    waiting_s: float = Field(description="Time since the first request, s.")
    age_s: float = Field(description="Time since it was last received, s.")
    refusal: str | None = Field(description="Reason why it gets no node ID. Null if it will get one.")


class Allocations(Model):
    """The allocation table and who is waiting."""

    allocations: list[Allocation] = Field(description="Rows of the allocation table, one per node.")
    pending: list[PendingAllocation] = Field(description="Nodes that request a node ID now.")
    free: int = Field(description="Number of free node IDs.")


class AllocationChange(Allocation):
    """A row as it is now, or as it was before it was forgotten."""

    note: str = Field(description="Time at which the change takes effect, one sentence.")


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


class LogRequest(Model):
    """What to log, and when to stop by itself."""

    format: LogFormat = Field(default="candump", description="File format.")
    name: str | None = Field(default=None, description="File name without extension. Default: the start time.")
    limit_mb: Annotated[float, Field(gt=0, le=10_000)] = Field(
        default=100.0, description="Size at which logging ends, MB."
    )


class LogState(Model):
    """The log of frames being written, or the last one that was."""

    state: Literal["idle", "running", "stopped", "full", "failed"] = Field(description="State of the log.")
    name: str | None = Field(description="File name. Null if there is no log.")
    format: LogFormat | None = Field(description="File format. Null if there is no log.")
    started_at: float | None = Field(description="Start, seconds since 1970 UTC. Null if there is no log.")
    frames: int = Field(description="Number of CAN frames.")
    dropped: int = Field(description="Frames that could not be written in time.")
    bytes: int = Field(description="Size, bytes.")
    limit_bytes: int = Field(description="Size at which logging ends, bytes.")
    reason: str | None = Field(description="Reason why it ended. Null if stopped manually.")


class LogFile(Model):
    """A log in the data folder."""

    name: str = Field(description="File name.")
    bytes: int = Field(description="Size, bytes.")
    modified_at: Utc


class DecodedTransfer(Model):
    """One transfer, in the form of `hornbill decode`, and a sentence on it for people."""

    timestamp: float = Field(description="Time, seconds since 1970 UTC.")
    type: str | None = Field(description="Full DSDL name. Null if the type is unknown.")
    kind: Literal["message", "request", "response"] = Field(description="Broadcast message, request or response.")
    data_type_id: int = Field(description="DSDL data type ID.")
    source: int = Field(description="Source node ID.")
    destination: int | None = Field(description="Destination node ID of a request or response. Null for broadcasts.")
    priority: int = Field(description="Transfer priority, 0 (highest) to 31.")
    transfer_id: int = Field(description="Transfer ID, 0 to 31, per source and type.")
    fields: dict[str, Any] | None = Field(
        description="Values by DSDL field. Null if the type is unknown or the payload does not match it."
    )
    payload: str = Field(description="Payload bytes, hex.")
    summary: str = Field(description="One sentence for users.")
    sent: bool = Field(description="Sent by this server.")
    can_id: str = Field(description="8 hex digits")
    frames: int = Field(description="Number of CAN frames.")


class RawFrame(Model):
    """One frame as it was on the bus; `problem` says why nothing could be made of it."""

    timestamp: Utc
    sent: bool = Field(description="Sent by this server.")
    can_id: str = Field(description="CAN identifier, 8 hex digits.")
    data: str = Field(description="Data bytes, hex.")
    problem: str | None = Field(description="Reason why the frame belongs to no transfer. Null if it does.")


class Health(Model):
    """The server serves."""

    status: Literal["ok"] = Field(description="State of the server.")
    version: str = Field(description="Version of hornbill.")
    uptime_s: float = Field(description="Time since its start, s.")
    bus: str = Field(description="State of the bus.")
    demo: bool = Field(description="Simulated servos on an embedded bus.")
