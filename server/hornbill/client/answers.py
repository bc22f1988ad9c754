"""Owns the types of what the API answers. Made from its document by `make generate`."""

from __future__ import annotations

from typing import Any, Literal, TypedDict


class AllocatorState(TypedDict):
    """What the node-id allocator is doing."""

    free: int
    """node ids that can still be given"""
    granted: int
    mode: Literal["on", "off", "insist"]
    """what was chosen; insist answers beside another allocator"""
    pending: int
    rival_node_id: int | None
    """another allocator that answers on this bus"""
    state: Literal["on", "off", "standing_down"]


class AskedFor(TypedDict):
    """Somebody asks the holder for motion control; the lease passes when `expires_in_s` is over, unless refused."""

    by: str
    expires_in_s: float
    id: str
    """what to refuse it by"""
    reason: str


class BurstPart(TypedDict):
    """What one servo was told: the value it really gets, as a 16-bit float holds it."""

    clamped: bool
    uid: str
    """unique id, 32 lower-case hex digits"""
    value: float


class BurstSent(TypedDict):
    """A burst that has left. `start_skew_s`: between the first and the last message of it."""

    commands: list[BurstPart]
    messages: int
    sent_at: float
    start_skew_s: float
    warnings: list[str]


class Bus(TypedDict):
    """The bus as the adapter and the counters show it."""

    address: str | None
    allocator: AllocatorState | None
    bitrate: int | None
    bus_offs: int
    error_frames: int
    """errors seen on the wire, whoever sent"""
    errors: int
    ignored: int
    """standard, remote and CAN FD frames: not DroneCAN on classic CAN"""
    load_cap_pct: float
    """load that polling keeps within, the budget of the bus"""
    load_pct: float | None
    reopened: int
    """how often it was opened again by itself"""
    retry_in_s: float | None
    """when it is opened again by itself; null while it works"""
    rx_dropped: int
    """frames the adapter brought that we could not take"""
    rx_fps: float
    rx_frames: int
    sample_point: float | None
    """0..1, null where the adapter does not tell"""
    state: Literal["disconnected", "connecting", "active", "passive", "bus_off", "lost"]
    trouble: str | None
    """what is wrong with the adapter and what helps; null while it works"""
    tx_fps: float
    tx_frames: int
    unacknowledged: int
    """our transmissions nobody acknowledged"""


class Candidate(TypedDict):
    """A servo that looks new (servo id 0, no label), and the servo id to give it: null when none is free."""

    servo: Servo
    servo_id: int | None


class Candidates(TypedDict):
    """Servos to commission, in the order of their serials, and nodes that still wait for a node id."""

    pending: list[PendingAllocation]
    servos: list[Candidate]


class Caution(TypedDict):
    """Something to know before a command is sent."""

    confirm: Literal["turns", "turn_count"] | None
    """the word without which it is not sent; null: only said"""
    level: Literal["warning", "failure"]
    """failure: it may go on for ever"""
    text: str


class Change(TypedDict):
    """What became of one key of a PATCH."""

    after: bool | int | float | str | None
    before: bool | int | float | str | None
    key: str
    requested: bool | int | float | str | None
    verdict: Literal["planned", "applied", "clamped", "refused", "no_answer", "unchanged", "rolled_back"]


class Choice(TypedDict):
    """One named value of a register that is a choice."""

    key: str
    label: str
    raw: int


class Commanded(TypedDict):
    """Evidence of a command: when it was sent, and with wait=settled, whether and when it came to rest."""

    angle_deg: float | None
    clamped: bool
    max_deviation_deg: float | None
    """the farthest of them from the target"""
    samples: int | None
    """samples within the band in a row, up to the last one"""
    sent_at: float
    settle_time_s: float | None
    settled: bool | None
    value: float
    warnings: list[str]


class Condition(TypedDict):
    """True while `parameter` reads one of `reads`, or while the last command was one of `last_command`. `absent`
    is what it counts as on a servo whose model or firmware lacks `parameter`."""

    absent: bool
    last_command: list[Literal["angle", "speed", "torque"]]
    parameter: str | None
    reads: list[int]


class Drift(TypedDict):
    """What ROM holds otherwise than we last knew. Empty when nothing does."""

    rows: list[DriftRow]
    uid: str
    """unique id, 32 lower-case hex digits"""


class DriftRow(TypedDict):
    """A row of ROM that changed under us."""

    key: str
    now: bool | int | float | str | None
    """what it was found to hold"""
    proved: bool
    """false: found in RAM of a servo that restarted while nobody watched, so most likely in ROM"""
    was: bool | int | float | str | None
    """what ROM was known to hold"""


class EffectRule(TypedDict):
    """`parameters` have no effect while every condition of `when` holds. `why` completes "No effect now: …";
    `{last_command}` in it is the last command's kind. `why_absent` replaces it when a condition holds
    because the servo lacks the row. The rule is void on a servo that has `unless_row`."""

    inferred: bool
    parameters: list[str]
    section: str
    unless_row: str | None
    when: list[Condition]
    why: str
    why_absent: str


class Fault(TypedDict):
    """One fault bit of one servo, now or in the past (section 4.12)."""

    acknowledged_at: float | None
    acknowledged_by: str | None
    active: bool
    """set, as the servo has just said"""
    advice: str
    bit: int
    count: int
    """how often it came up"""
    first_seen: float
    """seconds since 1970 UTC"""
    group: str
    key: str
    label: str
    last_seen: float
    """seconds since 1970 UTC; when it went, to within a poll"""
    latched: bool
    """active, and known to stay until the servo starts again, whatever its cause does"""
    level: Literal["notification", "warning", "failure"]
    past_event: bool
    """tells of something before the servo's present start, not of a present state"""
    stale: bool
    """set when the servo said so last; whether it still is, is not known now"""


class FaultBit(TypedDict):
    """One documented bit of `parameter`. In the overview, `level` is the level the bit sums up."""

    advice: str
    bit: int
    group: Literal["hardware", "software", "communication", "other"]
    key: str
    label: str
    latching: bool
    level: Literal["notification", "warning", "failure"]
    limit: str | None
    output_off: bool
    parameter: str
    past_event: bool
    pwm_only: bool
    section: str


class FaultWords(TypedDict):
    """The three fault words 0x19, 0x1A and 0x1B as last read; null while unknown (section 4.12)."""

    failure: int | None
    notification: int | None
    warning: int | None


class Finding(TypedDict):
    """One thing the doctor looked at. `ok` only with `all=true`."""

    code: str
    evidence: str
    node_ids: list[int]
    remedy: str | None
    severity: Literal["ok", "notice", "warning", "failure"]
    text: str
    uids: list[str]


class Group(TypedDict):
    """A chapter of the parameter list, as the document divides it (tables 3-1 to 3-11)."""

    description: str
    key: str
    label: str


class Health(TypedDict):
    """The server serves."""

    bus: str
    demo: bool
    status: Literal["ok"]
    uptime_s: float
    version: str


class Imported(TypedDict):
    """The verdict on every line of a file; `profile` is null unless all were ok."""

    lines: list[LineVerdict]
    profile: Profile | None


class Job(TypedDict):
    """Something that takes time."""

    created_at: float
    ended_at: float | None
    error: Problem | None
    id: str
    kind: Literal["save", "restart", "factory_reset", "identify", "profile", "commissioning", "step_test"]
    progress: float
    result: dict[str, Any] | None
    resumable: bool
    """POST …/resume goes on with what it has not done"""
    state: Literal["queued", "running", "succeeded", "failed", "cancelled"]
    step: str | None
    steps: list[JobStep]
    uid: str | None


class JobStep(TypedDict):
    """One step of a job, with its evidence."""

    ended_at: float | None
    evidence: str | None
    name: str
    started_at: float | None
    state: Literal["waiting", "running", "done", "failed", "skipped"]
    text: str
    uid: str | None
    """the servo this step is about, in a job over several"""


class KnownServo(TypedDict):
    """A servo ever seen, on the bus or not; instants in seconds since 1970 UTC."""

    drift: list[str]
    firmware: str | None
    first_seen: float | None
    hardware_version: int | None
    label: str
    last_seen: float | None
    model: str | None
    node_id: int | None
    """last known"""
    online: bool
    production_date: str | None
    rom: dict[str, bool | int | float | str | None]
    """configuration last known to be in ROM"""
    serial: str | None
    servo_id: int | None
    """last known"""
    snapshots: int
    uid: str
    """unique id, 32 lower-case hex digits"""


class Lease(TypedDict):
    """The one writer's lease; renew before it ends, or torque goes off on what it commanded."""

    expires_at: float
    """seconds since 1970 UTC"""
    expires_in_s: float
    holder: str
    id: str
    request: AskedFor | None
    ttl_s: float


class LeaseView(TypedDict):
    """A lease as others see it: without the id that lets one use it."""

    expires_at: float
    expires_in_s: float
    holder: str
    request: AskedFor | None
    ttl_s: float


class LineVerdict(TypedDict):
    """What became of one line of an imported file. `ok`: kept; everything else keeps the whole file out."""

    key: str
    line: int
    """from 1; 0 when the line is not known"""
    text: str
    """what is wrong and what to do; when ok, what is worth knowing"""
    value: bool | int | float | str | None
    verdict: Literal[
        "ok", "unknown", "forbidden", "read_only", "identity", "out_of_range", "invalid", "not_in_this_model"
    ]


class LogFile(TypedDict):
    """A log in the data folder."""

    bytes: int
    modified_at: float
    name: str


class LogState(TypedDict):
    """The log of frames being written, or the last one that was."""

    bytes: int
    dropped: int
    format: Literal["candump", "asc", "blf", "csv"] | None
    frames: int
    limit_bytes: int
    name: str | None
    reason: str | None
    """why it ended, unless it was stopped"""
    started_at: float | None
    """seconds since 1970 UTC"""
    state: Literal["idle", "running", "stopped", "full", "failed"]


class Parameter(TypedDict):
    """One register. `default`, `minimum` and `maximum` are raw; an engineering value is raw / per_unit."""

    access: Literal["rw", "r", "w"]
    action: bool
    """Whether it does something when written and means nothing when read (0x10 to 0x12)."""
    address: int
    advice: str
    after_restart: bool
    choices: list[Choice]
    default: int | None
    description: str
    dummy: bool
    expert: bool
    forbidden: bool
    group: str
    identity: bool
    key: str
    kind: Literal["number", "choice", "switch", "bits"]
    label: str
    maximum: int | None
    minimum: int | None
    name: str
    """The four ASCII characters GetSet knows the register by: `0x2A` (table 2-14)."""
    per_unit: int
    pwm_only: bool
    rom: bool
    """Whether a ROM write keeps it: 0x20 to 0x4F (section 4.11)."""
    section: str
    since: str
    unit: str
    unit_when: UnitWhen | None


class Parameters(TypedDict):
    """Every row this model and firmware has."""

    parameters: dict[str, Reading]
    revision: str


class ParametersPatched(TypedDict):
    """The outcome of a PATCH; with save, the job that saves."""

    changes: list[Change]
    failure: str | None
    """why it was rolled back"""
    job: str | None
    """id of the save job, with save: true"""
    outcome: Literal["applied", "rolled_back", "planned"]
    problem: Problem | None
    """the same for programs: with its code and its facts"""
    revision: str


class PendingAllocation(TypedDict):
    """A node heard asking for an id, and how far it has come."""

    age_s: float
    attempts: int
    refusal: str | None
    stage: int
    """how many of the three parts were heard"""
    uid_part: str
    """what is known of the unique id, in hex"""
    waiting_s: float


class PositionUnitState(TypedDict):
    """What position 1.0 means on a servo, and how that is known."""

    evidence: str
    """how that is known, for people"""
    state: Literal["assumed", "confirmed", "forced", "conflict"]
    """assumed: not measured yet; conflict: Status and 0x08 agree in no unit, or in two"""
    unit: Literal["hundred_degrees", "radian", "degree", "tenth_degree"]


class Problem(TypedDict):
    """application/problem+json: what went wrong, the code to branch on, and what to do."""

    code: str
    detail: str
    status: int
    title: str
    type: str


class Profile(TypedDict):
    """A named set of values, in engineering units."""

    created_at: float
    description: str
    firmware: str | None
    """firmware it was made for, e.g. "1.300"""
    model: str | None
    """model it was made for; null: any"""
    name: str
    schema_revision: str
    """tables it was written with"""
    units: dict[str, str]
    """unit of each number"""
    updated_at: float
    values: dict[str, bool | int | float | str | None]


class Reading(TypedDict):
    """One parameter as last read from RAM, beside what is known of ROM and what this model allows."""

    address: int
    age_s: float | None
    at: float | None
    """when it was read, seconds since 1970 UTC"""
    default: bool | int | float | str | None
    differs_from_default: bool | None
    """RAM beside the model's default; null where that is not known, or there is none"""
    in_effect: bool | None
    """false: has no effect now; null: not known"""
    key: str
    maximum: float | None
    minimum: float | None
    raw: int | None
    """integer on the wire; null while never read"""
    rom: bool | int | float | str | None
    """value known to be in ROM; null when not known"""
    stale: bool
    unit: str
    unsaved: bool | None
    """RAM differs from ROM; null where one is not known, or ROM does not keep the row"""
    value: bool | int | float | str | None
    """engineering value or choice key; null for the dummy and while unknown"""
    why_not: str | None


class RowRange(TypedDict):
    """What one model allows in one row, raw."""

    default: int | None
    maximum: int | None
    minimum: int | None


class SchemaDocument(TypedDict):
    """Every table: rows, models, firmware steps, fault bits, effect rules."""

    effects: list[EffectRule]
    faults: list[FaultBit]
    firmware: list[str]
    groups: list[Group]
    models: list[SchemaModel]
    overview: list[FaultBit]
    parameters: list[Parameter]
    revision: str
    specification: str


class SchemaModel(TypedDict):
    """One servo model and its own numbers; `rows` has every row it offers at its newest firmware."""

    hardware_version: int
    model_number: int
    name: str
    pwm: bool
    rows: dict[str, RowRange]
    series: str
    voltage_class: str


class Servo(TypedDict):
    """One servo, known by its unique id."""

    age_s: float | None
    """age of angle_deg in seconds"""
    angle_deg: float | None
    bus: str | None
    command_deg: float | None
    """angle command as last known; null while inactive"""
    drift: list[str]
    """keys whose ROM somebody else changed; GET …/drift shows from what"""
    faults: FaultWords
    firmware: str | None
    """as in the tables, e.g. "1.300"""
    hardware_version: int | None
    health: Literal["ok", "warning", "error", "critical"] | None
    known_model: bool
    label: str
    """nickname, kept by the server"""
    mode: str | None
    model: str | None
    name: str
    """node name as GetNodeInfo gives it"""
    node_id: int | None
    """present node id 1..127; null while it has none"""
    online: bool
    position_unit: PositionUnitState
    production_date: str | None
    """YYYY-MM-DDTHH:MM, time zone not stated by the servo"""
    pwm: bool | None
    serial: str | None
    """model number, dash, product number"""
    series: str | None
    servo_id: int | None
    """actuator id, parameter 0x45; 0 cannot be addressed by ArrayCommand"""
    state: Literal["identifying", "ready", "soft_start", "saving", "restarting", "updating", "protected", "offline"]
    uid: str
    """unique id, 32 lower-case hex digits"""
    unacknowledged: int
    """warnings and failures that nobody has acknowledged since they came up last"""
    unsaved: list[str]
    """keys whose RAM differs from what is known to be in ROM"""
    uptime_s: int | None


class Snapshot(TypedDict):
    """What a servo held at one instant, in engineering values."""

    at: float
    """seconds since 1970 UTC"""
    automatic: bool
    by: str
    firmware: str | None
    id: int
    model: str | None
    reason: str
    rom: dict[str, bool | int | float | str | None]
    """what was known of ROM, by key"""
    uid: str
    """unique id, 32 lower-case hex digits"""
    values: dict[str, bool | int | float | str | None]
    """RAM, by key"""


class Stop(TypedDict):
    """The stop latch."""

    at: float | None
    by: str | None
    latched: bool
    mode: Literal["off", "brake"] | None
    nodes: list[StopNode]
    """nodes that broadcast an actuator's status and may be servos"""
    reason: str | None
    servos: list[StopServo]


class StopNode(TypedDict):
    """How stop went on a node that may be a servo and has not been identified."""

    confirmed: bool
    ms: float | None
    """from the request to the node's answer"""
    node_id: int


class StopServo(TypedDict):
    """How stop went on one servo."""

    confirmed: bool
    label: str
    ms: float | None
    """from the request to the servo's answer"""
    uid: str
    """unique id, 32 lower-case hex digits"""


class Telemetry(TypedDict):
    """What is polled of a servo, and for whom."""

    budget: float
    """share of the bus all polling may take, 0..1"""
    channels: dict[str, TelemetryChannel]
    wishes: list[TelemetryGrant]


class TelemetryChannel(TypedDict):
    """One channel: how often it is to be polled, and how often it really is."""

    age_s: float | None
    """age of the last sample; null when there never was one"""
    background_hz: float | None
    """polled so often whether wished or not; null when it is not"""
    granted_hz: float | None
    """of what is wished; null when nobody wishes it"""
    marks: list[TelemetryMark]
    """of what is kept, the newest thousand"""
    measured_hz: float
    """samples a second over the last five, broadcast ones included"""


class TelemetryGrant(TypedDict):
    """What the bus budget allows of it."""

    bus_share: float
    """share of the bus this takes, 0..1"""
    channels: list[str]
    expires_in_s: float | None
    """null: stays until it is replaced"""
    granted_hz: float
    note: str | None
    """why nothing is polled now, if nothing is"""
    owner: str
    requested_hz: float


class TelemetryMark(TypedDict):
    """Something to know of a channel at an instant: `t` in seconds on the server's clock."""

    kind: Literal["wrap", "inactive", "gap", "restart"]
    t: float


class UnitWhen(TypedDict):
    """Another unit, in force while `parameter` reads `raw` (0x36 follows 0x37, section 4.30)."""

    parameter: str
    per_unit: int
    raw: int
    unit: str
