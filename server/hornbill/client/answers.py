"""Owns the types of what the API answers. Made from its document by `make generate`."""

from __future__ import annotations

from typing import Any, Literal, TypedDict


class About(TypedDict):
    """What a bundle is of. Times in seconds since 1970 UTC; `utc_offset` turns the writer's own clock into them."""

    bus: BundleBus | None
    """null: none was connected"""
    ended_at: float
    """seconds since 1970 UTC"""
    format: Literal[1]
    """of the bundle"""
    frames: int
    """how many CAN frames"""
    incomplete: list[str]
    """members that were cut because they would have become too large"""
    marks: list[Mark]
    """why it was written, and what happened meanwhile"""
    reason: Literal["failure", "stop", "lost", "bus_lost", "by_hand"]
    """why"""
    schema_revision: str
    """of the parameter tables"""
    servos: list[BundleServo]
    """one by one"""
    started_at: float
    """seconds since 1970 UTC"""
    text: str
    """in a sentence, for people"""
    utc_offset: float
    """add to the writer's own clock for seconds since 1970 UTC"""
    version: str
    """of hornbill"""


class Adapter(TypedDict):
    """Something a bus can be opened on. `address` is what `PUT /bus` takes."""

    address: str
    """as `PUT /bus` takes it"""
    bitrate: int | None
    """bit/s"""
    channel: str
    """of that interface, such as `can0`"""
    interface: str
    """in python-can's words, such as `socketcan`"""
    name: str
    """for people: product, serial number"""
    reason: str | None
    """why it cannot be used now, or what is odd about it; null when all is well"""
    remedy: str | None
    """what to do about it; a command where one helps"""
    sample_point: float | None
    """0 to 1; null: not told"""
    state: Literal["ready", "connected", "down", "wrong_bitrate", "no_permission", "in_use", "no_driver"]
    """how it stands"""
    usable: bool
    """it can be connected now"""


class Allocation(TypedDict):
    """One row of the allocation table."""

    last_seen: float | None
    """seconds since 1970 UTC"""
    node_id: int
    """1 to 127"""
    online: bool
    """heard lately"""
    pinned: bool
    """given by hand, and kept for it"""
    uid: str
    """unique id, 32 lower-case hex digits"""


class AllocationChange(TypedDict):
    """A row as it is now, or as it was before it was forgotten."""

    last_seen: float | None
    """seconds since 1970 UTC"""
    node_id: int
    """1 to 127"""
    note: str
    """when the change takes effect"""
    online: bool
    """heard lately"""
    pinned: bool
    """given by hand, and kept for it"""
    uid: str
    """unique id, 32 lower-case hex digits"""


class Allocations(TypedDict):
    """The allocation table and who is waiting."""

    allocations: list[Allocation]
    """the table, a row a node"""
    free: int
    """ids that could be given to new nodes now"""
    pending: list[PendingAllocation]
    """nodes that ask for an id now"""


class AllocatorState(TypedDict):
    """What the node-id allocator is doing."""

    free: int
    """node ids that can still be given"""
    granted: int
    """ids that are in the table"""
    mode: Literal["on", "off", "insist"]
    """what was chosen; insist answers beside another allocator"""
    pending: int
    """nodes that ask for an id now"""
    rival_node_id: int | None
    """another allocator that answers on this bus"""
    state: Literal["on", "off", "standing_down"]
    """standing_down: another allocator answers"""


class AskedFor(TypedDict):
    """Somebody asks the holder for motion control; the lease passes when `expires_in_s` is over, unless refused."""

    by: str
    """who did it"""
    expires_in_s: float
    """motion control passes then, unless it is refused, s"""
    id: str
    """what to refuse it by"""
    reason: str
    """why"""


class AuditRow(TypedDict):
    """Who did what, with what came of it; values in engineering units."""

    action: str
    """what was done"""
    after: Any
    """what it held afterwards"""
    at: float
    """seconds since 1970 UTC"""
    before: Any
    """what it held before"""
    by: str
    """who did it"""
    detail: str
    """in a sentence"""
    id: int
    """what to name it by in a path"""
    job: str | None
    """id of the job it was part of"""
    key: str | None
    """of the row it was about; null: none"""
    outcome: str
    """how it ended"""
    requested: Any
    """what was asked for"""
    uid: str | None
    """unique id of the servo, 32 hex digits; null: it is about none"""


class BatchOutcome(TypedDict):
    """What became of one servo of a batch; `problem` says why it was rejected or rolled back."""

    changes: list[Change]
    """row by row"""
    job: str | None
    """id of the save job, with save: true"""
    outcome: Literal["applied", "rolled_back", "planned", "rejected", "not_tried"]
    """rejected: nothing was written; not_tried: one before it ended the batch"""
    problem: Problem | None
    """why it was rejected or rolled back; null: it was not"""
    revision: str | None
    """of its values afterwards"""
    uid: str
    """unique id of the servo, 32 hex digits"""


class BatchPatched(TypedDict):
    """Outcomes in the order of the request."""

    servos: list[BatchOutcome]
    """one by one"""


class BatchRead(TypedDict):
    """Parameters × servos."""

    servos: dict[str, BatchServo]
    """by uid"""


class BatchServo(TypedDict):
    """One servo's column of the matrix; `problem` instead of readings where there are none."""

    parameters: dict[str, Reading]
    """readings by key"""
    problem: Problem | None
    """why there are none; null: there are"""
    revision: str | None
    """changes with every value: what If-Match takes"""


class Bundle(TypedDict):
    """A bundle in the data folder. `problem` says why one cannot be read; then little else is known of it."""

    at: float
    """its first mark, seconds since 1970 UTC"""
    bytes: int
    """size, bytes"""
    marks: list[BundleMark]
    """why it was written, and what happened meanwhile"""
    name: str
    """what it is called"""
    problem: str | None
    """why it cannot be told; null: it can"""
    reason: Literal["failure", "stop", "lost", "bus_lost", "by_hand"] | None
    """why"""
    seconds: float | None
    """how long it is, s; null: it cannot be read"""
    text: str
    """in a sentence, for people"""


class BundleBus(TypedDict):
    """The bus that was connected: address as `PUT /bus` takes it, bit/s, our own node id."""

    address: str
    """as `PUT /bus` takes it"""
    bitrate: int
    """bit/s"""
    node_id: int
    """1 to 127"""


class BundleContent(TypedDict):
    """What a page shows of a bundle. Its frames are played: `PUT /bus` with address `bundle:NAME`."""

    about: About
    complete: bool
    """false when there was more telemetry than that"""
    events: list[dict[str, Any]]
    """what happened meanwhile"""
    telemetry: list[Columns]
    """at most 500,000 samples"""
    writes: list[dict[str, str]]
    """what was written meanwhile"""


class BundleMark(TypedDict):
    """A moment for which a bundle was, or will be, written."""

    at: float
    """seconds since 1970 UTC"""
    reason: Literal["failure", "stop", "lost", "bus_lost", "by_hand"]
    """why"""
    text: str
    """in a sentence, for people"""
    uid: str | None
    """unique id of the servo, 32 hex digits; null: it is about none"""


class BundleReading(TypedDict):
    """One register as last read before the first mark; `at` in seconds since 1970 UTC."""

    at: float | None
    """when it was read, seconds since 1970 UTC"""
    raw: int
    """the integer on the wire"""
    unit: str
    """of its value"""
    value: bool | int | float | str | None
    """in engineering units, or the key of a choice"""


class BundleServo(TypedDict):
    """One servo as it was known at the first mark."""

    firmware: int | None
    """version, as `1.300`"""
    hardware_version: int | None
    """as GetNodeInfo gives it"""
    label: str
    """for people"""
    model_number: int | None
    """as the servo says"""
    name: str
    """what it is called"""
    node_id: int | None
    """1 to 127; null: none"""
    production_date: str | None
    """as the servo gives it; null: not known"""
    readings: dict[str, BundleReading]
    """last known of RAM, by key"""
    rom: dict[str, int]
    """last known of ROM, by key"""
    serial_number: int | None
    """as the servo says"""
    state: str
    """how it stands"""
    title: str
    """what people call it"""
    uid: str
    """unique id of the servo, 32 hex digits"""


class BurstPart(TypedDict):
    """What one servo was told: the value it really gets, as a 16-bit float holds it."""

    clamped: bool
    """a limit of the servo was sent in place of what was asked for"""
    uid: str
    """unique id, 32 lower-case hex digits"""
    value: float
    """°, rpm or %, as a 16-bit float holds it"""


class BurstSent(TypedDict):
    """A burst that has left. `start_skew_s`: between the first and the last message of it."""

    commands: list[BurstPart]
    """what each servo was told"""
    messages: int
    """how many ArrayCommands it took"""
    sent_at: float
    """seconds since 1970 UTC"""
    start_skew_s: float
    """between the first and the last of its messages, s"""
    warnings: list[str]
    """what is worth knowing, in sentences"""


class Bus(TypedDict):
    """The bus as the adapter and the counters show it."""

    address: str | None
    """as `PUT /bus` takes it"""
    allocator: AllocatorState | None
    """null where none runs"""
    bitrate: int | None
    """bit/s"""
    bus_offs: int
    """how often the adapter went bus-off"""
    error_frames: int
    """errors seen on the wire, whoever sent"""
    errors: int
    """all that went wrong: error frames, and frames of ours that could not leave"""
    ignored: int
    """standard, remote and CAN FD frames: not DroneCAN on classic CAN"""
    load_cap_pct: float
    """load that polling keeps within, the budget of the bus"""
    load_pct: float | None
    """share of the bus in use, %; null: not known yet"""
    reopened: int
    """how often it was opened again by itself"""
    retry_in_s: float | None
    """when it is opened again by itself; null while it works"""
    rx_dropped: int
    """frames the adapter brought that we could not take"""
    rx_fps: float
    """frames a second that came"""
    rx_frames: int
    """frames that came"""
    sample_point: float | None
    """0..1, null where the adapter does not tell"""
    state: Literal["disconnected", "connecting", "active", "passive", "bus_off", "lost"]
    """how it stands"""
    trouble: str | None
    """what is wrong with the adapter and what helps; null while it works"""
    tx_fps: float
    """frames a second that we sent"""
    tx_frames: int
    """frames that we sent"""
    unacknowledged: int
    """our transmissions nobody acknowledged"""


class Candidate(TypedDict):
    """A servo that looks new (servo id 0, no label), and the servo id to give it: null when none is free."""

    servo: Servo
    servo_id: int | None
    """the next that is free; null: none is"""


class Candidates(TypedDict):
    """Servos to commission, in the order of their serials, and nodes that still wait for a node id."""

    pending: list[PendingAllocation]
    """nodes that still wait for a node id"""
    servos: list[Candidate]
    """one by one"""


class Caution(TypedDict):
    """Something to know before a command is sent."""

    confirm: Literal["turns", "turn_count"] | None
    """the word without which it is not sent; null: only said"""
    level: Literal["warning", "failure"]
    """failure: it may go on for ever"""
    text: str
    """in a sentence, for people"""


class Change(TypedDict):
    """What became of one key of a PATCH."""

    after: bool | int | float | str | None
    """what it holds now, read back"""
    before: bool | int | float | str | None
    """what it held"""
    key: str
    """name of the row, the same everywhere"""
    requested: bool | int | float | str | None
    """what was asked for"""
    verdict: Literal["planned", "applied", "clamped", "refused", "no_answer", "unchanged", "rolled_back"]
    """what became of it"""


class Choice(TypedDict):
    """One named value of a register that is a choice."""

    key: str
    """what a program writes"""
    label: str
    """for people"""
    raw: int
    """the integer on the wire"""


class Columns(TypedDict):
    """The samples of one channel: `t` in seconds since 1970 UTC, `v` in its unit, null for a gap."""

    channel: str
    """key of the parameter"""
    t: list[float]
    """seconds since 1970 UTC"""
    uid: str
    """unique id of the servo, 32 hex digits"""
    v: list[float | None]
    """a value each; null is a gap"""


class Commanded(TypedDict):
    """Evidence of a command: when it was sent, and with wait=settled, whether and when it came to rest."""

    angle_deg: float | None
    """where the horn stands, °; + is clockwise"""
    clamped: bool
    """a limit of the servo was sent in place of what was asked for"""
    max_deviation_deg: float | None
    """the farthest of them from the target"""
    samples: int | None
    """samples within the band in a row, up to the last one"""
    sent_at: float
    """seconds since 1970 UTC"""
    settle_time_s: float | None
    """from sending it until the horn was at rest there, s; null: not waited for, or never"""
    settled: bool | None
    """the horn came to rest there; null: not waited for"""
    value: float
    """what was sent: °, rpm or %"""
    warnings: list[str]
    """what is worth knowing, in sentences"""


class Comparison(TypedDict):
    """Two sides, row by row: `servo:UID`, `rom:UID`, `snapshot:ID`, `profile:NAME`, `default:MODEL[@FIRMWARE]`, …"""

    differences: list[Difference]
    """rows that are not the same"""
    left: str
    """what stands on the left"""
    right: str
    """what stands on the right"""
    same: int
    """rows that both sides are known to hold alike"""


class Condition(TypedDict):
    """True while `parameter` reads one of `reads`, or while the last command was one of `last_command`. `absent`
    is what it counts as on a servo whose model or firmware lacks `parameter`."""

    absent: bool
    """what it counts as on a servo without that row"""
    last_command: list[Literal["angle", "speed", "torque"]]
    """true while the last command was one of these"""
    parameter: str | None
    """the row it looks at; null where it looks at the last command"""
    reads: list[int]
    """true while the row reads one of these, raw"""


class Difference(TypedDict):
    """One row that differs: null is what a side does not have (`*_has` false), or what is not known of it."""

    identity: bool
    """says which servo it is: origin, servo id, node id (0x44 to 0x46)"""
    key: str
    """name of the row, the same everywhere"""
    left: bool | int | float | str | None
    """value on the left"""
    left_has: bool
    """the left side has this row"""
    left_unit: str
    """0x36 follows 0x37, so that the units may differ (section 4.30)"""
    right: bool | int | float | str | None
    """value on the right"""
    right_has: bool
    """the right side has this row"""
    right_unit: str
    """of the value on the right"""


class Drift(TypedDict):
    """What ROM holds otherwise than we last knew. Empty when nothing does."""

    rows: list[DriftRow]
    """those that changed"""
    uid: str
    """unique id, 32 lower-case hex digits"""


class DriftRow(TypedDict):
    """A row of ROM that changed under us."""

    key: str
    """name of the row, the same everywhere"""
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
    """follows from the document without being stated in it"""
    parameters: list[str]
    """they have no effect while every condition holds"""
    section: str
    """of the servo's document"""
    unless_row: str | None
    """the rule is void on a servo that has this row"""
    when: list[Condition]
    """all of these at once"""
    why: str
    """goes on from “No effect now”"""
    why_absent: str
    """in its place where the servo lacks the row"""


class Fault(TypedDict):
    """One fault bit of one servo, now or in the past (section 4.12)."""

    acknowledged_at: float | None
    """when somebody said that they have seen it, seconds since 1970 UTC; null: nobody has"""
    acknowledged_by: str | None
    """who said that they have seen it"""
    active: bool
    """set, as the servo has just said"""
    advice: str
    """what to do about it"""
    bit: int
    """place in its register, from 0"""
    count: int
    """how often it came up"""
    first_seen: float
    """seconds since 1970 UTC"""
    group: str
    """which chapter of its table it stands in"""
    key: str
    """name of the row, the same everywhere"""
    label: str
    """for people"""
    last_seen: float
    """seconds since 1970 UTC; when it went, to within a poll"""
    latched: bool
    """active, and known to stay until the servo starts again, whatever its cause does"""
    level: Literal["notification", "warning", "failure"]
    """how grave it is"""
    past_event: bool
    """tells of something before the servo's present start, not of a present state"""
    stale: bool
    """set when the servo said so last; whether it still is, is not known now"""


class FaultBit(TypedDict):
    """One documented bit of `parameter`. In the overview, `level` is the level the bit sums up."""

    advice: str
    """what to do about it"""
    bit: int
    """place in the 32-bit register, from 0"""
    group: Literal["hardware", "software", "communication", "other"]
    """which chapter of its table it stands in"""
    key: str
    """name of the row, the same everywhere"""
    label: str
    """for people"""
    latching: bool
    """stays set until the servo starts again, whatever its cause does"""
    level: Literal["notification", "warning", "failure"]
    """how grave it is"""
    limit: str | None
    """the row that sets where it begins"""
    output_off: bool
    """the motor has no output while it is set"""
    parameter: str
    """the register it stands in"""
    past_event: bool
    """tells of something before the servo's present start"""
    pwm_only: bool
    """always 0 on a model without PWM input"""
    section: str
    """of the servo's document"""


class FaultWords(TypedDict):
    """The three fault words 0x19, 0x1A and 0x1B as last read; null while unknown (section 4.12)."""

    failure: int | None
    """register of failures, raw; null while unread"""
    notification: int | None
    """register of notifications, raw; null while unread"""
    warning: int | None
    """register of warnings, raw; null while unread"""


class Finding(TypedDict):
    """One thing the doctor looked at. `ok` only with `all=true`."""

    code: str
    """what it is, for programs: it does not change"""
    evidence: str
    """what it was seen by"""
    node_ids: list[int]
    """the nodes it concerns"""
    remedy: str | None
    """what to do about it"""
    severity: Literal["ok", "notice", "warning", "failure"]
    """how grave it is"""
    text: str
    """in a sentence, for people"""
    uids: list[str]
    """unique ids of the servos it concerns"""


class Forecast(TypedDict):
    """What a restart would do to the horn, and what speaks against it."""

    from_deg: float | None
    """where the horn stands, °"""
    moves: bool
    """the horn turns at the start, or may"""
    takes_s: float | None
    """about; at the 30 rpm of soft start (section 4.14)"""
    text: str
    """in a sentence, for people"""
    to_deg: float | None
    """where the start takes it, °"""
    turn_count_lost: bool
    """turns are counted from 0 again"""
    warnings: list[str]
    """what is worth knowing, in sentences"""


class Group(TypedDict):
    """A chapter of the parameter list, as the document divides it (tables 3-1 to 3-11)."""

    description: str
    """what its rows are for"""
    key: str
    """name of the row, the same everywhere"""
    label: str
    """for people"""


class Health(TypedDict):
    """The server serves."""

    bus: str
    """state of the bus"""
    demo: bool
    """simulated servos on an embedded bus"""
    status: Literal["ok"]
    """it serves"""
    uptime_s: float
    """since it started, s"""
    version: str
    """of hornbill"""


class Imported(TypedDict):
    """The verdict on every line of a file; `profile` is null unless all were ok."""

    lines: list[LineVerdict]
    """line by line"""
    profile: Profile | None
    """what was kept; null: nothing was"""


class Job(TypedDict):
    """Something that takes time."""

    created_at: float
    """seconds since 1970 UTC"""
    ended_at: float | None
    """seconds since 1970 UTC; null: not yet"""
    error: Problem | None
    """why it failed; null unless it did"""
    id: str
    """what to name it by in a path"""
    kind: Literal["save", "restart", "factory_reset", "identify", "profile", "commissioning", "step_test"]
    """what is done"""
    progress: float
    """0 to 1"""
    result: dict[str, Any] | None
    """what came of it, by kind; null until it has ended"""
    resumable: bool
    """POST …/resume goes on with what it has not done"""
    state: Literal["queued", "running", "succeeded", "failed", "cancelled"]
    """how it stands"""
    step: str | None
    """what it is doing now"""
    steps: list[JobStep]
    """one by one, in their order"""
    uid: str | None
    """unique id of the servo, 32 hex digits; null: it is about none"""


class JobStep(TypedDict):
    """One step of a job, with its evidence."""

    ended_at: float | None
    """seconds since 1970 UTC; null: not yet"""
    evidence: str | None
    """what it was seen by; null: nothing yet"""
    name: str
    """what it is called"""
    started_at: float | None
    """seconds since 1970 UTC; null: not yet"""
    state: Literal["waiting", "running", "done", "failed", "skipped"]
    """how it stands"""
    text: str
    """in a sentence, for people"""
    uid: str | None
    """the servo this step is about, in a job over several"""


class KnownServo(TypedDict):
    """A servo ever seen, on the bus or not; instants in seconds since 1970 UTC."""

    drift: list[str]
    """keys of rows whose ROM changed under us"""
    firmware: str | None
    """version, as `1.300`"""
    first_seen: float | None
    """seconds since 1970 UTC"""
    hardware_version: int | None
    """as GetNodeInfo gives it"""
    label: str
    """for people"""
    last_seen: float | None
    """seconds since 1970 UTC"""
    model: str | None
    """as `BLA21-06U-A0`; null: not known"""
    node_id: int | None
    """last known"""
    online: bool
    """heard lately"""
    production_date: str | None
    """as the servo gives it; null: not known"""
    rom: dict[str, bool | int | float | str | None]
    """configuration last known to be in ROM"""
    serial: str | None
    """model number, dash, product number; null: not known"""
    servo_id: int | None
    """last known"""
    snapshots: int
    """how many are kept"""
    uid: str
    """unique id, 32 lower-case hex digits"""


class Lease(TypedDict):
    """The one writer's lease; renew before it ends, or torque goes off on what it commanded."""

    expires_at: float
    """seconds since 1970 UTC"""
    expires_in_s: float
    """it ends so soon unless it is renewed, s"""
    holder: str
    """who has motion control"""
    id: str
    """what to name it by in a path"""
    request: AskedFor | None
    """who asks for it; null: nobody"""
    ttl_s: float
    """it lapses so long after its last renewal, s"""


class LeaseView(TypedDict):
    """A lease as others see it: without the id that lets one use it."""

    expires_at: float
    """seconds since 1970 UTC"""
    expires_in_s: float
    """it ends so soon unless it is renewed, s"""
    holder: str
    """who has motion control"""
    request: AskedFor | None
    """who asks for it; null: nobody"""
    ttl_s: float
    """it lapses so long after its last renewal, s"""


class LeftOut(TypedDict):
    """A row that was not written, and why."""

    key: str
    """of the row"""
    why: str
    """in a sentence"""


class LineVerdict(TypedDict):
    """What became of one line of an imported file. `ok`: kept; everything else keeps the whole file out."""

    key: str
    """name of the row, the same everywhere"""
    line: int
    """from 1; 0 when the line is not known"""
    text: str
    """what is wrong and what to do; when ok, what is worth knowing"""
    value: bool | int | float | str | None
    """as the file has it"""
    verdict: Literal[
        "ok", "unknown", "forbidden", "read_only", "identity", "out_of_range", "invalid", "not_in_this_model"
    ]
    """ok: kept; all else keeps the whole file out"""


class LogFile(TypedDict):
    """A log in the data folder."""

    bytes: int
    """size, bytes"""
    modified_at: float
    """seconds since 1970 UTC"""
    name: str
    """what it is called"""


class LogState(TypedDict):
    """The log of frames being written, or the last one that was."""

    bytes: int
    """size, bytes"""
    dropped: int
    """frames that could not be written in time"""
    format: Literal["candump", "asc", "blf", "csv"] | None
    """of the file; null: none was written"""
    frames: int
    """how many CAN frames"""
    limit_bytes: int
    """it ends by itself at this size"""
    name: str | None
    """of the file; null: none was written"""
    reason: str | None
    """why it ended, unless it was stopped"""
    started_at: float | None
    """seconds since 1970 UTC"""
    state: Literal["idle", "running", "stopped", "full", "failed"]
    """how it stands"""


class Mark(TypedDict):
    """A moment for which the bundle was written; `at` in seconds since 1970 UTC."""

    at: float
    """seconds since 1970 UTC"""
    reason: Literal["failure", "stop", "lost", "bus_lost", "by_hand"]
    """why"""
    text: str
    """in a sentence, for people"""
    uid: str | None
    """unique id of the servo, 32 hex digits; null: it is about none"""


class Node(TypedDict):
    """Whoever is heard on this bus, servo or not, and this server itself (table 2-17). One that never said
    NodeStatus has mode `unknown`, health `warning` and uptime 0. Nodes that ask for a node id stand as one,
    with node id 0."""

    age_s: float
    """since it was heard, s"""
    hardware_version: str | None
    """from GetNodeInfo"""
    health: Literal["ok", "warning", "error", "critical"]
    """as its NodeStatus says"""
    kind: Literal["servo", "hornbill", "foreign", "unknown"]
    """unknown: not asked yet, or it does not answer"""
    mode: str
    """as its NodeStatus says"""
    name: str | None
    """from GetNodeInfo"""
    node_id: int
    """1 to 127"""
    note: str | None
    """why it is not taken for a servo, or what is odd about it"""
    online: bool
    """heard lately"""
    restarts: int
    """how often it was seen to start again"""
    software_version: str | None
    """from GetNodeInfo"""
    uid: str | None
    """unique id of the servo, 32 hex digits; null: it is about none"""
    uptime_s: int
    """since it started, s"""


class Parameter(TypedDict):
    """One register. `default`, `minimum` and `maximum` are raw; an engineering value is raw / per_unit."""

    access: Literal["rw", "r", "w"]
    """read and write, read alone, or run by writing"""
    action: bool
    """Whether it does something when written and means nothing when read (0x10 to 0x12)."""
    address: int
    """register, 0x00 to 0x5F"""
    advice: str
    """what to know before touching an expert's row"""
    after_restart: bool
    """takes effect at the next start"""
    choices: list[Choice]
    """of a row of kind `choice`"""
    default: int | None
    """raw, where all models have the same"""
    description: str
    """what it does"""
    dummy: bool
    """does nothing"""
    expert: bool
    """folded away unless asked for"""
    forbidden: bool
    """never written nor read: the servo would need its maker"""
    group: str
    """which chapter of its table it stands in"""
    identity: bool
    """says which servo it is: origin, servo id, node id (0x44 to 0x46)"""
    key: str
    """name of the row, the same everywhere"""
    kind: Literal["number", "choice", "switch", "bits"]
    """a number, a choice, a switch, or bits"""
    label: str
    """for people"""
    maximum: int | None
    """raw, where all models have the same"""
    minimum: int | None
    """raw, where all models have the same"""
    name: str
    """The four ASCII characters GetSet knows the register by: `0x2A` (table 2-14)."""
    per_unit: int
    """raw steps of one unit"""
    pwm_only: bool
    """only on models with PWM input"""
    rom: bool
    """Whether a ROM write keeps it: 0x20 to 0x4F (section 4.11)."""
    section: str
    """of the servo's document"""
    since: str
    """first firmware that has it"""
    unit: str
    """of its engineering value"""
    unit_when: UnitWhen | None
    """another unit, while another row reads a value"""


class Parameters(TypedDict):
    """Every row this model and firmware has."""

    parameters: dict[str, Reading]
    """readings by key"""
    revision: str
    """changes with every value: what If-Match takes"""


class ParametersPatched(TypedDict):
    """The outcome of a PATCH; with save, the job that saves."""

    changes: list[Change]
    """row by row"""
    failure: str | None
    """why it was rolled back"""
    job: str | None
    """id of the save job, with save: true"""
    outcome: Literal["applied", "rolled_back", "planned"]
    """all of it, or none: rolled_back is as before"""
    problem: Problem | None
    """the same for programs: with its code and its facts"""
    revision: str
    """changes with every value: what If-Match takes"""


class PendingAllocation(TypedDict):
    """A node heard asking for an id, and how far it has come."""

    age_s: float
    """since it was heard, s"""
    attempts: int
    """how often it has begun to ask"""
    refusal: str | None
    """why it gets none; null: it will"""
    stage: int
    """how many of the three parts were heard"""
    uid_part: str
    """what is known of the unique id, in hex"""
    waiting_s: float
    """since it was heard first, s"""


class PendingBundle(TypedDict):
    """A bundle that still takes in what happens."""

    marks: list[BundleMark]
    """why it was written, and what happened meanwhile"""
    ready_in_s: float
    """it is written then, s"""
    reason: Literal["failure", "stop", "lost", "bus_lost", "by_hand"]
    """why"""
    text: str
    """in a sentence, for people"""


class PositionUnitState(TypedDict):
    """What position 1.0 means on a servo, and how that is known."""

    evidence: str
    """how that is known, for people"""
    state: Literal["assumed", "confirmed", "forced", "conflict"]
    """assumed: not measured yet; conflict: Status and 0x08 agree in no unit, or in two"""
    unit: Literal["hundred_degrees", "radian", "degree", "tenth_degree"]
    """in force for what is broadcast"""


class Problem(TypedDict):
    """application/problem+json: what went wrong, the code to branch on, and what to do."""

    code: str
    """what it is, for programs: it does not change"""
    detail: str
    """in a sentence"""
    status: int
    """of HTTP"""
    title: str
    """the code as a phrase"""
    type: str
    """a reference to the kind of problem"""


class Profile(TypedDict):
    """A named set of values, in engineering units."""

    created_at: float
    """seconds since 1970 UTC"""
    description: str
    """what it is for"""
    firmware: str | None
    """firmware it was made for, e.g. "1.300"""
    model: str | None
    """model it was made for; null: any"""
    name: str
    """what it is called"""
    schema_revision: str
    """tables it was written with"""
    units: dict[str, str]
    """unit of each number"""
    updated_at: float
    """seconds since 1970 UTC"""
    values: dict[str, bool | int | float | str | None]
    """by key"""


class Reading(TypedDict):
    """One parameter as last read from RAM, beside what is known of ROM and what this model allows."""

    address: int
    """register"""
    age_s: float | None
    """since it was read, s; null: never"""
    at: float | None
    """when it was read, seconds since 1970 UTC"""
    default: bool | int | float | str | None
    """of this model"""
    differs_from_default: bool | None
    """RAM beside the model's default; null where that is not known, or there is none"""
    in_effect: bool | None
    """false: has no effect now; null: not known"""
    key: str
    """name of the row, the same everywhere"""
    maximum: float | None
    """of this model"""
    minimum: float | None
    """of this model"""
    raw: int | None
    """integer on the wire; null while never read"""
    rom: bool | int | float | str | None
    """value known to be in ROM; null when not known"""
    stale: bool
    """too old, or of a servo that is silent: not for certain what it holds"""
    unit: str
    """of its value"""
    unsaved: bool | None
    """RAM differs from ROM; null where one is not known, or ROM does not keep the row"""
    value: bool | int | float | str | None
    """engineering value or choice key; null for the dummy and while unknown"""
    why_not: str | None
    """why it has no effect now, in a sentence"""


class RecorderState(TypedDict):
    """The recorder of the last ten minutes; it needs no starting."""

    before_s: float
    """seconds a bundle holds before its first mark"""
    bytes: int
    """memory it takes"""
    frames: int
    """how many CAN frames"""
    pending: PendingBundle | None
    """a bundle that still takes in what happens; null: none"""
    reach_s: float
    """how far it reaches back; less than 600 when memory was full or it began lately"""
    recording: bool
    """false while a recording is played: that is not recorded again"""


class Recycled(TypedDict):
    """Rows that were freed, as they were."""

    free: int
    """ids that could be given to new nodes now"""
    freed: list[Allocation]
    """rows that are no longer in the table, as they were"""


class ResetPreview(TypedDict):
    """What a factory reset would change."""

    changes: list[Change]
    """rows that would not stay as they are"""
    kept: dict[str, bool | int | float | str | None]
    """identity rows that stay"""
    restart: Forecast


class Restored(TypedDict):
    """The outcome of a restore, as of a PATCH, and the rows that were left out of it."""

    changes: list[Change]
    """row by row"""
    failure: str | None
    """why it was rolled back"""
    job: str | None
    """id of the save job, with save: true"""
    left_out: list[LeftOut]
    """rows that were not written"""
    outcome: Literal["applied", "rolled_back", "planned"]
    """all of it, or none: rolled_back is as before"""
    problem: Problem | None
    """the same for programs: with its code and its facts"""
    revision: str
    """changes with every value: what If-Match takes"""


class RowRange(TypedDict):
    """What one model allows in one row, raw."""

    default: int | None
    """raw"""
    maximum: int | None
    """raw"""
    minimum: int | None
    """raw"""


class RunOverlay(TypedDict):
    """Runs side by side; `differences`: the parameters that are not the same in all of them, in their order."""

    differences: dict[str, list[bool | int | float | str | None]]
    """rows that are not the same in all runs, a value a run"""
    runs: list[StepRun]
    """as asked for"""


class SchemaDocument(TypedDict):
    """Every table: rows, models, firmware steps, fault bits, effect rules."""

    effects: list[EffectRule]
    """rows that have no effect while others stand in their way"""
    faults: list[FaultBit]
    """bits of the three fault registers"""
    firmware: list[str]
    """versions the tables know"""
    groups: list[Group]
    """chapters of the parameter list"""
    models: list[SchemaModel]
    """each with its own ranges"""
    overview: list[FaultBit]
    """bits of the register that sums the others up"""
    parameters: list[Parameter]
    """every row"""
    revision: str
    """changes when a table does"""
    specification: str
    """the document the tables are made from"""


class SchemaModel(TypedDict):
    """One servo model and its own numbers; `rows` has every row it offers at its newest firmware."""

    hardware_version: int
    """as a servo of it says in GetNodeInfo"""
    model_number: int
    """as a servo of it says"""
    name: str
    """what it is called"""
    pwm: bool
    """has an input for PWM"""
    rows: dict[str, RowRange]
    """those it has at its newest firmware, by key"""
    series: str
    """BLA15 or BLA21"""
    voltage_class: str
    """what supply it is made for"""


class Servo(TypedDict):
    """One servo, known by its unique id."""

    age_s: float | None
    """age of angle_deg in seconds"""
    angle_deg: float | None
    """where the horn stands, °; + is clockwise"""
    bus: str | None
    """address of the bus it is on; null while it is offline"""
    command_deg: float | None
    """angle command as last known; null while inactive"""
    drift: list[str]
    """keys whose ROM somebody else changed; GET …/drift shows from what"""
    faults: FaultWords
    firmware: str | None
    """as in the tables, e.g. "1.300"""
    hardware_version: int | None
    """as GetNodeInfo gives it"""
    health: Literal["ok", "warning", "error", "critical"] | None
    """as its NodeStatus says"""
    known_model: bool
    """the tables have it"""
    label: str
    """nickname, kept by the server"""
    mode: str | None
    """as its NodeStatus says"""
    model: str | None
    """as `BLA21-06U-A0`; null: not known"""
    name: str
    """node name as GetNodeInfo gives it"""
    node_id: int | None
    """present node id 1..127; null while it has none"""
    online: bool
    """heard lately"""
    position_unit: PositionUnitState
    production_date: str | None
    """YYYY-MM-DDTHH:MM, time zone not stated by the servo"""
    pwm: bool | None
    """has an input for PWM; null: not known"""
    serial: str | None
    """model number, dash, product number"""
    series: str | None
    """BLA15 or BLA21; null: not known"""
    servo_id: int | None
    """actuator id, parameter 0x45; 0 cannot be addressed by ArrayCommand"""
    state: Literal["identifying", "ready", "soft_start", "saving", "restarting", "updating", "protected", "offline"]
    """what it is doing, as this server knows it"""
    uid: str
    """unique id, 32 lower-case hex digits"""
    unacknowledged: int
    """warnings and failures that nobody has acknowledged since they came up last"""
    unsaved: list[str]
    """keys whose RAM differs from what is known to be in ROM"""
    uptime_s: int | None
    """since it started, s"""


class Snapshot(TypedDict):
    """What a servo held at one instant, in engineering values."""

    at: float
    """seconds since 1970 UTC"""
    automatic: bool
    """taken before a change, not asked for"""
    by: str
    """who did it"""
    firmware: str | None
    """version, as `1.300`"""
    id: int
    """what to name it by in a path"""
    model: str | None
    """as `BLA21-06U-A0`; null: not known"""
    reason: str
    """why"""
    rom: dict[str, bool | int | float | str | None]
    """what was known of ROM, by key"""
    uid: str
    """unique id, 32 lower-case hex digits"""
    values: dict[str, bool | int | float | str | None]
    """RAM, by key"""


class StepMetrics(TypedDict):
    """Numbers of one step; times in seconds, each ± `sample_s`; null where the step never got there. `hunting_hz`:
    full swings a second after settling, `hunting_rms_deg` their size."""

    crossing_s: float | None
    """until the target is first reached"""
    delay_s: float | None
    """until the horn begins to move, s"""
    hunting: Literal["none", "slight", "hunting"]
    """how much it swings after settling"""
    hunting_hz: float | None
    """full swings a second after settling"""
    hunting_rms_deg: float | None
    """size of those swings, RMS, °"""
    overshoot_pct: float | None
    """beyond the target, in % of the step"""
    peak_deg: float | None
    """the farthest it went, °"""
    peak_speed_rpm: float | None
    """the fastest it went, rpm"""
    rise_s: float | None
    """from 10 % to 90 % of the step"""
    sample_s: float
    """between two samples: how exact all times are, s"""
    settling_s: float | None
    """until the angle stays within the band"""
    steady_state_error_deg: float | None
    """from the target, once at rest, °"""


class StepRun(TypedDict):
    """A finished step test, with what it was measured under."""

    achieved_hz: float
    """samples a second"""
    at: float
    """seconds since 1970 UTC"""
    band_deg: float
    """how near the target counts as there, °"""
    firmware: str | None
    """version, as `1.300`"""
    id: int
    """what to name it by in a path"""
    model: str | None
    """as `BLA21-06U-A0`; null: not known"""
    note: str
    """what somebody wrote of it"""
    parameters: dict[str, bool | int | float | str | None]
    """all rows it was measured under, by key"""
    step_deg: float
    """how far, °"""
    steps: list[StepTrace]
    """one by one, in their order"""
    temperature_c: float | None
    """of the servo then, °C"""
    uid: str
    """unique id, 32 lower-case hex digits"""
    voltage_v: float | None
    """at the servo then, V"""
    warnings: list[str]
    """what is worth knowing, in sentences"""


class StepTrace(TypedDict):
    """One step: samples from the command on."""

    angle_deg: list[float]
    """a sample each, °"""
    direction: Literal["there", "back"]
    """to the target, or back"""
    from_deg: float
    """°"""
    metrics: StepMetrics
    t: list[float]
    """of each sample, s from the command on"""
    to_deg: float
    """°"""


class Stop(TypedDict):
    """The stop latch."""

    at: float | None
    """seconds since 1970 UTC"""
    by: str | None
    """who did it"""
    latched: bool
    """nothing moves until somebody clears it"""
    mode: Literal["off", "brake"] | None
    """torque off, or the brake; null while nothing is stopped"""
    nodes: list[StopNode]
    """nodes that broadcast an actuator's status and may be servos"""
    reason: str | None
    """why"""
    servos: list[StopServo]
    """one by one"""


class StopNode(TypedDict):
    """How stop went on a node that may be a servo and has not been identified."""

    confirmed: bool
    """it answered that it is so"""
    ms: float | None
    """from the request to the node's answer"""
    node_id: int
    """1 to 127"""


class StopServo(TypedDict):
    """How stop went on one servo."""

    confirmed: bool
    """it answered that it is so"""
    label: str
    """for people"""
    ms: float | None
    """from the request to the servo's answer"""
    uid: str
    """unique id, 32 lower-case hex digits"""


class Stream(TypedDict):
    """A stream and how well it keeps time."""

    bus_share: float
    """share of the bus it takes, 0..1"""
    ended: str | None
    """why it ended; null while it runs"""
    holder: str
    """who has motion control"""
    id: str
    """what to name it by in a path"""
    misses: int
    """slots that passed without a burst in time"""
    moving: bool
    """a servo of it is on its way to where a profile takes it"""
    rate_hz: float
    """bursts a second"""
    sent: int
    """bursts sent"""
    type: Literal["angle", "speed", "torque"]
    """what its values are: °, rpm or %"""
    uids: list[str]
    """servos that are commanded together"""
    worst_late_ms: float
    """the latest a burst left after its time, ms"""
    worst_skew_ms: float
    """worst time between first and last message of one burst"""


class Telemetry(TypedDict):
    """What is polled of a servo, and for whom."""

    budget: float
    """share of the bus all polling may take, 0..1"""
    channels: dict[str, TelemetryChannel]
    """by key of the parameter"""
    wishes: list[TelemetryGrant]
    """who wants what, and what they get"""


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
    """keys of parameters"""
    expires_in_s: float | None
    """null: stays until it is replaced"""
    granted_hz: float
    """what the budget of the bus leaves of it, 1/s"""
    note: str | None
    """why nothing is polled now, if nothing is"""
    owner: str
    """who wants it"""
    requested_hz: float
    """what is wanted, 1/s"""


class TelemetryMark(TypedDict):
    """Something to know of a channel at an instant: `t` in seconds on the server's clock."""

    kind: Literal["wrap", "inactive", "gap", "restart"]
    """what happened there"""
    t: float
    """on the server's clock, s"""


class UnitWhen(TypedDict):
    """Another unit, in force while `parameter` reads `raw` (0x36 follows 0x37, section 4.30)."""

    parameter: str
    """the row that decides"""
    per_unit: int
    """raw steps of one such unit"""
    raw: int
    """what that row reads then"""
    unit: str
    """of its value"""
