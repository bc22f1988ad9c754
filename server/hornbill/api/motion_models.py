"""Owns the JSON shapes of motion beyond one command: bursts, streams, take-overs, position unit, faults, step tests."""

from typing import Annotated, Literal

from pydantic import Field

from hornbill.api.models import LeaseView, Model, MotionConfirm, MotionProfile, PositionUnit, UidField


class BurstCommand(Model):
    """One servo's part of a burst."""

    uid: UidField
    type: Literal["angle", "speed", "torque"]
    value: float = Field(allow_inf_nan=False)


class Burst(Model):
    """Commands that leave together, in one ArrayCommand for up to 15 servos. Needs a lease."""

    commands: list[BurstCommand] = Field(min_length=1, max_length=60)
    clamp: bool = False
    confirm: list[MotionConfirm] = Field(default_factory=list[MotionConfirm])


class BurstPart(Model):
    """What one servo was told: the value it really gets, as a 16-bit float holds it."""

    uid: UidField
    value: float
    clamped: bool


class BurstSent(Model):
    """A burst that has left. `start_skew_s`: between the first and the last message of it."""

    sent_at: float
    messages: int
    start_skew_s: float
    commands: list[BurstPart]
    warnings: list[str]


class NewStream(Model):
    """A stream of angles (degrees), speeds (rpm) or torques (%) to servos that are commanded together."""

    uids: list[UidField] = Field(min_length=1, max_length=60)
    type: Literal["angle", "speed", "torque"] = "angle"
    rate_hz: float = Field(default=50.0, gt=0, le=200)


class StreamValues(Model):
    """The newest values by uid; servos that are not named keep theirs."""

    values: dict[str, Annotated[float, Field(allow_inf_nan=False)]] = Field(min_length=1, max_length=60)
    profile: MotionProfile | None = Field(default=None, description="go there at a limited speed, all in one time")


class Stream(Model):
    """A stream and how well it keeps time."""

    id: str
    holder: str
    uids: list[str]
    type: Literal["angle", "speed", "torque"]
    rate_hz: float
    bus_share: float = Field(description="share of the bus it takes, 0..1")
    sent: int = Field(description="bursts sent")
    misses: int = Field(description="slots that passed without a burst in time")
    worst_late_ms: float
    worst_skew_ms: float = Field(description="worst time between first and last message of one burst")
    moving: bool = Field(description="a servo of it is on its way to where a profile takes it")
    ended: str | None = Field(default=None, description="why it ended; null while it runs")


class TakeOver(Model):
    """Asking the holder for motion control."""

    holder: str = Field(min_length=1, max_length=64)
    ttl_s: float = Field(default=2.0, ge=0.5, le=60)
    reason: str = Field(default="", max_length=200)
    patience_s: float = Field(default=10.0, ge=1, le=120, description="without a refusal the lease passes after this")


class TakeOverState(Model):
    """How the asking went. `lease_id` is there once, for whoever asked, when it was granted."""

    id: str
    by: str
    reason: str
    state: Literal["waiting", "granted", "refused", "withdrawn"]
    expires_in_s: float
    lease_id: str | None = None
    holder: LeaseView | None = Field(default=None, description="who is being asked")


class PositionUnitPut(Model):
    """Force a unit, or (null) measure it."""

    unit: PositionUnit | None


class Fault(Model):
    """One fault bit of one servo, now or in the past (section 4.12)."""

    level: Literal["notification", "warning", "failure"]
    group: str
    bit: int
    key: str
    label: str
    advice: str
    active: bool = Field(description="set, as the servo has just said")
    stale: bool = Field(description="set when the servo said so last; whether it still is, is not known now")
    latched: bool = Field(description="active, and known to stay until the servo starts again, whatever its cause does")
    past_event: bool = Field(description="tells of something before the servo's present start, not of a present state")
    first_seen: float = Field(description="seconds since 1970 UTC")
    last_seen: float = Field(description="seconds since 1970 UTC; when it went, to within a poll")
    count: int = Field(description="how often it came up")
    acknowledged_at: float | None = None
    acknowledged_by: str | None = None


class StepTest(Model):
    """A small safe step there and back, repeated. Needs a lease and torque on."""

    step_deg: float = Field(default=5.0, ge=-45, le=45)
    runs: int = Field(default=1, ge=1, le=20)
    dwell_s: float = Field(default=1.0, ge=0.3, le=10, description="how long each side is watched")
    band_deg: float | None = Field(default=None, gt=0, le=10, description="null: 0.5° or the dead band, the larger")
    note: str = Field(default="", max_length=200, description="load, mounting, whatever will matter later")


class StepMetrics(Model):
    """Numbers of one step; times in seconds, each ± `sample_s`; null where the step never got there.

    `hunting_hz`: full swings a second after settling, `hunting_rms_deg` their size.
    """

    sample_s: float
    delay_s: float | None
    rise_s: float | None = Field(description="from 10 % to 90 % of the step")
    crossing_s: float | None = Field(description="until the target is first reached")
    peak_deg: float | None
    overshoot_pct: float | None = Field(description="beyond the target, in % of the step")
    settling_s: float | None = Field(description="until the angle stays within the band")
    steady_state_error_deg: float | None
    peak_speed_rpm: float | None
    hunting: Literal["none", "slight", "hunting"]
    hunting_rms_deg: float | None
    hunting_hz: float | None


class StepTrace(Model):
    """One step: samples from the command on."""

    direction: Literal["there", "back"]
    from_deg: float
    to_deg: float
    t: list[float]
    angle_deg: list[float]
    metrics: StepMetrics


class StepRun(Model):
    """A finished step test, with what it was measured under."""

    id: int
    uid: UidField
    at: float = Field(description="seconds since 1970 UTC")
    note: str
    firmware: str | None
    model: str | None
    voltage_v: float | None
    temperature_c: float | None
    parameters: dict[str, bool | int | float | str | None]
    warnings: list[str]
    step_deg: float
    band_deg: float
    achieved_hz: float
    steps: list[StepTrace]


class RunOverlay(Model):
    """Runs side by side; `differences`: the parameters that are not the same in all of them, in their order."""

    runs: list[StepRun]
    differences: dict[str, list[bool | int | float | str | None]]
