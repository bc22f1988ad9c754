"""Types of the API's responses. Generated from the OpenAPI document by `make generate`."""

from __future__ import annotations

from typing import Any, Literal, Required, TypeAlias, TypedDict


class About(TypedDict):
    """Description of a recording. Times: seconds since 1970 UTC. `utc_offset`: conversion from the writer's clock."""

    bus: RecordedBus | None
    """Bus that was connected. Null if none was."""
    ended_at: float
    """Seconds since 1970 UTC."""
    format: Literal[1]
    """Format version of the recording."""
    frames: int
    """Number of CAN frames."""
    incomplete: list[str]
    """Members that were truncated at their size limit."""
    marks: list[Mark]
    """Triggers of the recording."""
    reason: MarkReason
    """Type of trigger."""
    schema_revision: str
    """Revision of the parameter tables."""
    servos: list[RecordedServo]
    """One entry per servo."""
    started_at: float
    """Seconds since 1970 UTC."""
    text: str
    """One sentence for users."""
    utc_offset: float
    """Offset from the writer's clock to seconds since 1970 UTC, s."""
    version: str
    """Version of hornbill."""


class Activity(TypedDict):
    """Present activity of a servo's motor and horn, derived from Status and polled rows. At rest: the angle
    command has not changed for 0.6 s."""

    oscillation_hz: float | None
    """Frequency of the oscillation while hunting, Hz. Null until measured."""
    peak_to_peak_deg: float | None
    """Peak-to-peak angle, °: of the oscillation while hunting, otherwise of the last 0.6 s. Null if unknown."""
    since: float
    """Start of this state, seconds since 1970 UTC."""
    state: Literal[
        "holding",
        "moving",
        "turning",
        "hunting",
        "saturated",
        "soft_start",
        "released",
        "held_after_timeout",
        "off",
        "brake",
        "unknown",
    ]
    """holding: output on, angle steady within 0.3° for 0.6 s; moving: output on, angle changing; turning: speed or
    torque command other than 0; hunting: at rest, and the angle has oscillated by 0.5° or more for at least
    1 s; saturated: at rest, angle steady, and torque at 90 % or more of the available torque; soft_start:
    moving to 0° after a start; released: switched off by the servo's own timeout (0x26 off, 0x27);
    held_after_timeout: holds its last command after the timeout (0x26 hold); off: output off for another
    reason, see `output`; brake: output off, weak brake; unknown: offline, being identified, saved or
    restarted, output unknown, or no angle for 1 s."""
    torque_limit_pct: float
    """Available torque at rest in that direction, %: the lowest of the torque limit (with 0x25 on), the
    overcurrent limit relative to its default, and the supply voltage relative to nominal."""
    torque_pct: float | None
    """Torque as last read from 0x0A, %. Null if never read."""


class Adapter(TypedDict):
    """An available CAN adapter. `address`: for `PUT /bus`."""

    address: str
    """INTERFACE:CHANNEL, as in `PUT /bus`."""
    baud: int | None
    """Baud rate of the last use of a serial adapter, bit/s. Null if unknown."""
    bitrate: int | None
    """Bit rate, bit/s. Null if unknown."""
    cause: str | None
    """Code of `reason` and `remedy`, as of problems. Null if none."""
    channel: str
    """Channel of that interface, such as `can0`."""
    interface: str
    """python-can interface, such as `socketcan`."""
    name: str
    """Display name: product, serial number."""
    params: Params
    reason: str | None
    """Reason why it is unusable, or a peculiarity. Null if none."""
    remedy: str | None
    """What to do about it, if possible as a command. Null if nothing."""
    sample_point: float | None
    """Sample point, 0 to 1. Null if unknown."""
    serial_number: str | None
    """USB serial number. Null if unknown."""
    state: Literal["ready", "connected", "down", "wrong_bitrate", "no_permission", "in_use", "no_driver"]
    """Availability."""
    usable: bool
    """It can be connected now."""


class AdapterNote(TypedDict):
    """An unusual property of a working adapter."""

    code: Literal[
        "adapter_silent",
        "bit_rate_fixed",
        "baud_unknown",
        "adapter_echoes",
        "line_noise",
        "latency_timer",
        "not_listen_only",
    ]
    """Code for programs. Stable."""
    params: dict[str, str | int | float]
    """Values in the text, by name."""
    text: str
    """One sentence for users."""


class AdviceItem(TypedDict):
    """One point to check before the first flight."""

    code: Literal[
        "servo_id_zero",
        "status_not_received",
        "throw_beyond_limits",
        "step_above_deadband",
        "silent_when_unarmed",
        "node_id_dynamic_range",
        "position_in_log",
    ]
    """Code for programs. Stable."""
    output: int | None
    """Output it concerns. Null if all."""
    text: str
    """One sentence for users."""


class Allocation(TypedDict):
    """One row of the allocation table."""

    last_seen: float | None
    """Last contact, seconds since 1970 UTC. Null if unknown."""
    node_id: int
    """Node ID, 1 to 127."""
    online: bool
    """Received recently."""
    pinned: bool
    """Assigned manually and reserved for this node."""
    uid: str
    """Unique ID, 32 lower-case hex digits."""


class AllocationChange(TypedDict):
    """The changed row, or the deleted row as it was."""

    last_seen: float | None
    """Last contact, seconds since 1970 UTC. Null if unknown."""
    node_id: int
    """Node ID, 1 to 127."""
    note: str
    """When the change takes effect, one sentence."""
    note_code: NoteCode
    """Code of the note."""
    note_params: Params
    online: bool
    """Received recently."""
    pinned: bool
    """Assigned manually and reserved for this node."""
    uid: str
    """Unique ID, 32 lower-case hex digits."""


class Allocations(TypedDict):
    """Allocation table and pending requests."""

    allocations: list[Allocation]
    """Rows of the allocation table, one per node."""
    free: int
    """Number of free node IDs."""
    pending: list[PendingAllocation]
    """Nodes that request a node ID now."""


class AllocatorState(TypedDict):
    """State of the node ID allocator."""

    competing_node_id: int | None
    """Node ID of a competing allocator on this bus. Null if none."""
    free: int
    """Number of free node IDs."""
    granted: int
    """Number of node IDs in the table."""
    mode: AllocatorChoice
    """Selected mode. force: responds beside another allocator, too."""
    own_id_shared: bool
    """Another program uses hornbill's node ID. Unless the mode is force, hornbill allocates no node IDs until one
    minute after its last frame."""
    pending: int
    """Number of nodes that request a node ID now."""
    state: Literal["on", "off", "standby"]
    """standby: another allocator responds."""


class AuditRow(TypedDict):
    """One action and its result. Values are in engineering units."""

    action: str
    """Action, such as `write` or `save`."""
    after: Any
    """Value afterwards. Null if none or unknown."""
    at: float
    """Seconds since 1970 UTC."""
    before: Any
    """Value before. Null if none."""
    bench: str | None
    """Bench on which it happened. Null if unknown."""
    by: str
    """Client that did it."""
    detail: str
    """Notes as one text, in English."""
    id: int
    """ID, as used in paths."""
    job: str | None
    """ID of the job that it was part of. Null if none."""
    key: str | None
    """Parameter key. Null if the action concerns no row."""
    notes: list[Note]
    """Details, each with a code for programs."""
    outcome: str
    """Result of the action."""
    requested: Any
    """Requested value. Null if none."""
    uid: str | None
    """Unique ID of the servo, 32 hex digits. Null if it concerns none."""


class BatchOutcome(TypedDict):
    """Result for one servo."""

    changes: list[Change]
    """Changes, row by row."""
    job: str | None
    """ID of the save job, with `save`. Null otherwise."""
    outcome: Literal["applied", "rolled_back", "planned", "rejected", "not_tried"]
    """rejected: nothing was written; not_tried: an earlier servo failed; planned: of a dry run."""
    problem: Problem | None
    """Reason for rejected or rolled_back. Null otherwise."""
    restart: Forecast | None
    """Effect of the save on the horn."""
    revision: str | None
    """Revision of the values afterwards. Null if nothing was read."""
    rom_changes: list[RomChange]
    """Rows whose ROM value is known to differ, and requested rows."""
    rom_unknown: list[ParameterKey]
    """Keys of rows that are saved unchanged and whose ROM value is unknown."""
    uid: str
    """Unique ID of the servo, 32 hex digits."""


class BatchPatched(TypedDict):
    """Results in the order of the request."""

    servos: list[BatchOutcome]
    """One entry per servo."""


class BatchRead(TypedDict):
    """Parameters of several servos."""

    servos: dict[str, BatchServo]
    """Results by unique ID."""


class BatchServo(TypedDict):
    """Parameters of one servo, or the problem if it is unknown or unreadable."""

    parameters: dict[str, Reading]
    """Readings by key."""
    problem: Problem | None
    """Reason why there are none. Null otherwise."""
    revision: str | None
    """Revision of the values, for If-Match. Null if unknown."""


class Behaviour(TypedDict):
    """Behaviour of a simulated servo where the specification is silent."""

    acknowledges_restart: bool
    """Whether 0x11 and RestartNode are acknowledged before the restart. Table 2-10 has a flag for success."""
    acknowledges_save: bool
    """Whether SAVE and 0x12 are acknowledged before the silence of the ROM write (4.11)."""
    array_command_feeds_timeout: bool
    """Whether ArrayCommand counts as a command for 0x27. 4.19 lists registers 0x00 to 0x02, which it writes."""
    array_command_id_0: bool
    """Whether a servo with servo ID 0, the factory setting, follows ArrayCommand entries for 0. The document
    specifies 1 to 254 for senders; Futaba's program copies the ID from Status, and moves new servos with
    it."""
    array_command_shows: bool
    """Whether 0x00 to 0x02 read the values of an ArrayCommand. Chapter 4 describes no command outside these
    registers, so the message should be stored there; firmware may also store it separately, and then they
    read the last value written by GetSet."""
    cascade_without_switch: bool
    """Whether firmware without 0x25 (1.010) always has speed and torque control on. Futaba's program commanded
    speed and torque before 0x25 was added in 1.100."""
    erase_keeps_identity: bool
    """Whether ERASE and 0x10 preserve 0x44 to 0x46. The document does not mention it."""
    erase_rom: bool
    """Whether ERASE also resets ROM. Table 2-12 says "at once" but not where; chapter 3 says ROM; for the same
    reset, 4.9 says that 0x12 must follow."""
    failures_latch: bool
    """Whether failure bits remain set until the next start. 4.12 says that some bits remain until power-off, but
    names only those of its note 2."""
    health_of_notifications: bool
    """Whether a notification sets the health in NodeStatus to WARNING. The document mentions only warnings;
    Futaba's manuals show a yellow indicator in their program for notifications, too."""
    later_rows: Literal["zero", "empty", "silent"]
    """Response of a row that was added by a later firmware. Futaba's program requests it regardless of 0x52, like
    the PWM rows."""
    limits_follow_origin: bool
    """Whether 0x38 and 0x39 are relative to the origin of 0x44. 4.31 gives them in the same degrees as the
    command, and 4.36 moves the zero of those; otherwise they remain at the same position of the horn."""
    lower_case_names: bool
    """Whether `0x2a` is accepted as `0x2A`. The document prints capitals and calls the name an ASCII string."""
    out_of_range: Literal["refuse", "clamp"]
    """Handling of a GetSet write outside the row's range. The document distinguishes successful and failed
    requests (table 2-16) and does not mention modified values, so the literal interpretation is that such a
    write fails. The public type allows a server to clamp. Values in ArrayCommand are handled alike: ignored
    or clamped."""
    position_unit: Literal["hundred_degrees", "radian", "degree", "tenth_degree"]
    """Meaning of position 1.0 on the bus. The tables print "0.001/0.1°": 0.001 stands for 0.1°, so 1.0 is 100°,
    and Futaba's program sends and displays 100° per unit."""
    pwm_rows: Literal["zero", "empty", "silent"]
    """Response of 0x34 to 0x37 on a model without PWM input, where section 3.1 prints 0/0/0. Futaba's program
    requests them on every model and waits indefinitely for a register without a response."""
    reserved: Literal["empty", "zero"]
    """Response of a reserved register. The list gives it the default 0 but no access. A write has no effect in
    either case."""
    save_opcode_restarts: bool
    """Whether the opcode SAVE restarts the servo. Section 4.11 states this for 0x12; both write the same ROM."""
    soft_start_shows: Literal["temporary", "stored"]
    """What 0x25 and 0x3A to 0x3D read (and a ROM write stores) during soft start. 4.14 says these parameters are
    changed temporarily and restored afterwards."""
    timeout_changes: Literal["output_on", "any_output"]
    """Whether the action of 0x26 also replaces OFF or BRAKE in 0x20, so that a brake is released after 0x27. 4.19
    names no exception and counts 0x20 among the commands; but 4.13 says in the same words that OFF remains
    whatever is commanded, and a timeout that brakes or frees a motor without output protects nothing."""
    timeout_from: Literal["power_on", "first_command"]
    """When the timeout of 0x27 starts. 4.14 lists the timeout among the events that end soft start, but every
    command ends it, too: so the timeout must run without a command, from power-on. With factory settings, a
    servo without commands turns torque off after 1,000 ms. 4.19 alone could mean that it starts with the
    first command."""
    write_only: Literal["empty", "zero"]
    """Response to reading 0x10 to 0x12. Their access is W, so a read fails."""


class BurstPart(TypedDict):
    """Command sent to one servo."""

    clamped: bool
    """A limit of the servo was sent instead of the requested value."""
    uid: str
    """Unique ID, 32 lower-case hex digits."""
    value: float
    """Sent value as a 16-bit float: angle (°), speed (rpm) or torque (%)."""


class BurstSent(TypedDict):
    """Result of a burst."""

    commands: list[BurstPart]
    """Command sent to each servo."""
    messages: int
    """Number of ArrayCommand messages sent."""
    sent_at: float
    """Seconds since 1970 UTC."""
    start_skew_s: float
    """Time between its first and last message, s."""
    warnings: list[str]
    """Warnings, one sentence each."""


class Bus(TypedDict):
    """State of the bus, from the adapter and its counters."""

    address: str | None
    """INTERFACE:CHANNEL, as in `PUT /bus`. Null without a bus."""
    allocator: AllocatorState | None
    """State of the node ID allocator. Null without a bus."""
    bitrate: int | None
    """Bit rate, bit/s. Null if unknown."""
    bus_offs: int
    """Number of times the adapter went bus-off."""
    error_frames: int
    """Error frames seen on the bus from any node."""
    errors: int
    """Error frames, and own frames that could not be sent."""
    frame_gap_ms: float
    """Pause between frames of one transfer, ms."""
    ignored: int
    """Standard, remote and CAN FD frames, which are not DroneCAN on classic CAN."""
    limited_by: Literal["can", "serial_line"] | None
    """The slower of CAN bus and serial line, whose budget limits polling. Null without a bus."""
    listen_only: bool | None
    """The adapter is in listen-only mode, so it does not even acknowledge frames. Null without a bus."""
    load_cap_pct: float
    """Load limit of polling, %: the bus budget, or less on a slower serial line."""
    load_pct: float | None
    """Bus load, %. Null without a bus."""
    notes: list[AdapterNote]
    """Unusual properties of the adapter."""
    reopened: int
    """Number of automatic reconnects."""
    retry_in_s: float | None
    """Time until the adapter is reopened automatically, s. Null while it works."""
    role: ConnectionRoleName | None
    """host: configures, commands and allocates node IDs. guest: allocates no node IDs, reads at most 200 frames/s,
    and moves only servos that no other node commands. observer: sends no frame. Null without a bus."""
    role_reason: str | None
    """Why guest was chosen with role auto. Null if the role was requested."""
    role_reason_params: Params
    rx_dropped: int
    """RX overruns: received frames that were dropped."""
    rx_fps: float
    """Frames received per second."""
    rx_frames: int
    """Frames received."""
    sample_point: float | None
    """Sample point, 0 to 1. Null if unknown."""
    serial_line: SerialLine | None
    """Serial line. Null unless the adapter is a serial one."""
    state: Literal["disconnected", "connecting", "active", "passive", "bus_off", "lost"]
    """State of the adapter."""
    trouble: str | None
    """Problem of the adapter and its remedy. Null while it works."""
    trouble_code: Literal["nothing_received", "error_passive", "bus_off", "adapter_lost", "recording_over"] | None
    """Kind of problem, for programs. Null while it works."""
    trouble_params: Params
    tx_fps: float
    """Frames sent per second."""
    tx_frames: int
    """Frames sent."""
    unacknowledged: int
    """Transmitted frames that no node acknowledged."""


class Candidate(TypedDict):
    """A servo that appears to be new (servo ID 0, no label)."""

    servo: Servo
    servo_id: int | None
    """Next free servo ID. Null if none is free."""


class Candidates(TypedDict):
    """Servos to commission, by serial number, and nodes waiting for a node ID."""

    pending: list[PendingAllocation]
    """Nodes that still wait for a node ID."""
    servos: list[Candidate]
    """One entry per servo."""


class Caution(TypedDict):
    """A caution about a command."""

    code: CautionCode
    """Code for programs. Stable."""
    confirm: MotionCode | None
    """Confirmation code required to send it. Null if none."""
    level: Literal["warning", "failure"]
    """failure: the motion may never end."""
    params: dict[str, float]
    """Values in the text, by name with unit."""
    text: str
    """One sentence for users."""


class Change(TypedDict):
    """Result of one key. For torque_mode, `before` and `after` are configured values."""

    after: bool | int | float | str | None
    """Value read back after writing. Null if the servo did not respond."""
    before: bool | int | float | str | None
    """Value before."""
    key: ParameterKey
    """Parameter key."""
    requested: bool | int | float | str | None
    """Requested value."""
    verdict: Literal["planned", "applied", "clamped", "refused", "no_response", "unchanged", "rolled_back"]
    """Result. planned: of a dry run, or torque_mode on, which the following save writes."""


class Choice(TypedDict):
    """One named value of a choice."""

    key: str
    """Value that programs write."""
    label: str
    """Display name."""
    raw: int
    """Integer on the wire."""


class Columns(TypedDict):
    """Samples of one channel. `t`: seconds since 1970 UTC. `v`: in its unit, null for a gap."""

    channel: str
    """Parameter key."""
    t: list[float]
    """Times, seconds since 1970 UTC."""
    uid: str
    """Unique ID of the servo, 32 hex digits."""
    v: list[float | None]
    """Values. Null is a gap."""


class Commanded(TypedDict):
    """Result of a command: when it was sent and, with `wait` settled, whether and when the horn settled."""

    angle_deg: float | None
    """Horn angle, °. Positive is clockwise."""
    clamped: bool
    """A limit of the servo was sent instead of the requested value."""
    in_band_s: float | None
    """Time within the band at the end, s. Null if not waited for."""
    max_deviation_deg: float | None
    """Greatest deviation of these samples from the target, °. Null if none."""
    samples: int | None
    """Number of consecutive samples within the band at the end. Null if not waited for."""
    sent_at: float
    """Seconds since 1970 UTC."""
    settle_time_s: float | None
    """Time from sending to settling, s. Null if not waited for or never settled."""
    settled: bool | None
    """The horn settled at the target. Null if not waited for."""
    unmet: Literal["band", "dwell", "samples"] | None
    """Condition not fulfilled when `settled` is false. band: the angle is outside the band; dwell: within it, but
    not for `dwell_s`; samples: the servo did not respond to angle reads. Null otherwise."""
    value: float
    """Sent value, in steps of 0.1°, 1 rpm or 1 %."""
    warnings: list[str]
    """Warnings, one sentence each."""


class Commander(TypedDict):
    """Another node that commands a servo by ArrayCommand: a command within the last second."""

    age_s: float
    """Time since its last command, s."""
    command_deg: float | None
    """Last commanded angle, °. Null for speed, torque and unknown types."""
    error_deg: float | None
    """Tracking error: `command_deg` minus the last angle, °. Null if either is unknown."""
    name: str | None
    """Its name from GetNodeInfo. Null if unknown."""
    node_id: int
    """Node ID of the sender, 1 to 127."""
    rate_hz: float | None
    """Rate over the last 100 commands, Hz. Null after a single command."""
    since: float
    """Start of its commands, seconds since 1970 UTC."""
    type: Literal["unitless", "position", "force", "speed", "pwm", "unknown"]
    """Command type of ArrayCommand (table 2-21)."""
    value: float | None
    """Last command value, in the unit of its type. Null if not finite."""


class CommissionPlan(TypedDict):
    """Effect of commissioning on one servo."""

    changes: list[Change]
    """Rows to write."""
    restart: Forecast | None
    """Effect of the save on the horn."""
    rom_changes: list[RomChange]
    """Rows whose ROM value is known to differ, and requested rows."""
    rom_unknown: list[ParameterKey]
    """Keys of rows that are saved unchanged and whose ROM value is unknown."""
    uid: str
    """Unique ID, 32 lower-case hex digits."""


class CommissioningPreview(TypedDict):
    """Effect of commissioning, in the order of the request."""

    servos: list[CommissionPlan]
    """One entry per servo."""


class Comparison(TypedDict):
    """Two sides, row by row: `servo:UID`, `rom:UID`, `snapshot:ID`, `profile:NAME`, `default:MODEL[@FIRMWARE]`, …"""

    differences: list[Difference]
    """Rows that differ, by address."""
    left: str
    """Left side."""
    right: str
    """Right side."""
    same: int
    """Number of rows known to be equal on both sides."""


class Condition(TypedDict):
    """Met while `parameter` has one of the values `reads`, or while the last command was one of `last_command`.
    `absent` is its value on a servo whose model or firmware lacks `parameter`."""

    absent: bool
    """Value to assume on a servo without that row, raw."""
    last_command: list[CommandKind]
    """True while the last command was one of these."""
    parameter: str | None
    """Key of the row to check. Null for conditions on the last command."""
    reads: list[int]
    """True while the row has one of these values, raw."""


class Difference(TypedDict):
    """A row that differs. A value is null if the side lacks the row (`*_has` false), or if it is unknown."""

    identity: bool
    """Part of the servo's identity: origin, servo ID, node ID (0x44 to 0x46)."""
    key: ParameterKey
    """Parameter key."""
    left: bool | int | float | str | None
    """Value on the left."""
    left_has: bool
    """The left side has this row."""
    left_unit: str
    """Unit of the value on the left. 0x36 follows 0x37, so units may differ."""
    right: bool | int | float | str | None
    """Value on the right."""
    right_has: bool
    """The right side has this row."""
    right_unit: str
    """Unit of the value on the right."""


class Drift(TypedDict):
    """Rows whose ROM value changed unexpectedly. Empty if there are none."""

    rows: list[DriftRow]
    """Rows that changed."""
    uid: str
    """Unique ID, 32 lower-case hex digits."""


class DriftRow(TypedDict):
    """A row whose ROM value changed unexpectedly."""

    key: ParameterKey
    """Parameter key."""
    now: bool | int | float | str | None
    """Value found."""
    proved: bool
    """false: found in RAM after an unobserved restart, so very likely in ROM."""
    was: bool | int | float | str | None
    """Value known to have been in ROM."""


class EffectRule(TypedDict):
    """`parameters` have no effect while all conditions of `when` are met. `why` completes "No effect now: …";
    `{last_command}` in it is the kind of the last command. `why_absent` replaces it if a condition is met
    because the servo lacks the row. The rule does not apply to servos with `unless_row`."""

    code: str
    """Reason by name. It ends in `_absent` where `why_absent` is the reason."""
    inferred: bool
    """Follows from the specification without being stated in it."""
    parameters: list[str]
    """Keys of the rows without effect while every condition is met."""
    section: str
    """Section of the specification."""
    unless_row: str | None
    """The rule does not apply to servos with this row. Null if it always applies."""
    when: list[Condition]
    """Conditions, all of which must be met."""
    why: str
    """Reason, continuing “No effect now”."""
    why_absent: str
    """Reason on a servo without the row. Null for the same reason."""


class Estimate(TypedDict):
    """A measured value with its 95 % interval."""

    high: float
    """Upper end of the 95 % interval."""
    low: float
    """Lower end of the 95 % interval."""
    value: float
    """Value, in the unit of its field."""


class EventMessage(TypedDict):
    """An entry of the event log."""

    at: float
    """Seconds since 1970 UTC."""
    code: EventCode
    """Code for programs. Stable."""
    level: Literal["info", "notice", "warning", "failure"]
    """Severity."""
    params: dict[str, Any]
    """Values in the text, by name. Empty for events without values."""
    seq: int
    """Sequence number on this connection. A gap means lost messages."""
    text: str
    """One sentence for users."""
    type: Literal["event"]
    uid: str | None
    """Unique ID of the servo, 32 hex digits. Null if it concerns none."""


class Failsafe(TypedDict):
    """What a servo does when commands stop (0x26, 0x27)."""

    action: Literal["hold", "off", "brake"] | None
    """Timeout action (0x26). Null if unknown."""
    after_s: float | None
    """Timeout (0x27), s. Null if unknown."""
    confirmed: MeasuredGap | None
    """Last measured gap. Null if none was seen."""
    text: str
    """What it does, one sentence."""


class Fault(TypedDict):
    """One fault bit of one servo, present or past (section 4.12)."""

    acknowledged_at: float | None
    """Time of acknowledgement, seconds since 1970 UTC. Null if not acknowledged."""
    acknowledged_by: str | None
    """Client that acknowledged it. Null if not acknowledged."""
    active: bool
    """Set in the last reading, which is fresh."""
    advice: str
    """What to do about it."""
    bit: int
    """Bit number in its register, from 0."""
    count: int
    """Number of times it was set."""
    first_seen: float
    """First time it was read as set, seconds since 1970 UTC."""
    group: str
    """Group within its table."""
    key: str
    """Key of the bit."""
    label: str
    """Display name."""
    last_seen: float
    """Last time it was read as set, seconds since 1970 UTC, to within one poll."""
    latched: bool
    """Active, and stays set until the servo restarts, regardless of its cause."""
    level: FaultLevel
    """Severity."""
    past_event: bool
    """Describes something before the servo's last start."""
    stale: bool
    """Set in the last reading, which is too old to know the present state."""


class FaultBit(TypedDict):
    """One documented bit of `parameter`. In the overview, `level` is the level the bit summarizes."""

    advice: str
    """What to do about it."""
    bit: int
    """Bit number in the 32-bit register, from 0."""
    group: Literal["hardware", "software", "communication", "other"]
    """Group within its table."""
    key: str
    """Key of the bit."""
    label: str
    """Display name."""
    latching: bool
    """Stays set until the servo restarts, regardless of its cause."""
    level: FaultLevel
    """Severity."""
    limit: str | None
    """Parameter that sets its threshold. Null if none."""
    older_firmware: bool
    """Reported by older firmware only, and not in the specification."""
    output_off: bool
    """The motor has no output while it is set."""
    parameter: str
    """Key of its register."""
    past_event: bool
    """Describes something before the servo's last start."""
    pwm_only: bool
    """Always 0 on models without PWM input."""
    section: str
    """Section of the specification."""


class FaultWords(TypedDict):
    """The fault registers 0x19, 0x1A and 0x1B as last read (section 4.12)."""

    failure: int | None
    """Failure register, raw. Null if never read."""
    notification: int | None
    """Notification register, raw. Null if never read."""
    warning: int | None
    """Warning register, raw. Null if never read."""


class FaultsRead(TypedDict):
    """Fault bits of several servos."""

    servos: dict[str, ServoFaults]
    """Results by unique ID."""


class Finding(TypedDict):
    """One check of the doctor. `ok` only with `all=true`."""

    advice: Advice | None
    """Code of `remedy`. Null if there is none."""
    code: FindingCode
    """Code for programs. Stable."""
    evidence: str
    """Observed values."""
    node_ids: list[int]
    """IDs of the nodes concerned."""
    params: Params
    remedy: str | None
    """What to do about it. Null if nothing."""
    severity: Literal["ok", "notice", "warning", "failure"]
    """Severity."""
    text: str
    """One sentence for users."""
    uids: list[str]
    """Unique IDs of the servos concerned."""


class Forecast(TypedDict):
    """Effect of a restart on the horn, and its risks."""

    code: Literal["no_torque", "brake", "holds", "unknown", "unknown_start", "stays", "moves"]
    """Behaviour of the horn. unknown_start: it turns to 0° from an unknown angle."""
    coded_warnings: list[ForecastWarning]
    """`warnings`, each with its code."""
    from_deg: float | None
    """Current horn angle within ±180°, °. Null if unknown."""
    moves: bool
    """The horn turns at the restart, or may turn."""
    takes_s: float | None
    """Approximate duration at the 30 rpm of soft start (section 4.14), s."""
    text: str
    """One sentence for users."""
    to_deg: float | None
    """Angle after the restart, °. Null if the horn is not moved."""
    turn_count_lost: bool
    """The turn count restarts from 0."""
    warnings: list[str]
    """Warnings, one sentence each."""


class ForecastWarning(TypedDict):
    """A reason not to restart now."""

    code: str
    """Code for programs. Stable."""
    params: dict[str, float]
    """Values in the text, by name. Empty for texts without values."""
    text: str
    """One sentence for users."""


class FrequencyCurve(TypedDict):
    """Response at one amplitude. Lists have one value per frequency; empty in lists of runs."""

    achieved_hz: float
    """Samples per second."""
    amplitude_deg: float
    """Peak amplitude of the command about the start angle, °."""
    coherence: list[float]
    """Share of the angle that the command explains, 0 to 1."""
    frequency_hz: list[float]
    """Frequencies, rising, Hz."""
    gain_db: list[float]
    """Gain from command to angle, dB."""
    gain_error_db: list[float]
    """Half of the 95 % interval of the gain, dB."""
    metrics: FrequencyMetrics
    missed_slots: int
    """Commands that were not sent in time or not acknowledged."""
    peak_deg: float
    """Largest distance of the horn from the start angle, °."""
    phase_deg: list[float]
    """Phase from command to angle, not wrapped, °. Negative: the angle lags."""
    phase_error_deg: list[float]
    """Half of the 95 % interval of the phase, °."""
    reliable: list[bool]
    """Coherence above 0.9, gain known to ±1 dB, motion above the resolution. Do not use others."""
    samples: int
    """Samples of the angle."""
    slots: int
    """Commands of the excitation."""


class FrequencyMetrics(TypedDict):
    """Metrics of a frequency response, from reliable frequencies only. Null if not within them."""

    bandwidth_3db_hz: Estimate | None
    """Frequency at which the gain falls below −3 dB, Hz."""
    bandwidth_90deg_hz: Estimate | None
    """Frequency at which the phase falls below −90°, Hz."""
    delay_s: Estimate | None
    """Delay between command and angle at low frequencies, s."""
    gain_margin_db: Estimate | None
    """Factor by which the open-loop gain may rise until the loop hunts, dB."""
    gain_margin_hz: float | None
    """Frequency at which the loop would hunt, Hz."""
    peak_db: Estimate | None
    """Highest gain, dB."""
    peak_hz: float | None
    """Frequency of the highest gain, Hz."""
    phase_margin_deg: Estimate | None
    """Phase lag that may be added at an open-loop gain of 1 until the loop hunts, °."""
    phase_margin_hz: float | None
    """Frequency of an open-loop gain of 1, Hz."""


class FrequencyResponse(TypedDict):
    """A completed frequency response with its test conditions."""

    amplitude_deg: float
    """Requested peak amplitude, °."""
    at: float
    """Time of the run, seconds since 1970 UTC."""
    curves: list[FrequencyCurve]
    """Response at the requested amplitude; with a ladder at half, one and two times it, in this order."""
    dependence: Note | None
    """How the response depends on the amplitude. Null without a ladder or if it does not."""
    duration_s: float
    """Duration of the excitation at one amplitude, s."""
    excitation: Excitation
    """chirp: one sine of rising frequency. multisine: many sines at once."""
    firmware: str | None
    """Firmware version, such as `1.300`. Null if unknown."""
    from_hz: float
    """Lowest frequency, Hz."""
    id: int
    """ID, as used in paths."""
    model: str | None
    """Model, such as `BLA21-06U-A0`. Null if unknown."""
    note: str
    """Note of the user."""
    parameters: dict[str, bool | int | float | str | None]
    """Values of all rows during the run, by key."""
    procedure: str
    """Procedure and its version, such as `step/1`."""
    set_up: SetUp
    """Set-up during the run."""
    start_deg: float
    """Angle about which the horn moved, °."""
    temperature_c: float | None
    """Servo temperature before the run, °C. Null if unknown."""
    to_hz: float
    """Highest frequency, Hz."""
    uid: str
    """Unique ID, 32 lower-case hex digits."""
    verdict: Verdict
    voltage_v: float | None
    """Supply voltage at the servo before the run, V. Null if unknown."""
    warnings: list[Note]
    """Conditions that make the metrics less meaningful."""


class Group(TypedDict):
    """A group of the parameter list, as in the document (tables 3-1 to 3-11)."""

    description: str
    """Purpose of its rows."""
    key: str
    """Key of the group."""
    label: str
    """Display name."""


class Health(TypedDict):
    """Health of the server."""

    bus: str
    """State of the bus."""
    commit: str | None
    """Commit it was built from, `+` if changed since. Null if unknown."""
    demo: bool
    """Simulated servos on an embedded bus."""
    parts: dict[str, Part]
    """State of each part, by name."""
    ready: bool
    """No part has failed; `/ready` returns 200."""
    status: PartState
    """Worst state of the parts."""
    uptime_s: float
    """Time since its start, s."""
    version: str
    """Version of hornbill."""


class Imported(TypedDict):
    """Result of an import."""

    lines: list[LineVerdict]
    """Verdict on each line."""
    profile: Profile | None
    """Imported profile. Null unless all lines are ok."""


class ImportedPlan(TypedDict):
    """Outputs of a parameter file."""

    advice: list[AdviceItem]
    """Points to check."""
    plan: Plan
    """Outputs on DroneCAN."""


class ImprovePreview(TypedDict):
    """What an improvement will do. Nothing was sent that moves or writes."""

    angle_deg: float
    """Present angle, from which it moves and to which it returns, °."""
    changes: list[str]
    """Keys of rows that are changed in RAM and kept only if measured better."""
    duration_s: float
    """Maximum duration, s."""
    from_deg: float
    """Lowest angle that is permitted, °."""
    goal: Goal
    """Goal."""
    limits: dict[str, float]
    """Limits written for its duration and restored afterwards, by key, in the row's unit."""
    step_deg: float
    """Largest step, °. Smaller ones precede it."""
    steps: int
    """Maximum number of steps."""
    to_deg: float
    """Highest angle that is permitted, °."""
    uid: str
    """Unique ID, 32 lower-case hex digits."""


class IntegerReading(TypedDict):
    """One parameter as last read from RAM, with its ROM value and this model's limits."""

    address: int
    """Register address."""
    age_s: float | None
    """Time since it was read, s. Null if never read."""
    at: float | None
    """Time of the read, seconds since 1970 UTC. Null if never read."""
    configured: Any
    """Value that a save writes: `value`, or for torque_mode, whose RAM value is session state, the value written
    as configuration, otherwise `rom`."""
    default: Any
    """Default of this model. Null if none or unknown."""
    differs_from_default: bool | None
    """`configured` differs from the default. Null if either is unknown or there is none."""
    in_effect: bool | None
    """false: the row has no effect now. Null if unknown."""
    key: ParameterKey
    """Parameter key."""
    maximum: float | None
    """Maximum of this model. Null if none or unknown."""
    minimum: float | None
    """Minimum of this model. Null if none or unknown."""
    raw: int | None
    """Integer on the wire. Null if never read."""
    rom: Any
    """Value known to be in ROM. Null if unknown."""
    stale: bool
    """The reading is too old or the servo is offline, so the servo may have another value."""
    unit: str
    """Unit of the value. Empty if none."""
    unsaved: bool | None
    """`configured` differs from ROM. Null if either is unknown or ROM lacks the row."""
    value: Any
    """Engineering value or choice key. Null for the dummy value and if never read."""
    why: Why | None
    """`why_not` by code. Null while it has an effect."""
    why_not: str | None
    """Reason why it has no effect now. Null if it has."""


class Job(TypedDict):
    """A long-running operation."""

    created_at: float
    """Seconds since 1970 UTC."""
    ended_at: float | None
    """End, seconds since 1970 UTC. Null until then."""
    error: Problem | None
    """Reason for the failure. Null unless it failed."""
    id: str
    """ID, as used in paths."""
    kind: Literal[
        "save",
        "restart",
        "factory_reset",
        "identify",
        "profile",
        "commissioning",
        "step_test",
        "frequency_response",
        "mechanics",
        "improve",
        "restore_output",
        "plan",
    ]
    """Kind of job."""
    progress: float
    """Progress, 0 to 1."""
    result: dict[str, Any] | None
    """Result, depending on the kind. Null until the job has ended."""
    resumable: bool
    """The job can be resumed with `POST …/resume`."""
    state: JobState
    """State of the job."""
    step: str | None
    """Current step, for users. Null if none."""
    steps: list[JobStep]
    """Steps in order."""
    uid: str | None
    """Unique ID of the servo, 32 hex digits. Null if it concerns none."""


class JobStep(TypedDict):
    """One step of a job, with its evidence."""

    ahead: str | None
    """End of `evidence` that describes remaining work. Obsolete once the job has ended. Null if none."""
    code: StepCode
    """Code of the step, unique together with the kind of the job."""
    ended_at: float | None
    """End, seconds since 1970 UTC. Null until then."""
    evidence: str | None
    """Observed values. Null if none yet."""
    evidence_code: EvidenceCode | None
    """Code of `evidence`. problem: `evidence_params` has its code as `problem`. Null if none."""
    evidence_params: Params
    name: str
    """Name for programs."""
    params: Params
    started_at: float | None
    """Start, seconds since 1970 UTC. Null until then."""
    state: Literal["waiting", "running", "done", "failed", "skipped"]
    """State of the step."""
    text: str
    """One sentence for users."""
    uid: str | None
    """Servo of this step, in a job on several servos. Null otherwise."""


class KnownServo(TypedDict):
    """A known servo, on the bus or not."""

    bench: str | None
    """Bench where it was last seen. Null if unknown."""
    bench_seen_at: float | None
    """When it was last seen there, seconds since 1970 UTC. Null if unknown."""
    drift: list[str]
    """Keys of rows whose ROM value changed unexpectedly."""
    firmware: str | None
    """Firmware version, such as `1.300`. Null if unknown."""
    first_seen: float | None
    """First contact, seconds since 1970 UTC. Null if unknown."""
    hardware_version: int | None
    """Hardware version from GetNodeInfo. Null if unknown."""
    label: str
    """Nickname. Empty if none."""
    last_seen: float | None
    """Last contact, seconds since 1970 UTC. Null if unknown."""
    model: str | None
    """Model, such as `BLA21-06U-A0`. Null if unknown."""
    node_id: int | None
    """Last known node ID. Null if none."""
    notes: str
    """Notes of users. Empty if none."""
    online: bool
    """Received recently."""
    production_date: str | None
    """Production date as the servo reports it. Null if unknown."""
    rom: dict[str, bool | int | float | str | None]
    """Values last known to be in ROM, by key."""
    serial: str | None
    """Serial number: model number, dash, product number. Null if unknown."""
    servo_id: int | None
    """Last known servo ID (0x45). Null if unknown."""
    snapshots: int
    """Number of stored snapshots."""
    uid: str
    """Unique ID, 32 lower-case hex digits."""


class Lease(TypedDict):
    """Lease, which grants motion control. When it expires, torque goes off on the servos it commanded."""

    expires_at: float
    """Expiry, seconds since 1970 UTC."""
    expires_in_s: float
    """Time until it expires unless renewed, s."""
    heartbeat_s: float
    """Interval at which to renew it, s of real time: a third of `ttl_s`, shorter in virtual time."""
    holder: str
    """Client with motion control."""
    id: str
    """ID, as used in paths."""
    request: PendingRequest | None
    """Pending request for motion control. Null if none."""
    shown_id: str
    """First digits of `id`, visible to all clients."""
    ttl_s: float
    """Time to live after each renewal, s."""
    uids: list[str] | None
    """Servos it covers, unique IDs. Null: all."""


class LeaseView(TypedDict):
    """Lease as visible to other clients, without its secret ID."""

    expires_at: float
    """Seconds since 1970 UTC."""
    expires_in_s: float
    """Time until it expires unless renewed, s."""
    holder: str
    """Client with motion control."""
    request: PendingRequest | None
    """Pending request for motion control. Null if none."""
    shown_id: str
    """First digits of its ID, which distinguish leases but do not allow their use."""
    ttl_s: float
    """Time to live after each renewal, s."""
    uids: list[str] | None
    """Servos it covers, unique IDs. Null: all."""


class LeftOut(TypedDict):
    """A row that was not written."""

    key: ParameterKey
    """Parameter key."""
    why: str
    """Reason, one sentence."""
    why_code: NoteCode
    """Code of the reason."""
    why_params: Params


class Limits(TypedDict):
    """The two rows that limit a command, or a reading outside which torque turns off."""

    confirm: str | None
    """Word that confirms a limit within the tolerance of the reading. Null for a command."""
    lower: str
    """Parameter with the lower limit."""
    tolerance: int | None
    """Accuracy of the reading, raw. Null for a command."""
    upper: str
    """Parameter with the upper limit."""


class LineVerdict(TypedDict):
    """Verdict on one line of an imported file."""

    code: NoteCode | None
    """Code of the text. Null if the text is empty."""
    key: str
    """Parameter key."""
    line: int
    """Line number from 1. 0 if unknown."""
    params: Params
    text: str
    """Problem and remedy, or for ok a note. May be empty."""
    value: bool | int | float | str | None
    """Value in the file."""
    verdict: Literal[
        "ok", "unknown", "forbidden", "read_only", "identity", "out_of_range", "invalid", "not_in_this_model"
    ]
    """ok: accepted. Any other verdict rejects the whole file."""


class LogFile(TypedDict):
    """Log file in the data folder."""

    bytes: int
    """Size, bytes."""
    modified_at: float
    """Seconds since 1970 UTC."""
    name: str
    """File name."""


class LogState(TypedDict):
    """Current or last log."""

    bytes: int
    """Size, bytes."""
    dropped: int
    """Frames that could not be written in time."""
    format: LogFormat | None
    """File format. Null if there is no log."""
    frames: int
    """Number of CAN frames."""
    limit_bytes: int
    """Size at which logging ends, bytes."""
    name: str | None
    """File name. Null if there is no log."""
    reason: str | None
    """Reason why it ended. Null if stopped manually."""
    reason_code: NoteCode | None
    """Code of the reason. Null if stopped manually."""
    reason_params: Params
    started_at: float | None
    """Start, seconds since 1970 UTC. Null if there is no log."""
    state: Literal["idle", "running", "stopped", "full", "failed"]
    """State of the log."""


class LostValue(TypedDict):
    """A RAM value that was lost in a restart without a save."""

    at: float
    """Time the loss was found, seconds since 1970 UTC."""
    key: str
    """Parameter key."""
    value: bool | int | float | str | None
    """Engineering value or choice key, as PATCH takes it."""


class Mark(TypedDict):
    """A trigger of the recording. `at`: seconds since 1970 UTC."""

    at: float
    """Seconds since 1970 UTC."""
    params: Params
    reason: MarkReason
    """Type of trigger."""
    text: str
    """One sentence for users."""
    uid: str | None
    """Unique ID of the servo, 32 hex digits. Null if it concerns none."""


class MeasuredGap(TypedDict):
    """The last gap of commands that was longer than the timeout."""

    at: float
    """Time of its last command, seconds since 1970 UTC."""
    gap_s: float | None
    """Duration of the gap, s. Null while it lasts."""
    node_id: int
    """Node that stopped commanding."""
    torque_pct: float | None
    """Torque read after the timeout, %. Null if not read."""


class Mechanics(TypedDict):
    """What is known about the mechanics of one servo, in the directions of its registers."""

    travel: list[TravelPoint]
    """Load and friction along the travel, in order of angle."""
    travel_run: int | None
    """ID of the run of `travel`. Null if not measured."""
    uid: str
    """Unique ID, 32 lower-case hex digits."""
    unknowable: list[Note]
    """What a sensor at the horn cannot know."""
    values: list[MechanicsValue]
    """Measured quantities."""


class MechanicsValue(TypedDict):
    """One measured quantity, from the newest run that contains it."""

    at: float
    """Time of the run, seconds since 1970 UTC."""
    estimate: Estimate | None
    """Value with its 95 % interval. Null if it could not be measured."""
    name: Quantity
    """Quantity."""
    note: Note | None
    """Why it could not be measured. Null otherwise."""
    run: int
    """ID of the run."""
    unit: str
    """Unit, such as `°`. Empty for a share or multiple."""


class NewSimServo(TypedDict, total=False):
    """A simulated servo to add. Omitted fields are those of a new servo."""

    angle_deg: float
    """Initial horn angle, °."""
    any_firmware: bool
    """Allow a firmware version that does not exist for this model."""
    firmware: str
    """Firmware version, such as `1.300`."""
    model: Required[str]
    """Model, such as `BLA21-06U-A0`."""
    node_id: int
    """Fixed node ID. 0: it requests one."""
    plant: PlantConstants
    """Load, friction and other constants of the horn."""
    reads: dict[str, int]
    """Values reported for model_number, firmware_version or hardware_version, to simulate an unknown servo."""
    rom: dict[str, int]
    """Other values in ROM, by key, raw."""
    servo_id: int
    """Servo ID. 0: factory setting."""
    uid: str | None
    """Unique ID. Null for a generated one."""


class Node(TypedDict):
    """A node on the bus, or this server itself (table 2-17). A node that never sent NodeStatus has mode `unknown`,
    health `warning` and uptime 0. All nodes that request a node ID are listed as one entry with node ID 0."""

    actuator_id: int | None
    """Servo ID in its Status. Null if it broadcasts no actuator's Status."""
    age_s: float
    """Time since it was last received, s."""
    angle_deg: float | None
    """Angle in its Status, °; in Futaba's unit if it is not identified. Null if it broadcasts none."""
    commanded_by: list[Commander]
    """Other nodes that command its servo ID now."""
    hardware_version: str | None
    """Hardware version from GetNodeInfo. Null if unknown."""
    health: HealthCode
    """Health from NodeStatus."""
    kind: Literal["servo", "hornbill", "foreign", "unknown"]
    """Kind of node. unknown: not identified yet, or no response."""
    mode: str
    """Mode from NodeStatus."""
    name: str | None
    """Name from GetNodeInfo. Null if unknown."""
    node_id: int
    """Node ID, 1 to 127. 0 for nodes without one."""
    note: str | None
    """Reason why it is not a servo, or a peculiarity. Null if none."""
    note_code: NoteCode | None
    """Code of the note. Null if none."""
    note_params: Params
    online: bool
    """Received recently."""
    restarts: int
    """Number of observed restarts."""
    software_version: str | None
    """Software version from GetNodeInfo. Null if unknown."""
    uid: str | None
    """Unique ID from GetNodeInfo, 32 hex digits. Null if unknown."""
    uptime_s: int
    """Time since its start, s."""


class Note(TypedDict):
    """One sentence for users, with its code and its values."""

    code: NoteCode
    """Code of `text`."""
    params: Params
    text: str
    """One sentence for users."""


class NumberReading(TypedDict):
    """One parameter as last read from RAM, with its ROM value and this model's limits."""

    address: int
    """Register address."""
    age_s: float | None
    """Time since it was read, s. Null if never read."""
    at: float | None
    """Time of the read, seconds since 1970 UTC. Null if never read."""
    configured: Any
    """Value that a save writes: `value`, or for torque_mode, whose RAM value is session state, the value written
    as configuration, otherwise `rom`."""
    default: Any
    """Default of this model. Null if none or unknown."""
    differs_from_default: bool | None
    """`configured` differs from the default. Null if either is unknown or there is none."""
    in_effect: bool | None
    """false: the row has no effect now. Null if unknown."""
    key: ParameterKey
    """Parameter key."""
    maximum: float | None
    """Maximum of this model. Null if none or unknown."""
    minimum: float | None
    """Minimum of this model. Null if none or unknown."""
    raw: int | None
    """Integer on the wire. Null if never read."""
    rom: Any
    """Value known to be in ROM. Null if unknown."""
    stale: bool
    """The reading is too old or the servo is offline, so the servo may have another value."""
    unit: str
    """Unit of the value. Empty if none."""
    unsaved: bool | None
    """`configured` differs from ROM. Null if either is unknown or ROM lacks the row."""
    value: Any
    """Engineering value or choice key. Null for the dummy value and if never read."""
    why: Why | None
    """`why_not` by code. Null while it has an effect."""
    why_not: str | None
    """Reason why it has no effect now. Null if it has."""


class Output(TypedDict):
    """Output of a servo's motor, and its reason. Session state: switching it does not edit parameter 0x20."""

    by: str | None
    """Client that switched it. Null if none or unknown."""
    reason: Literal["configured", "stop", "lease", "command", "timeout", "protection"]
    """configured: since the start of the servo, or 0x20 was written as configuration; stop: Stop; lease: a lease
    ended or expired; command: a client or another tool switched it; timeout: the servo's own timeout (0x26,
    0x27); protection: temperature or voltage limit, or motor failure."""
    since: float | None
    """Time of the switch, seconds since 1970 UTC. Null if unknown."""
    state: Literal["on", "off", "brake", "unknown"]
    """Output of the motor. unknown: offline, or not read since the start."""


class OutputRestorePreview(TypedDict):
    """Effect of restoring outputs."""

    clears_stop: bool
    """Would first clear a latched stop."""
    servos: list[RestorableOutput]
    """One entry per servo."""


class Parameter(TypedDict):
    """One register. `default`, `minimum` and `maximum` are raw; an engineering value is raw / per_unit."""

    access: Literal["rw", "r", "w"]
    """Read and write, read only, or executed by writing."""
    action: bool
    """Whether it is an action, triggered by a write (0x10 to 0x12)."""
    address: int
    """Register address, 0x00 to 0x5F."""
    advice: str
    """What to know before changing an expert row. Empty otherwise."""
    after_restart: bool
    """Takes effect after a restart."""
    choices: list[Choice]
    """Choices of a row of kind `choice`."""
    default: int | None
    """Default, raw. Null if it depends on the model."""
    description: str
    """What it does."""
    dummy: bool
    """May read 555,555,555, which means inactive."""
    expert: bool
    """Hidden by default."""
    forbidden: bool
    """Never written or read, because the servo would need factory repair."""
    group: str
    """Group within its table."""
    identity: bool
    """Part of the servo's identity: origin, servo ID, node ID (0x44 to 0x46)."""
    key: str
    """Parameter key."""
    kind: Literal["number", "choice", "switch", "bits"]
    """Number, choice, switch or bits."""
    label: str
    """Display name."""
    limits: Limits | None
    """The rows that limit it. Null if none."""
    live: bool
    """Changes without being written, and is read before a save, restart or reset."""
    maximum: int | None
    """Maximum, raw. Null if it depends on the model."""
    minimum: int | None
    """Minimum, raw. Null if it depends on the model."""
    moves_horn: bool
    """A change moves a held horn, so torque must be off."""
    name: str
    """Register name in GetSet, four ASCII characters: `0x2A` (table 2-14)."""
    per_unit: int
    """Raw steps per unit."""
    poll_s: float | None
    """Polling period, s. Null if read only on request."""
    pwm_only: bool
    """Only on models with PWM input."""
    rom: bool
    """Whether a ROM write stores it: 0x20 to 0x4F (section 4.11)."""
    section: str
    """Section of the specification."""
    shapes_output: bool
    """No effect while the motor has no output."""
    sided: bool
    """Its sign is a direction, positive is clockwise, and is shown."""
    since: str
    """First firmware with this row."""
    smallest: int | None
    """Smallest usable magnitude other than 0, raw. Null if none is known."""
    soft_start: int | None
    """Temporary value during soft start, raw. Null if soft start does not change it."""
    unique: UniqueNumber | None
    """Suggested range of a number unique to each servo. Null if servos may share it."""
    unit: str
    """Unit of the engineering value. Empty if none."""
    unit_when: UnitWhen | None
    """Another unit while another row has a certain value. Null if none."""


class ParameterFile(TypedDict):
    """A parameter file for an autopilot."""

    advice: list[AdviceItem]
    """Points to check."""
    name: str
    """File name."""
    text: str
    """Content, with comments."""


class Parameters(TypedDict):
    """Parameters"""

    parameters: ReadingByKey
    """Readings by key."""
    revision: str
    """Revision of the values, for If-Match."""


class ParametersPatched(TypedDict):
    """Result of a change; with `save`, the save job, or the result of its dry run."""

    changes: list[Change]
    """Changes, row by row."""
    failure: str | None
    """Reason for rolled_back, one sentence. Null otherwise."""
    job: str | None
    """ID of the save job, with `save`. Null otherwise."""
    outcome: ChangeOutcome
    """All changes, or none: rolled_back restores the earlier values."""
    problem: Problem | None
    """Reason for rolled_back, with code and facts. Null otherwise."""
    restart: Forecast | None
    """Effect of the save on the horn."""
    revision: str
    """Revision of the values, for If-Match."""
    rom_changes: list[RomChange]
    """Rows whose ROM value is known to differ, and requested rows."""
    rom_unknown: list[ParameterKey]
    """Keys of rows that are saved unchanged and whose ROM value is unknown."""


class Part(TypedDict):
    """State of one part of the server."""

    findings: list[Finding]
    """Why it is degraded or failed."""
    state: PartState
    """State of the part."""


class PendingAllocation(TypedDict):
    """A pending node ID request and its progress."""

    age_s: float
    """Time since it was last received, s."""
    attempts: int
    """Number of allocation attempts started."""
    refusal: str | None
    """Reason why it gets no node ID. Null if it will get one."""
    refusal_code: RefusalCode | None
    """Code of `refusal`. Null if it will get one."""
    refusal_params: Params
    stage: int
    """Number of parts received, 0 to 3."""
    uid_part: str
    """Known part of the unique ID, hex."""
    waiting_s: float
    """Time since the first request, s."""


class PendingRecording(TypedDict):
    """A recording in progress."""

    marks: list[RecordingMark]
    """Triggers of the recording."""
    ready_in_s: float
    """Time until it is written, s."""
    reason: MarkReason
    """Type of trigger."""
    text: str
    """One sentence for users."""


class PendingRequest(TypedDict):
    """Pending request for motion control. It is granted after `expires_in_s` unless refused."""

    by: str
    """Client that requests motion control."""
    expires_in_s: float
    """Time until motion control passes unless refused, s."""
    id: str
    """ID with which to refuse the request."""
    reason: str
    """Reason for the request."""


class Plan(TypedDict):
    """Outputs of one autopilot."""

    outputs: list[PlanOutput]
    """Outputs, one per servo."""
    program: Program
    """ardupilot or px4."""
    rate_hz: int
    """Rate of ArrayCommand, Hz. ArduPilot only."""


class PlanOutput(TypedDict):
    """One output and the linkage of its servo. Angles are those of the servo, ° (positive is clockwise)."""

    function: int | None
    """SERVOn_FUNCTION of ArduPilot or UAVCAN_SV_FUNCn of PX4. Null: not written."""
    high_deg: float
    """Clockwise end of the linkage, °."""
    label: str
    """Name of the servo, for comments."""
    low_deg: float
    """Counterclockwise end of the linkage, °."""
    neutral_deg: float
    """Neutral position, °."""
    output: int
    """Output number of the autopilot, from 1."""
    reversed: bool
    """A positive demand of the autopilot turns the servo counterclockwise."""
    servo_id: int
    """Servo ID (0x45) of the servo."""


class PlanPreview(TypedDict):
    """Result of a dry run of a plan."""

    cycles: int
    """Number of cycles."""
    least_s: float
    """Duration of the waits and of speed and torque steps, over all cycles, s."""
    name: str
    """Name of the plan."""
    plan: dict[str, Any]
    """The plan as read, with defaults, in the form of the request."""
    servos: list[PlanServo]
    """Servos in the order of the plan."""
    steps: int
    """Number of steps of a cycle."""


class PlanServo(TypedDict):
    """A servo of a plan, as found by a dry run."""

    cautions: list[Caution]
    """Cautions about its commands."""
    problem: Problem | None
    """Reason why it would not run. Null if none."""
    title: str
    """Display name."""
    uid: str
    """Unique ID of the servo, 32 hex digits."""


class PlantConstants(TypedDict):
    """Constants of one horn. The defaults are those of a servo without load on a stiff supply. Torque is relative
    to stall torque at nominal supply, angles are those of the horn clockwise from its notch (0x08 without
    origin and reverse)."""

    backlash_deg: float
    """Backlash between motor and horn, °."""
    breakaway: float
    """Static friction, share of stall torque."""
    coulomb: float
    """Friction of a moving horn, share of stall torque. At most `breakaway`."""
    inertia: float
    """Inertia on the horn, as a multiple of the servo's own inertia there."""
    load_by_angle: list[list[Any]]
    """Additional load at angles: pairs of angle (°, increasing) and load (% of stall torque), linear in between,
    constant beyond the ends."""
    load_pct: float
    """Constant load, % of stall torque. Positive pushes clockwise."""
    sensor_noise_deg: float
    """Noise of angle readings, RMS, °. The servo's own loop filters it."""
    stop_ccw_deg: float | None
    """Counterclockwise end stop of the horn, °. Null for none."""
    stop_cw_deg: float | None
    """Clockwise end stop of the horn, °. Null for none."""
    supply_ohm: float
    """Resistance of the supply and its cable, Ω. Voltage drops by it times the motor current."""
    torque_lag_s: float
    """Time constant of torque behind its demand, s."""
    viscous: float
    """Viscous friction at no-load speed, share of stall torque."""
    wear_per_hour: float
    """Growth of all friction per hour of motion, as a share."""


class PositionUnitState(TypedDict):
    """Unit of a servo's positions in broadcasts, and how it is known."""

    evidence: str
    """Evidence, one sentence for users."""
    evidence_code: NoteCode
    """Code of `evidence`."""
    evidence_params: Params
    state: Literal["assumed", "confirmed", "forced", "conflict"]
    """assumed: Futaba's unit, not checked yet; confirmed: Status and 0x08 agree on it; conflict: they agree on
    another unit, on none or on several, and ArrayCommand angles are refused; forced: set by a client."""
    unit: PositionUnit
    """Unit of positions in broadcasts."""


class Problem(TypedDict):
    """Problem document (application/problem+json): code for programs, text with remedy, and facts as extra
    members."""

    cause: str | None
    """More specific code of the cause. Stable. Null if `code` is specific enough."""
    code: str
    """Code for programs. Stable."""
    detail: str
    """What happened and what to do, with the request that resolves it, if there is one."""
    params: Params
    status: int
    """HTTP status."""
    summary: str
    """`detail` without the request."""
    title: str
    """Short title of the code."""
    type: str
    """URI reference of the problem type."""


class Profile(TypedDict):
    """A named set of values, in engineering units."""

    created_at: float
    """Seconds since 1970 UTC."""
    description: str
    """Purpose of the profile."""
    firmware: str | None
    """Firmware it is made for, such as `1.300`. Null for any."""
    model: str | None
    """Model it is made for. Null for any."""
    name: str
    """Name of the profile."""
    schema_revision: str
    """Revision of the parameter tables at the time of writing."""
    units: dict[str, str]
    """Units of the values, by key."""
    updated_at: float
    """Seconds since 1970 UTC."""
    values: dict[str, bool | int | float | str | None]
    """Values by key."""


class PwmModeReading(TypedDict):
    """One parameter as last read from RAM, with its ROM value and this model's limits."""

    address: int
    """Register address."""
    age_s: float | None
    """Time since it was read, s. Null if never read."""
    at: float | None
    """Time of the read, seconds since 1970 UTC. Null if never read."""
    configured: PwmModeChoice | Any
    """Value that a save writes: `value`, or for torque_mode, whose RAM value is session state, the value written
    as configuration, otherwise `rom`."""
    default: PwmModeChoice | Any
    """Default of this model. Null if none or unknown."""
    differs_from_default: bool | None
    """`configured` differs from the default. Null if either is unknown or there is none."""
    in_effect: bool | None
    """false: the row has no effect now. Null if unknown."""
    key: ParameterKey
    """Parameter key."""
    maximum: float | None
    """Maximum of this model. Null if none or unknown."""
    minimum: float | None
    """Minimum of this model. Null if none or unknown."""
    raw: int | None
    """Integer on the wire. Null if never read."""
    rom: PwmModeChoice | Any
    """Value known to be in ROM. Null if unknown."""
    stale: bool
    """The reading is too old or the servo is offline, so the servo may have another value."""
    unit: str
    """Unit of the value. Empty if none."""
    unsaved: bool | None
    """`configured` differs from ROM. Null if either is unknown or ROM lacks the row."""
    value: PwmModeChoice | Any
    """Engineering value or choice key. Null for the dummy value and if never read."""
    why: Why | None
    """`why_not` by code. Null while it has an effect."""
    why_not: str | None
    """Reason why it has no effect now. Null if it has."""


class Reading(TypedDict):
    """One parameter as last read from RAM, with its ROM value and this model's limits."""

    address: int
    """Register address."""
    age_s: float | None
    """Time since it was read, s. Null if never read."""
    at: float | None
    """Time of the read, seconds since 1970 UTC. Null if never read."""
    configured: bool | int | float | str | None
    """Value that a save writes: `value`, or for torque_mode, whose RAM value is session state, the value written
    as configuration, otherwise `rom`."""
    default: bool | int | float | str | None
    """Default of this model. Null if none or unknown."""
    differs_from_default: bool | None
    """`configured` differs from the default. Null if either is unknown or there is none."""
    in_effect: bool | None
    """false: the row has no effect now. Null if unknown."""
    key: str
    """Parameter key."""
    maximum: float | None
    """Maximum of this model. Null if none or unknown."""
    minimum: float | None
    """Minimum of this model. Null if none or unknown."""
    raw: int | None
    """Integer on the wire. Null if never read."""
    rom: bool | int | float | str | None
    """Value known to be in ROM. Null if unknown."""
    stale: bool
    """The reading is too old or the servo is offline, so the servo may have another value."""
    unit: str
    """Unit of the value. Empty if none."""
    unsaved: bool | None
    """`configured` differs from ROM. Null if either is unknown or ROM lacks the row."""
    value: bool | int | float | str | None
    """Engineering value or choice key. Null for the dummy value and if never read."""
    why: Why | None
    """`why_not` by code. Null while it has an effect."""
    why_not: str | None
    """Reason why it has no effect now. Null if it has."""


class RecordedBus(TypedDict):
    """The connected bus: address, bit rate, own node ID."""

    address: str
    """INTERFACE:CHANNEL, as `PUT /bus` takes it."""
    bitrate: int
    """Bit rate, bit/s."""
    node_id: int
    """Node ID, 1 to 127."""


class RecordedCommander(TypedDict):
    """Another node that commanded a servo at the first trigger."""

    command_deg: float | None
    """Last commanded angle, °. Null for speed, torque and unknown types."""
    node_id: int
    """Node ID of the sender, 1 to 127."""
    rate_hz: float | None
    """Rate of its commands, Hz. Null after a single command."""


class RecordedReading(TypedDict):
    """One register as last read before the first trigger. `at`: seconds since 1970 UTC."""

    at: float | None
    """Time of the read, seconds since 1970 UTC. Null if unknown."""
    raw: int
    """Integer on the wire."""
    unit: str
    """Unit of the value. Empty if none."""
    value: bool | int | float | str | None
    """Engineering value or choice key."""


class RecordedServo(TypedDict):
    """One servo as known at the first trigger."""

    commanded_by: list[RecordedCommander]
    """Other nodes that commanded it at the first trigger."""
    firmware: int | None
    """Firmware version as read from 0x52, raw. Null if unknown."""
    hardware_version: int | None
    """Hardware version from GetNodeInfo. Null if unknown."""
    label: str
    """Nickname. Empty if none."""
    model_number: int | None
    """Model number as read from the servo."""
    name: str
    """Node name from GetNodeInfo."""
    node_id: int | None
    """Node ID, 1 to 127. Null if none."""
    production_date: str | None
    """Production date as the servo reports it. Null if unknown."""
    readings: dict[str, RecordedReading]
    """Last known values in RAM, by key."""
    rom: dict[str, int]
    """Last known values in ROM, by key."""
    serial_number: int | None
    """Product number as read from the servo. Null if unknown."""
    state: str
    """Operating state."""
    title: str
    """Display name."""
    uid: str
    """Unique ID of the servo, 32 hex digits."""


class RecorderState(TypedDict):
    """State of the recorder, which continuously buffers up to ten minutes."""

    before_s: float
    """Time a recording covers before its first trigger, s."""
    bytes: int
    """Memory in use, bytes."""
    frames: int
    """Number of CAN frames."""
    pending: PendingRecording | None
    """Recording that is not complete yet. Null if none."""
    reach_s: float
    """Time span recorded, s. Less than 600 after a start or if memory is full."""
    recording: bool
    """The recorder is running. false while a recording is played back."""


class Recording(TypedDict):
    """A recording in the data folder."""

    at: float
    """Time of its first trigger, seconds since 1970 UTC."""
    bytes: int
    """Size, bytes."""
    marks: list[RecordingMark]
    """Triggers of the recording."""
    name: str
    """File name."""
    problem: str | None
    """Reason why the file cannot be read. Null if it can."""
    problem_params: Params
    reason: MarkReason | None
    """Type of trigger."""
    seconds: float | None
    """Duration, s. Null if the file cannot be read."""
    started_at: float | None
    """Start, seconds since 1970 UTC. Null if the file cannot be read."""
    text: str
    """One sentence for users."""


class RecordingContent(TypedDict):
    """Content of a recording except its frames. To play it back, `PUT /bus` with address `recording:NAME`."""

    about: About
    complete: bool
    """All telemetry is included. false if it was truncated."""
    events: list[dict[str, Any]]
    """Events during the recording."""
    telemetry: list[Columns]
    """Telemetry, at most 500,000 samples."""
    writes: list[dict[str, str]]
    """Writes during the recording."""


class RecordingMark(TypedDict):
    """A trigger of a recording."""

    at: float
    """Time of the trigger, seconds since 1970 UTC."""
    params: Params
    reason: MarkReason
    """Type of trigger."""
    text: str
    """One sentence for users."""
    uid: str | None
    """Unique ID of the servo, 32 hex digits. Null if it concerns none."""


class Recycled(TypedDict):
    """Result of recycling."""

    free: int
    """Number of free node IDs."""
    freed: list[Allocation]
    """Removed rows, as they were."""


class ResetPreview(TypedDict):
    """Effect of a factory reset."""

    changes: list[Change]
    """Rows that would change."""
    kept: dict[str, bool | int | float | str | None]
    """Values of identity rows that stay, by key."""
    restart: Forecast
    """Effect of the restart on the horn."""


class RestorableOutput(TypedDict):
    """A servo whose output would be restored."""

    needs_lease: bool
    """The servo's timeout (0x26) would switch it off again. It stays on until the lease ends."""
    output: Output
    problem: Problem | None
    """Reason why it would stay off. Null if none."""
    title: str
    """Display name."""
    torque_pct: int | None
    """Current torque as just read, %. Null if unknown."""
    uid: str
    """Unique ID of the servo, 32 hex digits."""
    under_load: bool
    """Braked, turning or above 20 % torque. Requires confirmation."""


class Restored(TypedDict):
    """Result of restoring or copying values."""

    changes: list[Change]
    """Changes, row by row."""
    failure: str | None
    """Reason for rolled_back, one sentence. Null otherwise."""
    job: str | None
    """ID of the save job, with `save`. Null otherwise."""
    left_out: list[LeftOut]
    """Rows that were not written."""
    outcome: ChangeOutcome
    """All changes, or none: rolled_back restores the earlier values."""
    problem: Problem | None
    """Reason for rolled_back, with code and facts. Null otherwise."""
    restart: Forecast | None
    """Effect of the save on the horn."""
    revision: str
    """Revision of the values, for If-Match."""
    rom_changes: list[RomChange]
    """Rows whose ROM value is known to differ, and requested rows."""
    rom_unknown: list[ParameterKey]
    """Keys of rows that are saved unchanged and whose ROM value is unknown."""


class RomChange(TypedDict):
    """A row whose ROM value will change."""

    after: bool | int | float | str | None
    """Value that the save writes."""
    before: bool | int | float | str | None
    """Value known to be in ROM. Null if unknown."""
    key: ParameterKey
    """Parameter key."""


class RowRange(TypedDict):
    """Range of one row in one model, raw."""

    default: int | None
    """Default, raw."""
    maximum: int | None
    """Maximum, raw."""
    minimum: int | None
    """Minimum, raw."""


class RunOverlay(TypedDict):
    """Several runs for comparison. `differences`: the rows that differ, in row order."""

    comparable: bool
    """Metrics can be compared: same servo, set-up, procedure and step."""
    differences: dict[str, list[bool | int | float | str | None]]
    """Rows that differ, one value per run."""
    not_comparable: Note | None
    """Reason why not. Null if comparable."""
    runs: list[StepRun]
    """Runs in the requested order."""


class SavePreview(TypedDict):
    """Effect of a save. Empty if nothing would be saved."""

    restart: Forecast | None
    """Effect of the save on the horn."""
    rom_changes: list[RomChange]
    """Rows whose ROM value is known to differ, and requested rows."""
    rom_unknown: list[ParameterKey]
    """Keys of rows that are saved unchanged and whose ROM value is unknown."""


class SchemaDocument(TypedDict):
    """All tables: rows, models, firmware versions, fault bits, effect rules."""

    effects: list[EffectRule]
    """Conditions under which rows have no effect."""
    faults: list[FaultBit]
    """Bits of the three fault registers."""
    firmware: list[str]
    """Known firmware versions."""
    firmware_notes: dict[str, str]
    """Notes for users of a firmware, by version."""
    groups: list[Group]
    """Groups of the parameter list."""
    models: list[SchemaModel]
    """Models with their ranges."""
    overview: list[FaultBit]
    """Bits of the summary register."""
    parameters: list[Parameter]
    """All rows."""
    revision: str
    """Revision of the tables."""
    specification: str
    """Document the tables are made from."""


class SchemaModel(TypedDict):
    """One servo model."""

    firmware: list[str]
    """Firmware versions of this model."""
    hardware_version: int
    """Hardware version from GetNodeInfo."""
    model_number: int
    """Model number as read from the servo."""
    name: str
    """Model name."""
    pwm: bool
    """The model has a PWM input."""
    rows: dict[str, RowRange]
    """Ranges of the rows of its newest firmware, by key."""
    series: str
    """BLA15, BLA21 or BLA34."""
    voltage_class: str
    """Supply voltage class."""


class SerialLine(TypedDict):
    """The serial line between this computer and a serial adapter."""

    baud: int
    """Baud rate, bit/s."""
    budget: int | None
    """Full frames per second that the line carries. Null for USB adapters without a serial line."""
    confirmed: bool
    """Well-formed data was received at this baud rate."""
    found: bool
    """hornbill detected the baud rate. false if the address gives it."""
    latency_ms: int | None
    """Latency timer of an FTDI chip, ms. Null if the system does not report it."""
    load_pct: float | None
    """Share of the line used for receiving, %. Null without a budget."""
    serial_number: str | None
    """USB serial number of the adapter. Null if unknown."""


class Servo(TypedDict):
    """One servo, identified by its unique ID."""

    activity: Activity
    age_s: float | None
    """Age of `angle_deg`, s. Null if never received."""
    angle_deg: float | None
    """Horn angle, °. Positive is clockwise. Null if unknown."""
    bus: str | None
    """Address of the bus. Null while offline."""
    command_deg: float | None
    """Last known angle command, °. Null while inactive."""
    commanded_by: list[Commander]
    """Other nodes that command it now. hornbill then does not."""
    drift: list[str]
    """Keys of rows that another tool changed in ROM. Details: `GET …/drift`."""
    faults: FaultWords
    firmware: str | None
    """Firmware version, such as `1.300`. Null if unknown."""
    firmware_note: str | None
    """Note for users of this firmware, in English. Null if none."""
    hardware_version: int | None
    """Hardware version from GetNodeInfo. Null if unknown."""
    health: HealthCode | None
    """Health from NodeStatus. Null if unknown."""
    known_model: bool
    """The tables contain its series. Servos of other series are read-only."""
    label: str
    """Nickname, stored by the server."""
    lost: list[LostValue]
    """RAM values lost in a restart. A value is removed once it is in RAM again; all are removed by a successful
    save or `DELETE …/lost`."""
    mode: str | None
    """Mode from NodeStatus. Null if unknown."""
    model: str | None
    """Model, such as `BLA21-06U-A0`. Null if unknown."""
    model_number: int | None
    """Model number (0x50), which determines the series. Null if unknown."""
    name: str
    """Node name from GetNodeInfo."""
    node_id: int | None
    """Current node ID, 1 to 127. Null while it has none."""
    online: bool
    """Received recently."""
    output: Output
    owed: list[str]
    """Keys of rows with a temporary value in RAM that could not be restored yet. hornbill restores them as soon as
    the servo responds, and refuses its motion, changes and saves until then."""
    position_unit: PositionUnitState
    production_date: str | None
    """Production date, YYYY-MM-DDTHH:MM, time zone unknown. Null if unknown."""
    pwm: bool | None
    """The servo has a PWM input. Null if unknown."""
    serial: str | None
    """Serial number: model number, dash, product number. Null if unknown."""
    series: str | None
    """BLA15, BLA21 or BLA34. Null if unknown."""
    servo_id: int | None
    """Servo ID (0x45). ArrayCommand cannot address 0. Null if unknown."""
    state: Literal["identifying", "ready", "soft_start", "saving", "restarting", "updating", "protected", "offline"]
    """Operating state."""
    treated_as: TreatedAs
    uid: str
    """Unique ID, 32 lower-case hex digits."""
    unacknowledged: int
    """Number of warnings and failures not acknowledged since they last occurred."""
    unsaved: list[str]
    """Keys of rows configured differently from ROM. Switching the output does not count."""
    uptime_s: int | None
    """Time since its start, s. Null if unknown."""


class ServoFaults(TypedDict):
    """Fault bits of one servo, or the problem if it is unknown."""

    faults: list[Fault]
    """Failures, then warnings, then notifications. Active before past."""
    problem: Problem | None
    """Reason why there are none. Null otherwise."""


class SetUp(TypedDict):
    """Set-up of a servo. Null: not stated. Either arm and mass, or their inertia."""

    ambient_c: float | None
    """Ambient temperature, °C."""
    arm_mm: float | None
    """Distance of the mass from the axis of the horn, mm."""
    inertia_gm2: float | None
    """Moment of inertia on the horn, g·m², instead of arm and mass."""
    load_nm: float | None
    """Constant torque on the horn, N·m. Positive: clockwise."""
    mass_g: float | None
    """Mass at the end of the arm, g."""
    mounting: Mounting | None
    """Mounting: loose on a bench, in a vice, in its vehicle, or other."""
    supply_v: float | None
    """Voltage of the power supply, V."""


class SimAutopilot(TypedDict):
    """The simulated autopilot."""

    allocated: int
    """Number of node IDs it has allocated."""
    armed: bool
    """Armed: it moves its outputs."""
    node_id: int
    """Its node ID: 10 for ArduPilot, 1 for PX4, or the next one that no simulated servo has."""
    outputs: list[SimOutput]
    """Outputs."""
    program: Program
    """Autopilot program whose IDs and scaling it uses."""
    rate_hz: float
    """Rate of ArrayCommand, Hz."""
    safety_on: bool
    """Safety switch on: ArduPilot then sends no ArrayCommand."""
    sent_commands: int
    """Number of ArrayCommand messages sent."""
    sweep: bool
    """While armed it moves all outputs slowly between their ends."""


class SimAutopilotChange(TypedDict, total=False):
    """Changes to the simulated autopilot. Omitted fields stay unchanged."""

    armed: bool | None
    """Arm or disarm."""
    outputs: list[SimOutputChange]
    """Changes to outputs."""
    rate_hz: float | None
    """Rate, Hz."""
    restart: bool
    """Restart it: two seconds of silence, disarmed."""
    safety_on: bool | None
    """Safety switch."""
    sweep: bool | None
    """Move all outputs slowly while armed."""


class SimBehaviour(TypedDict, total=False):
    """Choices to make where the specification is silent. Omitted ones stay unchanged."""

    acknowledges_restart: bool | None
    """Whether 0x11 and RestartNode are acknowledged before the restart. Table 2-10 has a flag for success."""
    acknowledges_save: bool | None
    """Whether SAVE and 0x12 are acknowledged before the silence of the ROM write (4.11)."""
    array_command_feeds_timeout: bool | None
    """Whether ArrayCommand counts as a command for 0x27. 4.19 lists registers 0x00 to 0x02, which it writes."""
    array_command_id_0: bool | None
    """Whether a servo with servo ID 0, the factory setting, follows ArrayCommand entries for 0. The document
    specifies 1 to 254 for senders; Futaba's program copies the ID from Status, and moves new servos with
    it."""
    array_command_shows: bool | None
    """Whether 0x00 to 0x02 read the values of an ArrayCommand. Chapter 4 describes no command outside these
    registers, so the message should be stored there; firmware may also store it separately, and then they
    read the last value written by GetSet."""
    cascade_without_switch: bool | None
    """Whether firmware without 0x25 (1.010) always has speed and torque control on. Futaba's program commanded
    speed and torque before 0x25 was added in 1.100."""
    erase_keeps_identity: bool | None
    """Whether ERASE and 0x10 preserve 0x44 to 0x46. The document does not mention it."""
    erase_rom: bool | None
    """Whether ERASE also resets ROM. Table 2-12 says "at once" but not where; chapter 3 says ROM; for the same
    reset, 4.9 says that 0x12 must follow."""
    failures_latch: bool | None
    """Whether failure bits remain set until the next start. 4.12 says that some bits remain until power-off, but
    names only those of its note 2."""
    health_of_notifications: bool | None
    """Whether a notification sets the health in NodeStatus to WARNING. The document mentions only warnings;
    Futaba's manuals show a yellow indicator in their program for notifications, too."""
    later_rows: Literal["zero", "empty", "silent"] | None
    """Response of a row that was added by a later firmware. Futaba's program requests it regardless of 0x52, like
    the PWM rows."""
    limits_follow_origin: bool | None
    """Whether 0x38 and 0x39 are relative to the origin of 0x44. 4.31 gives them in the same degrees as the
    command, and 4.36 moves the zero of those; otherwise they remain at the same position of the horn."""
    lower_case_names: bool | None
    """Whether `0x2a` is accepted as `0x2A`. The document prints capitals and calls the name an ASCII string."""
    out_of_range: Literal["refuse", "clamp"] | None
    """Handling of a GetSet write outside the row's range. The document distinguishes successful and failed
    requests (table 2-16) and does not mention modified values, so the literal interpretation is that such a
    write fails. The public type allows a server to clamp. Values in ArrayCommand are handled alike: ignored
    or clamped."""
    position_unit: Literal["hundred_degrees", "radian", "degree", "tenth_degree"] | None
    """Meaning of position 1.0 on the bus. The tables print "0.001/0.1°": 0.001 stands for 0.1°, so 1.0 is 100°,
    and Futaba's program sends and displays 100° per unit."""
    pwm_rows: Literal["zero", "empty", "silent"] | None
    """Response of 0x34 to 0x37 on a model without PWM input, where section 3.1 prints 0/0/0. Futaba's program
    requests them on every model and waits indefinitely for a register without a response."""
    reserved: Literal["empty", "zero"] | None
    """Response of a reserved register. The list gives it the default 0 but no access. A write has no effect in
    either case."""
    save_opcode_restarts: bool | None
    """Whether the opcode SAVE restarts the servo. Section 4.11 states this for 0x12; both write the same ROM."""
    soft_start_shows: Literal["temporary", "stored"] | None
    """What 0x25 and 0x3A to 0x3D read (and a ROM write stores) during soft start. 4.14 says these parameters are
    changed temporarily and restored afterwards."""
    timeout_changes: Literal["output_on", "any_output"] | None
    """Whether the action of 0x26 also replaces OFF or BRAKE in 0x20, so that a brake is released after 0x27. 4.19
    names no exception and counts 0x20 among the commands; but 4.13 says in the same words that OFF remains
    whatever is commanded, and a timeout that brakes or frees a motor without output protects nothing."""
    timeout_from: Literal["power_on", "first_command"] | None
    """When the timeout of 0x27 starts. 4.14 lists the timeout among the events that end soft start, but every
    command ends it, too: so the timeout must run without a command, from power-on. With factory settings, a
    servo without commands turns torque off after 1,000 ms. 4.19 alone could mean that it starts with the
    first command."""
    write_only: Literal["empty", "zero"] | None
    """Response to reading 0x10 to 0x12. Their access is W, so a read fails."""


class SimChange(TypedDict, total=False):
    """Changes to a simulated servo, all or nothing. Omitted fields stay unchanged."""

    behaviour: SimBehaviour | None
    """Choices to make, by name."""
    drop_responses_pct: float | None
    """Share of responses that are lost, %."""
    external_angle_deg: float | None
    """Turn the horn manually until 0x08 reads this angle, °. Requires torque off."""
    faults: dict[str, bool] | None
    """Fault bits to set or clear, by key. Bits that report a restart cause one."""
    load_inertia: float | None
    """Inertia on the horn, as a multiple of the servo's own inertia at the horn."""
    load_pct: float | None
    """Constant torque on the horn, % of stall torque. Positive pushes clockwise."""
    mute: bool | None
    """No responses and no broadcasts."""
    plant: PlantConstants | None
    """All constants of the horn; omitted ones get their defaults. `load_pct` and `load_inertia` above are applied
    to it."""
    position_unit: PositionUnit | None
    """Unit of position 1.0 in its broadcasts."""
    power: SimPower | None
    """Supply."""
    pwm_us: float | None
    """Pulse width at the PWM input, µs. Null removes the signal."""
    refuse_keys: list[str] | None
    """Keys of parameters that the servo refuses to read and write."""
    response_delay_s: float | None
    """Delay of every response, s."""
    restart_delay_s: float | None
    """Time a restart takes, s."""
    sensor_error: float | None
    """Error of the temperature and supply sensors, -1 to 1 of ±5 °C and ±0.5 V."""
    software_update: bool | None
    """Reports a software update in progress."""
    temperature_c: float | None
    """Ambient temperature, °C."""
    voltage_v: float | None
    """Supply voltage, V."""


class SimChaos(TypedDict):
    """Faults injected at random, the same for the same seed and the same servos."""

    active: int
    """Number of injections in effect."""
    injected: int
    """Number of injections since the last start, of which 10000 are listed."""
    interval_s: float | None
    """Mean time between two injections, s. Null if none are injected."""
    kinds: list[
        Literal[
            "power_cut",
            "undervoltage",
            "restart",
            "rom_lost",
            "slow_start",
            "mute",
            "lost_responses",
            "late_responses",
            "refused_rows",
            "fault_bit",
            "load",
            "heat",
            "frame_loss",
            "corrupted_frames",
        ]
    ]
    """Kinds of faults."""
    running: bool
    """Faults are being injected."""
    seed: int | None
    """Seed. Null if none are injected."""


class SimClock(TypedDict):
    """Clock of the server: real time, or virtual time started with `--speed`."""

    actual_speed: float
    """Speed reached over the last second or more."""
    elapsed_s: float
    """Time since the start of the server, s, in its own time."""
    now: float
    """Present time of the server, seconds since 1970 UTC."""
    speed: SimSpeed
    """Highest speed relative to real time; max for as fast as possible."""
    virtual: bool
    """Virtual time. Otherwise the speed is 1 and cannot be changed."""


class SimInjection(TypedDict):
    """A fault that was injected."""

    active: bool
    """It is in effect."""
    at: float
    """Start, seconds since 1970 UTC."""
    kind: Literal[
        "power_cut",
        "undervoltage",
        "restart",
        "rom_lost",
        "slow_start",
        "mute",
        "lost_responses",
        "late_responses",
        "refused_rows",
        "fault_bit",
        "load",
        "heat",
        "frame_loss",
        "corrupted_frames",
    ]
    """Kind of fault."""
    number: int
    """Number in the sequence of the seed."""
    uid: str | None
    """Servo. Null for the bus."""
    until: float
    """End, seconds since 1970 UTC; planned while it is active."""
    values: dict[str, str | float]
    """What was set, such as `load_pct`."""


class SimOutput(TypedDict):
    """One output of the simulated autopilot."""

    demand: float
    """Present demand, -1 to 1."""
    high_deg: float
    """Angle at demand 1, °."""
    low_deg: float
    """Angle at demand -1, °."""
    neutral_deg: float
    """Angle at demand 0, °."""
    output: int
    """Output number, from 1."""
    reversed: bool
    """A positive demand turns towards `low_deg`."""
    sent: bool
    """ArrayCommand has an entry for it."""
    servo_id: int
    """Actuator ID in ArrayCommand: the servo ID it commands."""


class SimOutputChange(TypedDict, total=False):
    """Changes to one output. Omitted fields stay unchanged."""

    demand: float | None
    """Demand, -1 to 1."""
    high_deg: float | None
    """Angle at 1, °."""
    low_deg: float | None
    """Angle at -1, °."""
    neutral_deg: float | None
    """Angle at 0, °."""
    output: Required[int]
    """Output number, from 1."""
    reversed: bool | None
    """A positive demand turns towards `low_deg`."""
    sent: bool | None
    """ArrayCommand has an entry for it."""


class SimServo(TypedDict):
    """A simulated servo and its conditions."""

    angle_deg: float
    """Horn angle from its notch with all turns counted, °. Positive is clockwise."""
    behaviour: Behaviour
    """Choices where the specification is silent, by name."""
    drop_responses_pct: float
    """Share of responses that are lost, %."""
    faults: list[str]
    """Keys of the fault bits that are set."""
    firmware: str
    """Firmware version, such as `1.300`."""
    load_inertia: float
    """Inertia on the horn, as a multiple of the servo's own inertia."""
    load_pct: float
    """Torque on the horn, % of stall torque. Positive pushes clockwise."""
    model: str
    """Model, such as `BLA21-06U-A0`."""
    mute: bool
    """No responses and no broadcasts."""
    node_id: int | None
    """Node ID. Null while it has none."""
    output: Literal["on", "off", "brake"]
    """Motor output after timeout and protection."""
    position_unit: PositionUnit
    """Unit of position 1.0 in its broadcasts."""
    power: SimPower
    """Supply."""
    pwm_us: float | None
    """Pulse width at the PWM input, µs. Null without a signal."""
    refuse_keys: list[str]
    """Keys of parameters that the servo refuses to read and write."""
    response_delay_s: float
    """Delay of every response, s."""
    restart_delay_s: float
    """Time a restart takes, s."""
    sensor_error: float
    """Error of the temperature and supply sensors, -1 to 1 of ±5 °C and ±0.5 V."""
    serial: str
    """Serial number: model number, dash, product number, such as `61-466861`."""
    servo_id: int
    """Servo ID (0x45)."""
    soft_starting: bool
    """Soft start: moves slowly to its first target."""
    software_update: bool
    """Reports a software update in progress."""
    speed_rpm: float
    """Speed of the horn, rpm. Positive is clockwise."""
    stage: Literal["off", "starting", "running", "saving"]
    """Operating state."""
    starts: int
    """Number of starts."""
    story: str
    """Purpose in the simulation, one sentence. Empty for a plain servo."""
    temperature_c: float
    """Ambient temperature, °C."""
    uid: str
    """Unique ID, 32 lower-case hex digits."""
    voltage_v: float
    """Supply voltage without load, V."""


class SimTruth(TypedDict):
    """What a sensor of the servo cannot show: true constants and state of the simulated plant."""

    angle_deg: float
    """Angle as the servo reports it, with origin, reverse and turns, without noise, °."""
    faults: list[str]
    """Keys of the fault bits that are set."""
    friction_factor: float
    """Friction relative to that of `plant`: it grows with motion."""
    horn_deg: float
    """Horn angle from its notch with all turns counted, °. Positive is clockwise."""
    motor_deg: float
    """Motor angle at the horn, °. It differs by up to half the backlash."""
    moved_s: float
    """Time in motion since it was added, s."""
    output: Literal["on", "off", "brake"]
    """Motor output after timeout and protection."""
    plant: PlantConstants
    """Constants as delivered, without wear."""
    ram: dict[str, SimValue]
    """Values in use of writable parameters, by key, in the units of the API. Null: inactive."""
    rom: dict[str, SimValue]
    """Values in ROM, by key, in the units of the API."""
    rom_sound: bool
    """Whether ROM can be read. If not, the next start uses default values."""
    speed_rpm: float
    """Speed of the motor at the horn, rpm. Positive is clockwise."""
    supply_v: float
    """Supply at the motor, without error of the sensor, V."""
    temperature_c: float
    """Temperature of the board, without error of the sensor, °C."""
    torque_pct: float
    """Torque of the motor, % of stall torque. Positive is clockwise."""
    uid: str
    """Unique ID, 32 lower-case hex digits."""


class SiteBench(TypedDict):
    """A bench of the site, in the condition that its server last reported."""

    bus: str | None
    """Address of its bus. Null without one."""
    bus_load_pct: float | None
    """Bus load, %. Null without a bus."""
    bus_state: str
    """State of its bus, as in `GET /bus`."""
    faults: int
    """Number of its online servos with a warning or failure."""
    holder: str | None
    """Holders of motion control, separated by commas. Null if free."""
    host: str
    """Name of the computer of its server."""
    is_this: bool
    """The bench of this server."""
    last_contact: float
    """Last contact, seconds since 1970 UTC."""
    name: str
    """Name of the bench."""
    role: ConnectionRoleName | None
    """Connection role. Null without a bus."""
    servos_online: int
    """Number of servos on its bus."""
    servos_total: int
    """Number of servos in the inventory that were last there."""
    since: float | None
    """Start of its server, seconds since 1970 UTC. Null if unknown."""
    state: SiteBenchState
    """State of its server."""
    torque_stopped: bool
    """Stop is latched."""
    url: str | None
    """Address of its page. Null if unknown."""
    version: str
    """Version of hornbill."""


class Snapshot(TypedDict):
    """Values of a servo at one time."""

    at: float
    """Time of the snapshot, seconds since 1970 UTC."""
    automatic: bool
    """Taken automatically before a change."""
    by: str
    """Client that took it."""
    firmware: str | None
    """Firmware version, such as `1.300`. Null if unknown."""
    id: int
    """ID, as used in paths."""
    model: str | None
    """Model, such as `BLA21-06U-A0`. Null if unknown."""
    reason: str
    """Reason for the snapshot."""
    reason_code: ReasonCode | None
    """Code of the reason: `manual`, or the operation that it preceded. Null for a user's own text."""
    reason_params: Params
    rom: dict[str, bool | int | float | str | None]
    """Values known to be in ROM, by key."""
    uid: str
    """Unique ID, 32 lower-case hex digits."""
    values: dict[str, bool | int | float | str | None]
    """Values in RAM, by key."""


class StepMetrics(TypedDict):
    """Metrics of one step. All times ± `sample_s`. Null if not reached. `hunting_hz` is also measured at the end
    of a step that never settles because the horn oscillates. It is null with fewer than 100 samples per
    second."""

    crossing_s: float | None
    """Time until the target is first reached, s."""
    delay_s: float | None
    """Time until the horn starts to move, s."""
    hunting: Literal["none", "slight", "hunting"]
    """Oscillation after settling."""
    hunting_hz: float | None
    """Oscillation frequency after settling, Hz."""
    hunting_rms_deg: float | None
    """Oscillation amplitude, RMS, °."""
    overshoot_pct: float | None
    """Overshoot, % of the step."""
    peak_deg: float | None
    """Farthest angle, °."""
    peak_speed_rpm: float | None
    """Greatest speed, rpm."""
    rise_s: float | None
    """Time from 10 % to 90 % of the step, s."""
    sample_s: float
    """Longest time between two samples, which is the resolution of all times, s."""
    settling_s: float | None
    """Settling time: until the angle stays within the band, s."""
    steady_state_error_deg: float | None
    """Deviation from the target after settling, °."""


class StepRun(TypedDict):
    """A completed step test with its test conditions."""

    achieved_hz: float
    """Samples per second."""
    at: float
    """Time of the run, seconds since 1970 UTC."""
    band_deg: float
    """Settling band around the target, °."""
    firmware: str | None
    """Firmware version, such as `1.300`. Null if unknown."""
    id: int
    """ID, as used in paths."""
    model: str | None
    """Model, such as `BLA21-06U-A0`. Null if unknown."""
    note: str
    """Note of the user."""
    parameters: dict[str, bool | int | float | str | None]
    """Values of all rows during the run, by key."""
    procedure: str
    """Procedure and its version, such as `step/1`."""
    set_up: SetUp
    """Set-up during the run."""
    step_deg: float
    """Step size, °."""
    steps: list[StepTrace]
    """Steps in order."""
    temperature_c: float | None
    """Servo temperature before the run, °C. Null if unknown."""
    uid: str
    """Unique ID, 32 lower-case hex digits."""
    verdict: Verdict
    voltage_v: float | None
    """Supply voltage at the servo before the run, V. Null if unknown."""
    warnings: list[Note]
    """Conditions that make the metrics less meaningful."""


class StepTrace(TypedDict):
    """One step, with samples from the command on."""

    angle_deg: list[float]
    """Angle of each sample, °."""
    direction: Literal["there", "back"]
    """there: to the target. back: to the start angle."""
    from_deg: float
    """Start angle, °."""
    metrics: StepMetrics
    t: list[float]
    """Time of each sample after the command, s."""
    to_deg: float
    """Target angle, °."""


class Stop(TypedDict):
    """The stop latch."""

    at: float | None
    """Time of the stop, seconds since 1970 UTC. Null while not latched."""
    by: str | None
    """Client that stopped. Null while not latched."""
    latched: bool
    """Motion is blocked until the stop is cleared."""
    mode: StopMode | None
    """Torque off or brake. Null while not latched."""
    nodes: list[StopNode]
    """Nodes that broadcast actuator status and may be servos."""
    reach: Literal["all", "own", "none"]
    """all: every servo (role host, or a guest's stop with `everyone`). own: servos that hornbill commands (role
    guest). none: nothing is sent (role observer)."""
    reaches: list[str]
    """Unique IDs of the online servos that a stop reaches now."""
    reason: str | None
    """Reason: text, or the page's code `stop_button`, `esc_key` or `space_key`. Null while not latched."""
    servos: list[StopServo]
    """One entry per servo."""


class StopNode(TypedDict):
    """Confirmation of a stop by a node that may be a servo but is not identified."""

    confirmed: bool
    """The response to torque off (or brake) was received."""
    ms: float | None
    """Time from the request to the response, ms. Null until then."""
    node_id: int
    """Node ID, 1 to 127."""


class StopServo(TypedDict):
    """Confirmation of a stop by one servo."""

    confirmed: bool
    """The response to torque off (or brake) was received."""
    label: str
    """Nickname. Empty if none."""
    ms: float | None
    """Time from the request to the response, ms. Null until then."""
    uid: str
    """Unique ID, 32 lower-case hex digits."""


class Stream(TypedDict):
    """A stream and its timing."""

    bus_share: float
    """Share of the bus, 0 to 1."""
    ended: str | None
    """Reason why it ended. Null while it runs."""
    ended_code: NoteCode | None
    """Code of `ended`. Null while it runs."""
    ended_params: Params
    holder: str
    """Client with motion control."""
    id: str
    """ID, as used in paths."""
    misses: int
    """Number of slots without a burst in time."""
    moving: bool
    """A servo is still following its profile."""
    rate_hz: float
    """Bursts per second."""
    sent: int
    """Number of bursts sent."""
    type: CommandKind
    """Type of the values: angle (°), speed (rpm) or torque (%)."""
    uids: list[str]
    """Servos that are commanded together, unique IDs."""
    worst_late_ms: float
    """Greatest delay of a burst, ms."""
    worst_skew_ms: float
    """Longest time between the first and last message of a burst, ms."""


class SwitchReading(TypedDict):
    """One parameter as last read from RAM, with its ROM value and this model's limits."""

    address: int
    """Register address."""
    age_s: float | None
    """Time since it was read, s. Null if never read."""
    at: float | None
    """Time of the read, seconds since 1970 UTC. Null if never read."""
    configured: Any
    """Value that a save writes: `value`, or for torque_mode, whose RAM value is session state, the value written
    as configuration, otherwise `rom`."""
    default: Any
    """Default of this model. Null if none or unknown."""
    differs_from_default: bool | None
    """`configured` differs from the default. Null if either is unknown or there is none."""
    in_effect: bool | None
    """false: the row has no effect now. Null if unknown."""
    key: ParameterKey
    """Parameter key."""
    maximum: float | None
    """Maximum of this model. Null if none or unknown."""
    minimum: float | None
    """Minimum of this model. Null if none or unknown."""
    raw: int | None
    """Integer on the wire. Null if never read."""
    rom: Any
    """Value known to be in ROM. Null if unknown."""
    stale: bool
    """The reading is too old or the servo is offline, so the servo may have another value."""
    unit: str
    """Unit of the value. Empty if none."""
    unsaved: bool | None
    """`configured` differs from ROM. Null if either is unknown or ROM lacks the row."""
    value: Any
    """Engineering value or choice key. Null for the dummy value and if never read."""
    why: Why | None
    """`why_not` by code. Null while it has an effect."""
    why_not: str | None
    """Reason why it has no effect now. Null if it has."""


class Telemetry(TypedDict):
    """Telemetry of a servo."""

    budget: float
    """Share of the bus available to polling, 0 to 1."""
    channels: TelemetryChannelByKey
    """Channels by parameter key."""
    subscriptions: list[TelemetryGrant]
    """Subscriptions and their granted rates."""


class TelemetryChannel(TypedDict):
    """Rates of one channel."""

    age_s: float | None
    """Age of the last sample, s. Null if there is none."""
    background_hz: float | None
    """Rate of background polling, Hz. Null if not polled."""
    granted_hz: float | None
    """Granted rate of the subscriptions, Hz. Null without a subscription."""
    marks: list[TelemetryMark]
    """Newest 1000 marks."""
    measured_hz: float
    """Samples per second over the last 5 s, including broadcasts."""


class TelemetryGrant(TypedDict):
    """Rate of one subscription within the bus budget."""

    bus_share: float
    """Share of the bus, 0 to 1."""
    channels: list[str]
    """Parameter keys."""
    expires_in_s: float | None
    """Time until it expires, s. Null if it does not."""
    granted_hz: float
    """Rate within the bus budget, Hz."""
    note: str | None
    """Reason why nothing is polled now. Null if polled."""
    note_code: NoteCode | None
    """Code of the note. Null if polled."""
    note_params: Params
    owner: str
    """Owner of the subscription."""
    requested_hz: float
    """Requested rate, Hz."""


class TelemetryMark(TypedDict):
    """Mark in the samples of a channel."""

    kind: Literal["wrap", "inactive", "gap", "restart"]
    """wrap: the angle wrapped at ±180°; inactive: no value (dummy value); gap: samples are missing; restart: the
    servo restarted."""
    t: float
    """Time on the server's clock, s."""


class TimeoutActionReading(TypedDict):
    """One parameter as last read from RAM, with its ROM value and this model's limits."""

    address: int
    """Register address."""
    age_s: float | None
    """Time since it was read, s. Null if never read."""
    at: float | None
    """Time of the read, seconds since 1970 UTC. Null if never read."""
    configured: TimeoutActionChoice | Any
    """Value that a save writes: `value`, or for torque_mode, whose RAM value is session state, the value written
    as configuration, otherwise `rom`."""
    default: TimeoutActionChoice | Any
    """Default of this model. Null if none or unknown."""
    differs_from_default: bool | None
    """`configured` differs from the default. Null if either is unknown or there is none."""
    in_effect: bool | None
    """false: the row has no effect now. Null if unknown."""
    key: ParameterKey
    """Parameter key."""
    maximum: float | None
    """Maximum of this model. Null if none or unknown."""
    minimum: float | None
    """Minimum of this model. Null if none or unknown."""
    raw: int | None
    """Integer on the wire. Null if never read."""
    rom: TimeoutActionChoice | Any
    """Value known to be in ROM. Null if unknown."""
    stale: bool
    """The reading is too old or the servo is offline, so the servo may have another value."""
    unit: str
    """Unit of the value. Empty if none."""
    unsaved: bool | None
    """`configured` differs from ROM. Null if either is unknown or ROM lacks the row."""
    value: TimeoutActionChoice | Any
    """Engineering value or choice key. Null for the dummy value and if never read."""
    why: Why | None
    """`why_not` by code. Null while it has an effect."""
    why_not: str | None
    """Reason why it has no effect now. Null if it has."""


class TorqueModeReading(TypedDict):
    """One parameter as last read from RAM, with its ROM value and this model's limits."""

    address: int
    """Register address."""
    age_s: float | None
    """Time since it was read, s. Null if never read."""
    at: float | None
    """Time of the read, seconds since 1970 UTC. Null if never read."""
    configured: TorqueModeChoice | Any
    """Value that a save writes: `value`, or for torque_mode, whose RAM value is session state, the value written
    as configuration, otherwise `rom`."""
    default: TorqueModeChoice | Any
    """Default of this model. Null if none or unknown."""
    differs_from_default: bool | None
    """`configured` differs from the default. Null if either is unknown or there is none."""
    in_effect: bool | None
    """false: the row has no effect now. Null if unknown."""
    key: ParameterKey
    """Parameter key."""
    maximum: float | None
    """Maximum of this model. Null if none or unknown."""
    minimum: float | None
    """Minimum of this model. Null if none or unknown."""
    raw: int | None
    """Integer on the wire. Null if never read."""
    rom: TorqueModeChoice | Any
    """Value known to be in ROM. Null if unknown."""
    stale: bool
    """The reading is too old or the servo is offline, so the servo may have another value."""
    unit: str
    """Unit of the value. Empty if none."""
    unsaved: bool | None
    """`configured` differs from ROM. Null if either is unknown or ROM lacks the row."""
    value: TorqueModeChoice | Any
    """Engineering value or choice key. Null for the dummy value and if never read."""
    why: Why | None
    """`why_not` by code. Null while it has an effect."""
    why_not: str | None
    """Reason why it has no effect now. Null if it has."""


class TravelPoint(TypedDict):
    """Load and friction at one angle of the travel."""

    angle_deg: float
    """Angle, °."""
    binding: bool
    """Friction here is at least 5 % of stall torque above that of the travel."""
    friction_pct: float
    """Friction, % of stall torque."""
    load_pct: float
    """Load, % of stall torque. Positive pushes clockwise."""


class TreatedAs(TypedDict):
    """Known model and firmware assumed for a servo that the tables do not contain."""

    firmware: str | None
    """Firmware to assume. Null if the firmware is known."""
    model: str | None
    """Model to assume. Null if the model is known."""


class Tuning(TypedDict):
    """What this server can compute, and the thresholds of its verdicts."""

    available: bool
    """The package is installed."""
    install: str | None
    """Command that installs it. Null if installed."""
    package: str
    """Python package that identification and Improve require."""
    thresholds: list[VerdictThreshold]
    """Thresholds of verdicts."""


class UniqueNumber(TypedDict):
    """A number unique to each servo, and the suggested range (raw). 0 means "none yet" and need not be unique."""

    highest: int
    """Highest suggested number."""
    lowest: int
    """Lowest suggested number."""


class UnitWhen(TypedDict):
    """Another unit while `parameter` is `raw` (0x36 follows 0x37, section 4.30)."""

    parameter: str
    """Key of the row that decides."""
    per_unit: int
    """Raw steps per unit."""
    raw: int
    """Value of that row for this unit, raw."""
    unit: str
    """Unit of the value. Empty if none."""


class Verdict(TypedDict):
    """What a run shows, in one sentence. Computed on reading, from the thresholds in `docs/explanation/tuning.md`."""

    advice: Note | None
    """What to try next. Null if nothing."""
    code: VerdictCode
    """Code for programs."""
    level: Level
    """ok: nothing to improve. notice: works, with a peculiarity. warning: does not work well. failure: nothing was
    measured."""
    params: Params
    text: str
    """One sentence for users, with the decisive figures."""


class VerdictThreshold(TypedDict):
    """A figure that decides between two verdicts."""

    decides: str
    """What it decides."""
    name: str
    """Name, as in the documentation."""
    unit: str
    """Unit."""
    value: float
    """Value, in `unit`."""


class Verification(TypedDict):
    """State of the live verification."""

    hold_s: float
    """Duration of a step, s."""
    left_s: float | None
    """Time left of the step, s. Null without a step."""
    output: int | None
    """Output of the step. Null for all."""
    program: Program
    """Autopilot of the plan."""
    rows: list[VerifyRow]
    """Outputs of the plan."""
    step: Literal["neutral", "positive"] | None
    """Step in progress. Null if none."""


class VerifyRow(TypedDict):
    """One output: what was exported, and what is on the bus."""

    held_deg: float | None
    """Commanded angle while its control was held, °. Null if not yet."""
    high_deg: float
    """Exported clockwise end, °."""
    label: str
    """Name of the servo. Empty if none."""
    last_deg: float | None
    """Last commanded angle, °. Null if none."""
    low_deg: float
    """Exported counterclockwise end, °."""
    neutral_deg: float
    """Exported neutral, °."""
    output: int
    """Output number."""
    positive_deg: float
    """Exported end of a positive demand, °."""
    result: Literal[
        "matches", "reversed", "swapped", "missing", "throw_too_small", "throw_too_large", "wrong_type", "not_moved"
    ]
    """matches: within 0.5° at the positive end. reversed: moved to the other end. swapped: another output moved.
    missing: ArrayCommand has no entry for it. throw_too_small, throw_too_large: the end differs.
    wrong_type: not UNITLESS. not_moved: not moved enough yet."""
    seen_high_deg: float | None
    """Highest commanded angle so far, °. Null if none."""
    seen_low_deg: float | None
    """Lowest commanded angle so far, °. Null if none."""
    servo_id: int
    """Servo ID it commands."""
    swapped_with: int | None
    """Output that moved instead. Null unless swapped."""


class Why(TypedDict):
    """A reason as a code, for programs and translations."""

    code: str
    """Name of the reason."""
    params: dict[str, str]
    """Values in the sentence. `parameter` is the row that decides."""


Advice: TypeAlias = Literal[
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
]
AllocatorChoice: TypeAlias = Literal["on", "off", "force"]
CautionCode: TypeAlias = Literal[
    "turns", "turn_count", "continuous_rotation", "below_minimum", "timeout_hold", "pwm", "timeout_too_short"
]
ChangeOutcome: TypeAlias = Literal["applied", "rolled_back", "planned"]
CommandKind: TypeAlias = Literal["angle", "speed", "torque"]
ConnectionRoleName: TypeAlias = Literal["host", "guest", "observer"]
EventCode: TypeAlias = Literal[
    "connected",
    "disconnected",
    "bus_lost",
    "bus_trouble",
    "bus_back",
    "sample_point",
    "allocator_mode",
    "allocated",
    "node_ids_freed",
    "node_id_recycled",
    "no_node_id",
    "second_allocator",
    "second_allocator_gone",
    "own_node_id",
    "own_node_id_alone",
    "ready",
    "offline",
    "restarted",
    "fault",
    "fault_cleared",
    "hunting",
    "hunting_ended",
    "saturated",
    "saturated_ended",
    "turns_lost",
    "drift",
    "ram_values_lost",
    "position_unit",
    "not_rolled_back",
    "not_restored",
    "restored_later",
    "lease_requested",
    "lease_withdrawn",
    "lease_refused",
    "lease_passed",
    "lease_forced",
    "lease_ended",
    "hold_ended",
    "move_ended",
    "stream_ended",
    "command_ended",
    "commanded_elsewhere",
    "command_lost",
    "motion_yielded",
    "stopped",
    "stopped_late",
    "stop_cleared",
    "no_response",
    "torque_off",
    "recording_written",
    "recording_failed",
    "recordings_deleted",
    "log_started",
    "log_stopped",
    "log_full",
    "log_failed",
    "store_failed",
    "bench_taken",
]
EvidenceCode: TypeAlias = Literal[
    "problem",
    "interrupted",
    "rows_read",
    "snapshot_taken",
    "snapshot_known",
    "snapshot_failed",
    "sent",
    "requested",
    "silent",
    "restarted",
    "restarted_on_request",
    "back_on_node",
    "no_soft_start",
    "soft_start_over",
    "soft_start_aborted",
    "read_back",
    "all_rows_read",
    "torque_off",
    "erased",
    "rows_differ",
    "nothing_differs",
    "rows_written",
    "saved_by_job",
    "rows_verified",
    "at_rest",
    "not_limited",
    "limited",
    "wiggled",
    "angle_unknown",
    "returned",
    "restored",
    "test_conditions",
    "samples",
    "run_stored",
    "response_conditions",
    "response_measured",
    "response_stored",
    "improve_conditions",
    "baseline_measured",
    "horn_identified",
    "gains_found",
    "gains_measured",
    "nothing_better",
    "gains_kept",
    "gains_restored",
    "mechanics_conditions",
    "mechanics_measured",
    "travel_swept",
    "rows_restored",
    "mechanics_stored",
    "planned",
    "written",
    "saved",
    "save_not_needed",
    "identified",
    "values_verified",
    "values_still_verified",
    "servo_id_parked",
    "servo_id_restored",
    "servo_id_lost",
    "node_id_parked",
    "failed_before",
    "job_ended",
    "values_refused",
    "other_refused",
    "other_failed",
    "latch_cleared",
    "not_latched",
    "held",
    "plan_checked",
    "plan_step",
    "torque_off_pending",
]
Excitation: TypeAlias = Literal["chirp", "multisine"]
FaultLevel: TypeAlias = Literal["notification", "warning", "failure"]
FindingCode: TypeAlias = Literal[
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
]
Goal: TypeAlias = Literal["calm", "fast", "stiff"]
HealthCode: TypeAlias = Literal["ok", "warning", "error", "critical"]
JobState: TypeAlias = Literal["queued", "running", "succeeded", "failed", "cancelled"]
Level: TypeAlias = Literal["ok", "notice", "warning", "failure"]
LogFormat: TypeAlias = Literal["candump", "asc", "blf", "csv"]
"""Formats of a log."""
MarkReason: TypeAlias = Literal["failure", "stop", "lost", "bus_lost", "manual"]
MotionCode: TypeAlias = Literal["turns", "turn_count"]
Mounting: TypeAlias = Literal["bench", "vice", "vehicle", "other"]
NoteCode: TypeAlias = Literal[
    "problem",
    "text",
    "heard",
    "not_in_servo",
    "side_unknown",
    "identity_row",
    "torque_row",
    "torque_never_on",
    "too_many_dots",
    "invalid_syntax",
    "nested_too_deeply",
    "not_an_object",
    "not_a_table",
    "too_many_entries",
    "values_missing",
    "unknown_field",
    "not_text",
    "too_long",
    "lone_surrogate",
    "other_tables",
    "unit_not_text",
    "unit_without_value",
    "pin_unchanged",
    "pin_at_restart",
    "pin_after_fixed",
    "id_freed",
    "id_changes_at_restart",
    "no_status",
    "this_server",
    "another_hornbill",
    "requesting_id",
    "no_model_number",
    "no_parameters",
    "no_info",
    "identity_not_received",
    "not_pollable_yet",
    "polled_when_ready",
    "not_polled_as_observer",
    "log_limit",
    "disk_slow",
    "disk_full",
    "write_failed",
    "unit_unchecked",
    "unit_agreed",
    "unit_changed",
    "unit_none_fits",
    "unit_forced",
    "reason",
    "stop_reason",
    "stop_of",
    "stop_confirmed",
    "lease_taken",
    "lease_ended",
    "profile_stored",
    "profile_replaced",
    "profile_deleted",
    "ram_only",
    "servo_id_zero",
    "login_from",
    "servo_forgotten",
    "not_seen_for",
    "commissioned",
    "improved",
    "not_better",
    "ended_by_request",
    "server_shutdown",
    "smoothing_on",
    "limit_reached",
    "limit_unknown",
    "other_servo",
    "other_set_up",
    "other_procedure",
    "other_step",
    "try_check_free",
    "try_lower_boost",
    "try_lower_p",
    "try_higher_p",
    "try_supply",
    "try_smoothing_off",
    "try_smaller_step",
    "try_narrow_deadband",
    "try_raise_torque",
    "try_longer",
    "try_check_bus",
    "try_larger_amplitude",
    "deadband_dependence",
    "saturation_dependence",
    "unknowable_loaded_backlash",
    "unknowable_elasticity",
    "unknowable_torque",
    "unknowable_resolution",
    "gear_on_one_side",
    "no_stop_in_range",
    "too_little_torque",
    "too_few_samples",
]
ParameterKey: TypeAlias = Literal[
    "command_angle",
    "command_speed",
    "command_torque",
    "current_angle",
    "current_speed",
    "current_torque",
    "current_temperature",
    "current_voltage",
    "fault_overview",
    "fault_notification",
    "fault_warning",
    "fault_failure",
    "torque_mode",
    "soft_start",
    "smoothing",
    "reverse",
    "extended_angle",
    "speed_torque_control",
    "timeout_action",
    "timeout_time",
    "overcurrent_limit",
    "angle_p_gain",
    "angle_d_gain",
    "angle_dead_band",
    "angle_boost",
    "speed_p_gain",
    "speed_i_gain",
    "speed_dead_band",
    "speed_i_limit",
    "pwm_neutral",
    "pwm_range",
    "pwm_output_range",
    "pwm_mode",
    "angle_limit_cw",
    "angle_limit_ccw",
    "speed_limit_cw",
    "speed_limit_ccw",
    "torque_limit_cw",
    "torque_limit_ccw",
    "temperature_limit_upper",
    "temperature_limit_lower",
    "voltage_limit_upper",
    "voltage_limit_lower",
    "origin",
    "servo_id",
    "node_id",
    "model_number",
    "product_number",
    "firmware_version",
    "hardware_version",
    "production_year",
    "production_month",
    "production_day",
    "production_hour",
    "production_minute",
]
Params: TypeAlias = dict[str, str | int | float | bool | list[str | int | float]]
"""Values in the text, by name with unit. Unknown values are omitted."""
PartName: TypeAlias = Literal["store", "disk", "bus", "allocator", "view", "loop"]
PartState: TypeAlias = Literal["ok", "degraded", "failed", "off"]
PositionUnit: TypeAlias = Literal["hundred_degrees", "radian", "degree", "tenth_degree"]
Program: TypeAlias = Literal["ardupilot", "px4"]
PwmModeChoice: TypeAlias = Literal["angle", "speed"]
Quantity: TypeAlias = Literal[
    "inertia",
    "breakaway",
    "coulomb",
    "viscous",
    "backlash_deg",
    "torque_lag_s",
    "load_pct",
    "supply_ohm",
    "sensor_noise_deg",
    "deadband_deg",
    "reversal_deg",
    "repeatability_deg",
    "top_speed_rpm",
    "stop_cw_deg",
    "stop_ccw_deg",
]
ReadingByKey: TypeAlias = dict[str, Reading]
ReasonCode: TypeAlias = Literal[
    "manual", "saving", "factory_reset", "drift_undone", "change", "commissioning", "matrix", "profile", "restore"
]
RefusalCode: TypeAlias = Literal["table_failed", "pinned_id_in_use", "all_taken"]
SimPower: TypeAlias = Literal["off", "on"]
SimSpeed: TypeAlias = Literal["max"] | float
SimValue: TypeAlias = bool | int | float | str | None
SiteBenchState: TypeAlias = Literal["online", "no_contact", "stopped"]
StepCode: TypeAlias = Literal[
    "check",
    "snapshot",
    "write",
    "silence",
    "restart",
    "back",
    "soft_start",
    "read_back",
    "request",
    "torque_off",
    "erase",
    "read",
    "identity",
    "rows",
    "save",
    "verify",
    "limit",
    "wiggle",
    "return",
    "restore",
    "measure",
    "evaluate",
    "deadband",
    "repeatability",
    "speed",
    "friction",
    "travel",
    "end_stops",
    "baseline",
    "identify",
    "search",
    "confirm",
    "finish",
    "improve",
    "plan",
    "park_servo_id",
    "park_node_id",
    "clear",
    "torque_on",
    "move",
    "torque",
    "wait",
]
StopMode: TypeAlias = Literal["off", "brake"]
TelemetryChannelByKey: TypeAlias = dict[str, TelemetryChannel]
TimeoutActionChoice: TypeAlias = Literal["hold", "off", "brake"]
TorqueModeChoice: TypeAlias = Literal["on", "off", "brake"]
VerdictCode: TypeAlias = Literal[
    "settles",
    "did_not_move",
    "smoothing_measured",
    "hunts",
    "supply_limited",
    "limit_reached",
    "off_target",
    "rings",
    "overshoots",
    "slow",
    "not_settled",
    "not_reliable",
    "resonant",
    "low_margin",
    "amplitude_dependent",
    "follows",
]
