"""Owns the JSON shapes of REST that do not come from the tables: servo, reading, change, job, lease, stop."""

from typing import Any, Literal

from pydantic import ConfigDict, Field

from hornbill.domain.change import Change, SavePreview
from hornbill.domain.fields import (
    Confirmed,
    DryRun,
    Model,
    MotionConfirm,
    Param,
    Params,
    SaveAfter,
    Short,
    UidField,
    UidText,
    Utc,
)
from hornbill.domain.job import EvidenceCode, StepCode
from hornbill.domain.servo import Reading, TelemetryGrant
from hornbill.schema.scale import Value

PositionUnit = Literal["hundred_degrees", "radian", "degree", "tenth_degree"]
"""What position 1.0 means in Status and ArrayCommand (tables 2-21 and 2-22)."""


class PositionUnitState(Model):
    """What position 1.0 means on a servo, and how that is known."""

    unit: PositionUnit = Field(description="Unit of positions in broadcasts.")
    state: Literal["assumed", "confirmed", "forced", "conflict"] = Field(
        description=(
            "assumed: the maker's unit, not checked yet; confirmed: Status and 0x08 agree in it; conflict: they "
            "agree in another unit, in none, or in two, and no angle is sent by ArrayCommand; forced: set by a "
            "client"
        )
    )
    evidence: str = Field(description="Evidence, one sentence for users.")


class FaultWords(Model):
    """The three fault words 0x19, 0x1A and 0x1B as last read; null while unknown (section 4.12)."""

    notification: int | None = Field(description="Notification register, raw. Null if never read.")
    warning: int | None = Field(description="Warning register, raw. Null if never read.")
    failure: int | None = Field(description="Failure register, raw. Null if never read.")


class Output(Model):
    """What the motor of a servo gets, and why. Session state: no change of it is an edit of parameter 0x20."""

    state: Literal["on", "off", "brake", "unknown"] = Field(
        description="Output of the motor. unknown: offline, or not read since the start."
    )
    reason: Literal["configured", "stop", "lease", "command", "timeout", "protection"] = Field(
        description=(
            "configured: as the servo started, or as 0x20 was written as configuration; stop: Stop; lease: a lease "
            "ended or expired; command: a client or another tool switched it; timeout: the servo's own time-out (0x26, "
            "0x27); protection: its limits of temperature or voltage, or a motor failure"
        )
    )
    by: str | None = Field(description="Client that switched it. Null if none or unknown.")
    since: float | None = Field(description="Time of the switch, seconds since 1970 UTC. Null if unknown.")


class Activity(Model):
    """What the motor and horn of a servo do now, told from what is received of it: Status and polled rows.

    At rest means: the angle command has not changed for 0.6 s.
    """

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
    ] = Field(
        description=(
            "holding: output on, angle steady within 0.3° for 0.6 s; moving: output on, angle changes; turning: a "
            "speed or torque command other than 0 is in force; hunting: at rest, and the angle has swung to and fro "
            "by 0.5° or more for at least a second; saturated: at rest, steady, and torque at 90 % or more of what "
            "the servo can give; soft_start: on the way to 0° after a start; released: the servo's own time-out "
            "(0x26 off, 0x27) took the output; held_after_timeout: it holds its last command though nobody commands "
            "it any more (0x26 hold); off: output off for any other reason, see `output`; brake: output off, weak "
            "brake; unknown: offline, being identified, saved or restarted, output not known, or no angle for 1 s"
        )
    )
    since: float = Field(description="Start of this state, seconds since 1970 UTC.")
    peak_to_peak_deg: float | None = Field(
        description="Peak-to-peak angle, °: of the oscillation while hunting, otherwise of the last 0.6 "
        "s. Null if unknown."
    )
    torque_pct: float | None = Field(description="Torque as last read from 0x0A, %. Null if never read.")
    torque_limit_pct: float = Field(
        description="what the motor can give at rest on that side, %: the lowest of its torque limit (with 0x25 on), "
        "the overcurrent limit as a share of its default, and the supply as a share of nominal"
    )


class LostValue(Model):
    """A value that was only in RAM when the servo restarted without a save, and that RAM does not hold since."""

    key: str = Field(description="Parameter key.")
    value: Value = Field(description="Engineering value or choice key, as PATCH takes it.")
    at: float = Field(description="Time the loss was found, seconds since 1970 UTC.")


class TreatedAs(Model):
    """The known model and firmware that stand for what the tables do not have."""

    model: str | None = Field(description="Model to assume. Null if the model is known.")
    firmware: str | None = Field(description="Firmware to assume. Null if the firmware is known.")


class Servo(Model):
    """One servo, known by its unique id."""

    uid: UidField
    node_id: int | None = Field(description="Current node ID, 1 to 127. Null while it has none.")
    servo_id: int | None = Field(description="Servo ID (0x45). ArrayCommand cannot address 0. Null if unknown.")
    label: str = Field(description="Nickname, stored by the server.")
    name: str = Field(description="Node name from GetNodeInfo.")
    model: str | None = Field(description="Model, such as `BLA21-06U-A0`. Null if unknown.")
    model_number: int | None = Field(description="Model number (0x50), which determines the series. Null if unknown.")
    series: str | None = Field(description="BLA15, BLA21 or BLA34. Null if unknown.")
    pwm: bool | None = Field(description="The servo has a PWM input. Null if unknown.")
    firmware: str | None = Field(description="Firmware version, such as `1.300`. Null if unknown.")
    hardware_version: int | None = Field(description="Hardware version from GetNodeInfo. Null if unknown.")
    serial: str | None = Field(description="Serial number: model number, dash, product number. Null if unknown.")
    production_date: str | None = Field(description="YYYY-MM-DDTHH:MM, time zone not stated by the servo")
    known_model: bool = Field(description="The tables contain its series. Servos of other series are read-only.")
    treated_as: TreatedAs
    firmware_note: str | None = Field(
        description="What users of this firmware should know, in English. Null if nothing."
    )
    online: bool = Field(description="Received recently.")
    state: Literal["identifying", "ready", "soft_start", "saving", "restarting", "updating", "protected", "offline"] = (
        Field(description="Operating state.")
    )
    health: Literal["ok", "warning", "error", "critical"] | None = Field(
        description="Health from NodeStatus. Null if unknown."
    )
    mode: str | None = Field(description="Mode from NodeStatus. Null if unknown.")
    uptime_s: int | None = Field(description="Time since its start, s. Null if unknown.")
    angle_deg: float | None = Field(description="Horn angle, °. Positive is clockwise.")
    command_deg: float | None = Field(description="Last known angle command, °. Null while inactive.")
    age_s: float | None = Field(description="Age of `angle_deg`, s. Null if never received.")
    position_unit: PositionUnitState
    output: Output
    activity: Activity
    unsaved: list[str] = Field(
        description="Keys of rows configured differently from ROM. Switching the output does not count."
    )
    drift: list[str] = Field(
        default_factory=list[str], description="Keys of rows that another tool changed in ROM. Details: `GET …/drift`."
    )
    lost: list[LostValue] = Field(
        default_factory=list[LostValue],
        description="RAM values lost in a restart. A value leaves when RAM holds it again, all of them leave after a "
        "successful save and DELETE …/lost",
    )
    faults: FaultWords
    unacknowledged: int = Field(
        default=0, description="Number of warnings and failures not acknowledged since they last occurred."
    )
    bus: str | None = Field(description="Address of the bus. Null while offline.")


class ServoPatch(Model):
    """The only thing about a servo that the server itself keeps."""

    label: str = Field(max_length=64, description="Nickname.")


class Parameters(Model):
    """Every row this model and firmware has."""

    revision: str = Field(description="Revision of the values, for If-Match.")
    parameters: dict[str, Reading] = Field(description="Readings by key.")


class RowValue(Model):
    """The value of one row; each row has a class of its own that says what it may be."""

    value: Any
    confirm: Confirmed = Field(default=[])


class ParametersPatch(Model):
    """Several rows at once, all or nothing."""

    values: dict[str, bool | int | float | str] = Field(
        min_length=1, description="Values by key, in the units of the parameter manual."
    )
    dry_run: DryRun = False
    save: SaveAfter = False
    confirm: Confirmed = Field(default=[])


class ParametersPatched(SavePreview):
    """The outcome of a PATCH; with save, the job that saves, or what a dry run of it found."""

    outcome: Literal["applied", "rolled_back", "planned"] = Field(
        description="All changes, or none: rolled_back restores the earlier values."
    )
    changes: list[Change] = Field(description="Changes, row by row.")
    revision: str = Field(description="Revision of the values, for If-Match.")
    job: str | None = Field(default=None, description="ID of the save job, with `save`. Null otherwise.")
    failure: str | None = Field(default=None, description="Reason for rolled_back, one sentence. Null otherwise.")
    problem: "Problem | None" = Field(
        default=None, description="Reason for rolled_back, with code and facts. Null otherwise."
    )


class JobStep(Model):
    """One step of a job, with its evidence."""

    name: str = Field(description="Name for programs.")
    code: StepCode = Field(description="Code of the step; with the kind of the job it says what is done.")
    params: Params
    text: str = Field(description="One sentence for users.")
    uid: str | None = Field(default=None, description="Servo of this step, in a job on several servos. Null otherwise.")
    state: Literal["waiting", "running", "done", "failed", "skipped"] = Field(description="State of the step.")
    evidence: str | None = Field(default=None, description="Observed values. Null if none yet.")
    evidence_code: EvidenceCode | None = Field(
        default=None,
        description="Code of `evidence`. problem: `evidence_params` has its code as `problem`. Null if none.",
    )
    evidence_params: Params = Field(default_factory=dict[str, Param])
    ahead: str | None = Field(
        default=None,
        description="End of `evidence` that describes remaining work. Obsolete once the job has ended. Null if none.",
    )
    started_at: float | None = Field(default=None, description="Start, seconds since 1970 UTC. Null until then.")
    ended_at: float | None = Field(default=None, description="End, seconds since 1970 UTC. Null until then.")


class Job(Model):
    """Something that takes time."""

    id: str = Field(description="ID, as used in paths.")
    kind: Literal[
        "save", "restart", "factory_reset", "identify", "profile", "commissioning", "step_test", "restore_output"
    ] = Field(description="Kind of job.")
    uid: str | None = Field(description="Unique ID of the servo, 32 hex digits. Null if it concerns none.")
    state: Literal["queued", "running", "succeeded", "failed", "cancelled"] = Field(description="State of the job.")
    progress: float = Field(ge=0, le=1, description="Progress, 0 to 1.")
    step: str | None = Field(description="Current step, for users. Null if none.")
    result: dict[str, object] | None = Field(description="Result, depending on the kind. Null until the job has ended.")
    error: "Problem | None" = Field(description="Reason for the failure. Null unless it failed.")
    steps: list[JobStep] = Field(description="Steps in order.")
    created_at: Utc
    ended_at: float | None = Field(description="End, seconds since 1970 UTC. Null until then.")
    resumable: bool = Field(default=False, description="POST …/resume goes on with what it has not done")


class Problem(Model):
    """application/problem+json: what went wrong, the code to branch on, and what to do."""

    model_config = ConfigDict(extra="allow")

    type: str = Field(description="URI reference of the problem type.")
    title: str = Field(description="Error code as a phrase.")
    status: int = Field(description="HTTP status.")
    code: str = Field(description="Code for programs. Stable.")
    detail: str = Field(description="One sentence with the details.")
    summary: str = Field(description="`detail` without requests for programs.")
    params: Params = Field(default_factory=dict[str, Param])


class MotionProfile(Model):
    """How a rate-limited move goes: a trapezoid of speed, sent as 50 angles a second."""

    speed_deg_s: float = Field(default=60.0, gt=0, le=3600, description="Speed limit, °/s.")
    accel_deg_s2: float = Field(default=240.0, gt=0, le=100_000, description="Acceleration and deceleration, °/s².")


class MotionHold(Model):
    """A speed or torque that lasts only while it is asked for again: for a button that is held."""

    for_s: float = Field(
        default=0.5, ge=0.1, le=5, description="Time after which the servo is braked unless renewed, s."
    )
    renew: bool = Field(default=False, description="Only renew a running command. Refused as busy if it was braked.")


class Command(Model):
    """A motion command for one servo. Needs a lease."""

    type: Literal["angle", "speed", "torque"] = Field(
        description="Type of the value: angle (°), speed (rpm) or torque (%)."
    )
    value: float = Field(
        description="Angle (°), speed (rpm) or torque (%), rounded to the servo's step.", allow_inf_nan=False
    )
    wait: Literal["sent", "settled"] = Field(
        default="sent", description="Respond when the command is sent, or when the horn has settled."
    )
    timeout_s: float = Field(default=5.0, gt=0, le=120, description="Timeout for settling, s.")
    band_deg: float = Field(default=0.5, gt=0, le=30, description="Settling band around the target, °.")
    dwell_s: float = Field(
        default=0.2, ge=0, le=10, description="Time within the band before the move counts as settled, s."
    )
    clamp: bool = Field(default=False, description="Move to the nearest legal value instead of refusing.")
    confirm: list[MotionConfirm] = Field(
        default_factory=list[MotionConfirm], description="Confirmation codes of earlier `needs_confirmation` problems."
    )
    profile: MotionProfile | None = Field(
        default=None, description="Speed and acceleration of the move, for angles only. Null: without limits."
    )
    hold: MotionHold | None = Field(
        default=None, description="Time limit for use with a held button, for speed and torque only. Null: none."
    )


class Commanded(Model):
    """Evidence of a command: when it was sent, and with wait=settled, whether and when it came to rest."""

    sent_at: Utc
    settled: bool | None = Field(description="The horn settled at the target. Null if not waited for.")
    settle_time_s: float | None = Field(
        description="Time from sending to settling, s. Null if not waited for or never settled."
    )
    angle_deg: float | None = Field(description="Horn angle, °. Positive is clockwise.")
    clamped: bool = Field(description="A limit of the servo was sent instead of the requested value.")
    value: float = Field(description="Sent value, in steps of 0.1°, 1 rpm or 1 %.")
    samples: int | None = Field(
        default=None, description="Number of consecutive samples within the band at the end. Null if not waited for."
    )
    max_deviation_deg: float | None = Field(
        default=None, description="Greatest deviation of these samples from the target, °. Null if none."
    )
    in_band_s: float | None = Field(
        default=None, description="Time within the band at the end, s. Null if not waited for."
    )
    unmet: Literal["band", "dwell", "samples"] | None = Field(
        default=None,
        description=(
            "with settled false, what was not met at the end: band: the angle is outside the band; dwell: within it, "
            "not yet for dwell_s; samples: the servo did not answer when its angle was read"
        ),
    )
    warnings: list[str] = Field(default_factory=list[str], description="Warnings, one sentence each.")


class TorqueMode(Model):
    """Output of the motor; an enum, never a boolean (section 4.13: on 0, off 1, brake 2)."""

    mode: Literal["on", "off", "brake"] = Field(description="Torque mode (0x20).")


class TelemetryWish(Model):
    """Rows to poll, and how often."""

    channels: list[str] = Field(description="Keys of readable parameters.")
    rate_hz: float = Field(gt=0, le=200, description="Samples per second.")
    ttl_s: float | None = Field(
        default=None, gt=0, le=86_400, description="Time until the subscription expires, s. Null: until replaced."
    )
    owner: str = Field(
        default="rest",
        min_length=1,
        max_length=64,
        description="Owner of the subscription. Each owner has one per servo.",
    )


class TelemetryMark(Model):
    """Something to know of a channel at an instant: `t` in seconds on the server's clock."""

    t: float = Field(description="Time on the server's clock, s.")
    kind: Literal["wrap", "inactive", "gap", "restart"] = Field(description="What happened.")


class TelemetryChannel(Model):
    """One channel: how often it is to be polled, and how often it really is."""

    granted_hz: float | None = Field(description="Granted rate of the subscriptions, Hz. Null without a subscription.")
    background_hz: float | None = Field(description="Rate of background polling, Hz. Null if not polled.")
    measured_hz: float = Field(description="Samples per second over the last 5 s, including broadcasts.")
    age_s: float | None = Field(description="Age of the last sample, s. Null if there is none.")
    marks: list[TelemetryMark] = Field(description="Newest 1000 marks.")


class Telemetry(Model):
    """What is polled of a servo, and for whom."""

    wishes: list[TelemetryGrant] = Field(description="Subscriptions and their granted rates.")
    channels: dict[str, TelemetryChannel] = Field(description="Channels by parameter key.")
    budget: float = Field(description="Share of the bus available to polling, 0 to 1.")


class LeaseRequest(Model):
    """Ask to be the one writer."""

    holder: str = Field(
        min_length=1,
        max_length=64,
        description="Name of the client, shown to other users. With access control, the token's name replaces it.",
    )
    ttl_s: float = Field(default=3.0, ge=0.2, le=60, description="Time to live after each renewal, s.")
    force: bool = Field(default=False, description="Take the lease from its current holder. Requires a reason.")
    reason: str = Field(default="", max_length=200, description="Reason, shown to users and written to the audit.")


class AskedFor(Model):
    """Somebody asks the holder for motion control; the lease passes when `expires_in_s` is over, unless refused."""

    id: str = Field(description="ID with which to refuse the request.")
    by: str = Field(description="Client that requests motion control.")
    reason: str = Field(description="Reason for the request.")
    expires_in_s: float = Field(description="Time until motion control passes unless refused, s.")


class Lease(Model):
    """The one writer's lease; renew before it ends, or torque goes off on what it commanded."""

    id: str = Field(description="ID, as used in paths.")
    shown_id: str = Field(description="First digits of `id`, visible to all clients.")
    holder: str = Field(description="Client with motion control.")
    ttl_s: float = Field(description="Time to live after each renewal, s.")
    expires_at: float = Field(description="Expiry, seconds since 1970 UTC.")
    expires_in_s: float = Field(description="Time until it expires unless renewed, s.")
    request: AskedFor | None = Field(description="Pending request for motion control. Null if none.")


class LeaseView(Model):
    """A lease as others see it: without the id that lets one use it."""

    shown_id: str = Field(description="First digits of its ID, which distinguish leases but do not allow their use.")
    holder: str = Field(description="Client with motion control.")
    ttl_s: float = Field(description="Time to live after each renewal, s.")
    expires_at: Utc
    expires_in_s: float = Field(description="Time until it expires unless renewed, s.")
    request: AskedFor | None = Field(description="Pending request for motion control. Null if none.")


class OutputRestore(Model):
    """Which outputs to switch on again."""

    uids: list[UidField] | None = Field(
        default=None,
        max_length=250,
        description="Servos, unique IDs. Null: all that are configured on and were switched off by a "
        "stop, lease or command.",
    )
    dry_run: DryRun = False
    confirm: list[Literal["load"]] = Field(
        default_factory=list[Literal["load"]],
        description="Confirmation codes of earlier `needs_confirmation` problems.",
    )


class RestorableOutput(Model):
    """One servo whose output would be switched on."""

    uid: UidText
    title: str = Field(description="Display name.")
    output: Output
    torque_pct: int | None = Field(description="Current torque as just read, %. Null if unknown.")
    under_load: bool = Field(description="Braked, turning or above 20 % torque. Requires confirmation.")
    needs_lease: bool = Field(
        description="The servo's timeout (0x26) would switch it off again. It stays on until the lease ends."
    )
    problem: "Problem | None" = Field(description="Reason why it would stay off. Null if none.")


class OutputRestorePreview(Model):
    """What restoring outputs would do."""

    clears_stop: bool = Field(description="Would first clear a latched stop.")
    servos: list[RestorableOutput] = Field(description="One entry per servo.")


class StopRequest(Model):
    """Stop everything now."""

    mode: Literal["off", "brake"] = Field(default="off", description="Torque off or brake.")
    reason: Short = Field(default="", description="200 characters of it are kept")


class StopServo(Model):
    """How stop went on one servo."""

    uid: UidField
    label: str = Field(description="Nickname. Empty if none.")
    confirmed: bool = Field(description="The response to torque off (or brake) was received.")
    ms: float | None = Field(description="Time from the request to the response, ms. Null until then.")


class StopNode(Model):
    """How stop went on a node that may be a servo and has not been identified."""

    node_id: int = Field(description="Node ID, 1 to 127.")
    confirmed: bool = Field(description="The response to torque off (or brake) was received.")
    ms: float | None = Field(description="Time from the request to the response, ms. Null until then.")


class Stop(Model):
    """The stop latch."""

    latched: bool = Field(description="Motion is blocked until the stop is cleared.")
    mode: Literal["off", "brake"] | None = Field(description="Torque off or brake. Null while not latched.")
    at: float | None = Field(description="Time of the stop, seconds since 1970 UTC. Null while not latched.")
    by: str | None = Field(description="Client that stopped. Null while not latched.")
    reason: str | None = Field(description="Reason of the client. Null while not latched.")
    servos: list[StopServo] = Field(description="One entry per servo.")
    nodes: list[StopNode] = Field(
        default_factory=list[StopNode], description="Nodes that broadcast actuator status and may be servos."
    )
