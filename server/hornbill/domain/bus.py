"""The bus: state, adapters, findings of the doctor, allocation, transfers and frames."""

from typing import Any, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass
from typing_extensions import TypeAliasType

from hornbill.domain.fields import STRICT, Model, Param, Params, Utc

ConnectionRoleChoice = TypeAliasType("ConnectionRoleChoice", Literal["auto", "host", "guest", "observer"])
"""Connection role. auto: listen first, then guest beside an autopilot or another allocator, otherwise host."""

ConnectionRoleName = TypeAliasType("ConnectionRoleName", Literal["host", "guest", "observer"])

Severity = Literal["ok", "notice", "warning", "failure"]
"""ok: checked, without finding. notice: worth knowing, nothing to repair."""


Check = Literal[
    "adapter",
    "bus_off",
    "bit_rate",
    "no_traffic",
    "own_node_id",
    "duplicate_node_id",
    "duplicate_servo_id",
    "servos_without_id",
    "other_commands",
    "second_allocator",
    "allocation_stuck",
    "frames_dropped",
    "errors_rising",
    "load_over_budget",
    "serial_line_full",
    "silent_node",
    "responses_lost",
    "responses_slow",
    "servo_offline",
    "foreign_frames",
    "database",
    "disk_space",
    "computer_busy",
    "view",
]
"""Code of a check that may have no finding."""

FindingCode = TypeAliasType(
    "FindingCode",
    Literal[
        Check,
        "no_bus",
        "adapter_failed",
        "adapter_lost",
        "interface_down",
        "sample_point",
        "only_errors",
        "unacknowledged",
        "nothing_received",
        "makers_program",
        "allocator_off",
        "allocation_refused",
        "adapter_silent",
        "bit_rate_fixed",
        "baud_unknown",
        "adapter_echoes",
        "line_noise",
        "latency_timer",
        "not_listen_only",
    ],
)

Advice = TypeAliasType(
    "Advice",
    Literal[
        "connect_adapter",
        "check_adapter",
        "see_adapter_message",
        "check_timing_and_wiring",
        "find_short",
        "set_bit_timing",
        "set_bit_rate",
        "check_wires",
        "check_wires_and_baud",
        "free_serial_line",
        "check_plugs",
        "slow_sender",
        "reduce_computer_load",
        "none_needed",
        "renumber_node",
        "change_own_node_id",
        "close_program",
        "assign_servo_ids",
        "turn_off_commander",
        "renumber_servos",
        "keep_one_allocator",
        "turn_allocator_on",
        "free_node_id",
        "check_node_and_restart",
        "check_node",
        "check_cable_and_restart",
        "check_worst_cable",
        "check_computer",
        "check_supply",
        "check_database",
        "free_disk",
        "see_server_log",
    ],
)
"""Code of a remedy. see_adapter_message: the message of the adapter is in the params, as a problem."""


AllocatorChoice = TypeAliasType("AllocatorChoice", Literal["on", "off", "force"])

TransferKind = TypeAliasType("TransferKind", Literal["message", "request", "response"])

HealthCode = TypeAliasType("HealthCode", Literal["ok", "warning", "error", "critical"])
"""Health of a node, from NodeStatus."""

RefusalCode = TypeAliasType("RefusalCode", Literal["table_failed", "pinned_id_in_use", "all_taken"])
"""Reason why a node gets no node ID."""


@dataclass(frozen=True, slots=True, config=STRICT)
class Finding:
    """One check of the doctor. `ok` only with `all=true`."""

    code: FindingCode = Field(description="Code for programs. Stable.")
    severity: Severity = Field(description="Severity.")
    text: str = Field(description="One sentence for users.")
    evidence: str = Field(description="Observed values.")
    remedy: str | None = Field(description="What to do about it. Null if nothing.")
    node_ids: tuple[int, ...] = Field(default_factory=tuple[int, ...], description="IDs of the nodes concerned.")
    uids: tuple[str, ...] = Field(default_factory=tuple[str, ...], description="Unique IDs of the servos concerned.")
    advice: Advice | None = Field(default=None, description="Code of `remedy`. Null if there is none.")
    params: Params = Field(default_factory=dict[str, Param])


class AllocatorState(Model):
    """State of the node ID allocator."""

    state: Literal["on", "off", "standby"] = Field(description="standby: another allocator responds.")
    mode: AllocatorChoice = Field(description="Selected mode. force: responds beside another allocator, too.")
    granted: int = Field(description="Number of node IDs in the table.")
    pending: int = Field(description="Number of nodes that request a node ID now.")
    free: int = Field(description="Number of free node IDs.")
    competing_node_id: int | None = Field(description="Node ID of a competing allocator on this bus. Null if none.")
    own_id_shared: bool = Field(
        description="Another program uses hornbill's node ID. Unless the mode is force, hornbill allocates no node IDs "
        "until one minute after its last frame."
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
    serial_number: str | None = Field(description="USB serial number of the adapter. Null if unknown.")
    latency_ms: int | None = Field(
        description="Latency timer of an FTDI chip, ms. Null if the system does not report it."
    )


class AdapterNote(Model):
    """An unusual property of a working adapter."""

    code: Literal[
        "adapter_silent", "bit_rate_fixed", "baud_unknown", "adapter_echoes", "line_noise", "latency_timer",
        "not_listen_only",
    ] = Field(description="Code for programs. Stable.")  # fmt: skip
    text: str = Field(description="One sentence for users.")
    params: dict[str, str | int | float] = Field(description="Values in the text, by name.")


class Bus(Model):
    """State of the bus, from the adapter and its counters."""

    state: Literal["disconnected", "connecting", "active", "passive", "bus_off", "lost"] = Field(
        description="State of the adapter."
    )
    address: str | None = Field(description="INTERFACE:CHANNEL, as in `PUT /bus`. Null without a bus.")
    bitrate: int | None = Field(description="Bit rate, bit/s. Null if unknown.")
    role: ConnectionRoleName | None = Field(
        description="host: configures, commands and allocates node IDs. guest: allocates no node IDs, reads at most "
        "200 frames/s, and moves only servos that no other node commands. observer: sends no frame. Null without a bus."
    )
    role_reason: str | None = Field(description="Why guest was chosen with role auto. Null if the role was requested.")
    role_reason_params: Params
    listen_only: bool | None = Field(
        description="The adapter is in listen-only mode, so it does not even acknowledge frames. Null without a bus."
    )
    sample_point: float | None = Field(description="Sample point, 0 to 1. Null if unknown.")
    trouble: str | None = Field(description="Problem of the adapter and its remedy. Null while it works.")
    trouble_params: Params
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


class Adapter(Model):
    """An available CAN adapter. `address`: for `PUT /bus`."""

    address: str = Field(description="INTERFACE:CHANNEL, as in `PUT /bus`.")
    interface: str = Field(description="python-can interface, such as `socketcan`.")
    channel: str = Field(description="Channel of that interface, such as `can0`.")
    name: str = Field(description="Display name: product, serial number.")
    state: Literal["ready", "connected", "down", "wrong_bitrate", "no_permission", "in_use", "no_driver"] = Field(
        description="Availability."
    )
    usable: bool = Field(description="It can be connected now.")
    reason: str | None = Field(description="Reason why it is unusable, or a peculiarity. Null if none.")
    remedy: str | None = Field(description="What to do about it, if possible as a command. Null if nothing.")
    cause: str | None = Field(description="Code of `reason` and `remedy`, as of problems. Null if none.")
    params: Params
    bitrate: int | None = Field(description="Bit rate, bit/s. Null if unknown.")
    sample_point: float | None = Field(description="Sample point, 0 to 1. Null if unknown.")
    serial_number: str | None = Field(description="USB serial number. Null if unknown.")
    baud: int | None = Field(description="Baud rate of the last use of a serial adapter, bit/s. Null if unknown.")


class PendingAllocation(Model):
    """A pending node ID request and its progress."""

    uid_part: str = Field(description="Known part of the unique ID, hex.")
    stage: int = Field(ge=0, le=3, description="Number of parts received, 0 to 3.")
    attempts: int = Field(description="Number of allocation attempts started.")
    waiting_s: float = Field(description="Time since the first request, s.")
    age_s: float = Field(description="Time since it was last received, s.")
    refusal: str | None = Field(description="Reason why it gets no node ID. Null if it will get one.")
    refusal_code: RefusalCode | None = Field(description="Code of `refusal`. Null if it will get one.")
    refusal_params: Params


class DecodedTransfer(Model):
    """One transfer in the format of `hornbill decode`, with a summary."""

    timestamp: float = Field(description="Time, seconds since 1970 UTC.")
    type: str | None = Field(description="Full DSDL name. Null if the type is unknown.")
    kind: TransferKind = Field(description="Broadcast message, request or response.")
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
    can_id: str = Field(description="CAN identifier of the first frame, 8 hex digits.")
    frames: int = Field(description="Number of CAN frames.")


class RawFrame(Model):
    """One frame on the bus."""

    timestamp: Utc
    sent: bool = Field(description="Sent by this server.")
    can_id: str = Field(description="CAN identifier, 8 hex digits.")
    data: str = Field(description="Data bytes, hex.")
    problem: str | None = Field(description="Reason why the frame belongs to no transfer. Null if it does.")
