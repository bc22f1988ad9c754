"""Owns the JSON shapes of REST that do not come from the tables: servo, reading, change, job, lease, stop."""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

Value = bool | int | float | str | None
"""An engineering value: a number in the row's unit, true/false, a choice's key, or null for the dummy."""

Short = Annotated[str, AfterValidator(lambda text: text[:200])]
"""What is said beside a stop: too long a text is cut, for it must not keep a servo moving."""

UidField = Annotated[str, Field(pattern="^[0-9a-f]{32}$", description="unique id, 32 lower-case hex digits")]


class Model(BaseModel):
    """Base of every body and answer: unknown fields are refused, objects are readable by attribute."""

    model_config = ConfigDict(extra="forbid", from_attributes=True)


PositionUnit = Literal["hundred_degrees", "radian", "degree", "tenth_degree"]
"""What position 1.0 means in Status and ArrayCommand (tables 2-21 and 2-22)."""


class PositionUnitState(Model):
    """What position 1.0 means on a servo, and how that is known."""

    unit: PositionUnit
    state: Literal["assumed", "confirmed", "forced", "conflict"] = Field(
        description="assumed: not measured yet; conflict: Status and 0x08 agree in no unit, or in two"
    )
    evidence: str = Field(description="how that is known, for people")


class FaultWords(Model):
    """The three fault words 0x19, 0x1A and 0x1B as last read; null while unknown (section 4.12)."""

    notification: int | None
    warning: int | None
    failure: int | None


class Servo(Model):
    """One servo, known by its unique id."""

    uid: UidField
    node_id: int | None = Field(description="present node id 1..127; null while it has none")
    servo_id: int | None = Field(description="actuator id, parameter 0x45; 0 cannot be addressed by ArrayCommand")
    label: str = Field(description="nickname, kept by the server")
    name: str = Field(description="node name as GetNodeInfo gives it")
    model: str | None
    series: str | None
    pwm: bool | None
    firmware: str | None = Field(description='as in the tables, e.g. "1.300"')
    hardware_version: int | None
    serial: str | None = Field(description="model number, dash, product number")
    production_date: str | None = Field(description="YYYY-MM-DDTHH:MM, time zone not stated by the servo")
    known_model: bool
    online: bool
    state: Literal["identifying", "ready", "soft_start", "saving", "restarting", "updating", "protected", "offline"]
    health: Literal["ok", "warning", "error", "critical"] | None
    mode: str | None
    uptime_s: int | None
    angle_deg: float | None
    command_deg: float | None = Field(description="angle command as last known; null while inactive")
    age_s: float | None = Field(description="age of angle_deg in seconds")
    position_unit: PositionUnitState
    unsaved: list[str] = Field(description="keys whose RAM differs from what is known to be in ROM")
    drift: list[str] = Field(
        default_factory=list[str], description="keys whose ROM somebody else changed; GET …/drift shows from what"
    )
    faults: FaultWords
    unacknowledged: int = Field(
        default=0, description="warnings and failures that nobody has acknowledged since they came up last"
    )
    bus: str | None


class ServoPatch(Model):
    """The only thing about a servo that the server itself keeps."""

    label: str = Field(max_length=64)


class Reading(Model):
    """One parameter as last read from RAM, beside what is known of ROM and what this model allows."""

    key: str
    address: int
    value: Value = Field(description="engineering value or choice key; null for the dummy and while unknown")
    raw: int | None = Field(description="integer on the wire; null while never read")
    unit: str
    at: float | None = Field(description="when it was read, seconds since 1970 UTC")
    age_s: float | None
    rom: Value = Field(description="value known to be in ROM; null when not known")
    default: Value
    minimum: float | None
    maximum: float | None
    in_effect: bool | None = Field(description="false: has no effect now; null: not known")
    why_not: str | None
    stale: bool
    differs_from_default: bool | None = Field(
        default=None, description="RAM beside the model's default; null where that is not known, or there is none"
    )
    unsaved: bool | None = Field(
        default=None, description="RAM differs from ROM; null where one is not known, or ROM does not keep the row"
    )


class Parameters(Model):
    """Every row this model and firmware has."""

    revision: str
    parameters: dict[str, Reading]


Confirmed = Annotated[
    list[Literal["supply", "temperature", "torque_off_in_rom", "turns", "turn_count"]],
    Field(description="words of earlier needs_confirmation problems: do it all the same"),
]


class RowValue(Model):
    """The value of one row; each row has a class of its own that says what it may be."""

    value: Any
    confirm: Confirmed = []


class ParametersPatch(Model):
    """Several rows at once, all or nothing."""

    values: dict[str, bool | int | float | str] = Field(min_length=1)
    dry_run: bool = False
    save: bool = False
    confirm: Confirmed = []


class Change(Model):
    """What became of one key of a PATCH."""

    key: str
    before: Value
    requested: Value
    after: Value
    verdict: Literal["planned", "applied", "clamped", "refused", "no_answer", "unchanged", "rolled_back"]


class ParametersPatched(Model):
    """The outcome of a PATCH; with save, the job that saves."""

    outcome: Literal["applied", "rolled_back", "planned"]
    changes: list[Change]
    revision: str
    job: str | None = Field(default=None, description="id of the save job, with save: true")
    failure: str | None = Field(default=None, description="why it was rolled back")
    problem: "Problem | None" = Field(default=None, description="the same for programs: with its code and its facts")


class JobStep(Model):
    """One step of a job, with its evidence."""

    name: str
    text: str
    uid: str | None = Field(default=None, description="the servo this step is about, in a job over several")
    state: Literal["waiting", "running", "done", "failed", "skipped"]
    evidence: str | None = None
    started_at: float | None = None
    ended_at: float | None = None


class Job(Model):
    """Something that takes time."""

    id: str
    kind: Literal["save", "restart", "factory_reset", "identify", "profile", "commissioning", "step_test"]
    uid: str | None
    state: Literal["queued", "running", "succeeded", "failed", "cancelled"]
    progress: float = Field(ge=0, le=1)
    step: str | None
    result: dict[str, object] | None
    error: "Problem | None"
    steps: list[JobStep]
    created_at: float
    ended_at: float | None
    resumable: bool = Field(default=False, description="POST …/resume goes on with what it has not done")


class Problem(Model):
    """application/problem+json: what went wrong, the code to branch on, and what to do."""

    model_config = ConfigDict(extra="allow")

    type: str
    title: str
    status: int
    code: str
    detail: str


MotionConfirm = Literal["turns", "turn_count"]
"""Words of needs_confirmation problems of motion: a move of more than 360°, and a first move after a restart that lost
the turn count (B34, B71)."""


class MotionProfile(Model):
    """How a rate-limited move goes: a trapezoid of speed, sent as 50 angles a second."""

    speed_deg_s: float = Field(default=60.0, gt=0, le=3600)
    accel_deg_s2: float = Field(default=240.0, gt=0, le=100_000)


class MotionHold(Model):
    """A speed or torque that lasts only while it is asked for again: for a button that is held."""

    for_s: float = Field(default=0.5, ge=0.1, le=5, description="without another one within this it is braked")
    renew: bool = Field(default=False, description="only go on with what runs: refused as busy once it was braked")


class Command(Model):
    """A motion command for one servo. Needs a lease."""

    type: Literal["angle", "speed", "torque"]
    value: float = Field(description="degrees, rpm or %", allow_inf_nan=False)
    wait: Literal["sent", "settled"] = "sent"
    timeout_s: float = Field(default=5.0, gt=0, le=120)
    band_deg: float = Field(default=0.5, gt=0, le=30)
    dwell_s: float = Field(default=0.2, ge=0, le=10)
    clamp: bool = Field(default=False, description="move to the nearest legal value instead of refusing")
    confirm: list[MotionConfirm] = Field(
        default_factory=list[MotionConfirm], description="words of earlier needs_confirmation problems: do it anyway"
    )
    profile: MotionProfile | None = Field(default=None, description="go there at a limited speed; angles only")
    hold: MotionHold | None = Field(default=None, description="only while a button is held; speed and torque only")


class Caution(Model):
    """Something to know before a command is sent."""

    level: Literal["warning", "failure"] = Field(description="failure: it may go on for ever")
    text: str
    confirm: MotionConfirm | None = Field(description="the word without which it is not sent; null: only said")


class Commanded(Model):
    """Evidence of a command: when it was sent, and with wait=settled, whether and when it came to rest."""

    sent_at: float
    settled: bool | None
    settle_time_s: float | None
    angle_deg: float | None
    clamped: bool
    value: float
    samples: int | None = Field(default=None, description="samples within the band in a row, up to the last one")
    max_deviation_deg: float | None = Field(default=None, description="the farthest of them from the target")
    warnings: list[str] = Field(default_factory=list[str])


class TorqueMode(Model):
    """Output of the motor; an enum, never a boolean (section 4.13: on 0, off 1, brake 2)."""

    mode: Literal["on", "off", "brake"]


class TelemetryWish(Model):
    """Rows to poll, and how often."""

    channels: list[str]
    rate_hz: float = Field(gt=0, le=200)
    ttl_s: float | None = Field(
        default=None, gt=0, le=86_400, description="ends by itself after so long; null: stays until it is replaced"
    )
    owner: str = Field(
        default="rest", min_length=1, max_length=64, description="whose wish it is; every owner has one a servo"
    )


class TelemetryGrant(Model):
    """What the bus budget allows of it."""

    owner: str = "rest"
    channels: list[str]
    requested_hz: float
    granted_hz: float
    bus_share: float = Field(description="share of the bus this takes, 0..1")
    expires_in_s: float | None = Field(default=None, description="null: stays until it is replaced")
    note: str | None = Field(default=None, description="why nothing is polled now, if nothing is")


class TelemetryMark(Model):
    """Something to know of a channel at an instant: `t` in seconds on the server's clock."""

    t: float
    kind: Literal["wrap", "inactive", "gap", "restart"]


class TelemetryChannel(Model):
    """One channel: how often it is to be polled, and how often it really is."""

    granted_hz: float | None = Field(description="of what is wished; null when nobody wishes it")
    background_hz: float | None = Field(description="polled so often whether wished or not; null when it is not")
    measured_hz: float = Field(description="samples a second over the last five, broadcast ones included")
    age_s: float | None = Field(description="age of the last sample; null when there never was one")
    marks: list[TelemetryMark] = Field(description="of what is kept, the newest thousand")


class Telemetry(Model):
    """What is polled of a servo, and for whom."""

    wishes: list[TelemetryGrant]
    channels: dict[str, TelemetryChannel]
    budget: float = Field(description="share of the bus all polling may take, 0..1")


class LeaseRequest(Model):
    """Ask to be the one writer."""

    holder: str = Field(min_length=1, max_length=64)
    ttl_s: float = Field(default=3.0, ge=0.2, le=60)
    force: bool = Field(default=False, description="take it from whoever has it, with a reason")
    reason: str = Field(default="", max_length=200)


class AskedFor(Model):
    """Somebody asks the holder for motion control; the lease passes when `expires_in_s` is over, unless refused."""

    id: str = Field(description="what to refuse it by")
    by: str
    reason: str
    expires_in_s: float


class Lease(Model):
    """The one writer's lease; renew before it ends, or torque goes off on what it commanded."""

    id: str
    holder: str
    ttl_s: float
    expires_at: float = Field(description="seconds since 1970 UTC")
    expires_in_s: float
    request: AskedFor | None


class LeaseView(Model):
    """A lease as others see it: without the id that lets one use it."""

    holder: str
    ttl_s: float
    expires_at: float
    expires_in_s: float
    request: AskedFor | None


class StopRequest(Model):
    """Stop everything now."""

    mode: Literal["off", "brake"] = "off"
    reason: Short = Field(default="", description="200 characters of it are kept")


class StopServo(Model):
    """How stop went on one servo."""

    uid: UidField
    label: str
    confirmed: bool
    ms: float | None = Field(description="from the request to the servo's answer")


class StopNode(Model):
    """How stop went on a node that may be a servo and has not been identified."""

    node_id: int
    confirmed: bool
    ms: float | None = Field(description="from the request to the node's answer")


class Stop(Model):
    """The stop latch."""

    latched: bool
    mode: Literal["off", "brake"] | None
    at: float | None
    by: str | None
    reason: str | None
    servos: list[StopServo]
    nodes: list[StopNode] = Field(
        default_factory=list[StopNode], description="nodes that broadcast an actuator's status and may be servos"
    )
