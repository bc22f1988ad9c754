"""Owns the JSON shapes of motion beyond one command: bursts, streams, take-overs, position unit, faults, step tests."""

from typing import Annotated, Literal

from pydantic import Field

from hornbill.api.models import LeaseView, MotionProfile, PositionUnit, Problem
from hornbill.domain.fields import Model, MotionConfirms, UidField, Utc
from hornbill.domain.servo import Fault, StepMetrics


class BurstCommand(Model):
    """One servo's part of a burst."""

    uid: UidField
    type: Literal["angle", "speed", "torque"] = Field(
        description="Type of the value: angle (°), speed (rpm) or torque (%)."
    )
    value: float = Field(allow_inf_nan=False, description="Angle (°), speed (rpm) or torque (%).")


class Burst(Model):
    """Commands that leave together, in one ArrayCommand for up to 15 servos. Needs a lease."""

    commands: list[BurstCommand] = Field(min_length=1, max_length=60, description="Commands, one per servo.")
    clamp: bool = Field(default=False, description="Move to the nearest legal value instead of refusing.")
    confirm: MotionConfirms


class BurstPart(Model):
    """What one servo was told: the value it really gets, as a 16-bit float holds it."""

    uid: UidField
    value: float = Field(description="Sent value as a 16-bit float: angle (°), speed (rpm) or torque (%).")
    clamped: bool = Field(description="A limit of the servo was sent instead of the requested value.")


class BurstSent(Model):
    """A burst that has left. `start_skew_s`: between the first and the last message of it."""

    sent_at: Utc
    messages: int = Field(description="Number of ArrayCommand messages sent.")
    start_skew_s: float = Field(description="Time between its first and last message, s.")
    commands: list[BurstPart] = Field(description="Command sent to each servo.")
    warnings: list[str] = Field(description="Warnings, one sentence each.")


class NewStream(Model):
    """A stream of angles (degrees), speeds (rpm) or torques (%) to servos that are commanded together."""

    uids: list[UidField] = Field(
        min_length=1, max_length=60, description="Servos that are commanded together, unique IDs."
    )
    type: Literal["angle", "speed", "torque"] = Field(
        default="angle", description="Type of the values: angle (°), speed (rpm) or torque (%)."
    )
    rate_hz: float = Field(default=50.0, gt=0, le=200, description="Bursts per second.")


class StreamValues(Model):
    """The newest values by uid; servos that are not named keep theirs."""

    values: dict[str, Annotated[float, Field(allow_inf_nan=False)]] = Field(
        min_length=1, max_length=60, description="Setpoints by unique ID: angle (°), speed (rpm) or torque (%)."
    )
    profile: MotionProfile | None = Field(
        default=None,
        description="Speed and acceleration of the move. All servos arrive together. Null: without limits.",
    )


class Stream(Model):
    """A stream and how well it keeps time."""

    id: str = Field(description="ID, as used in paths.")
    holder: str = Field(description="Client with motion control.")
    uids: list[str] = Field(description="Servos that are commanded together, unique IDs.")
    type: Literal["angle", "speed", "torque"] = Field(
        description="Type of the values: angle (°), speed (rpm) or torque (%)."
    )
    rate_hz: float = Field(description="Bursts per second.")
    bus_share: float = Field(description="Share of the bus, 0 to 1.")
    sent: int = Field(description="Number of bursts sent.")
    misses: int = Field(description="Number of slots without a burst in time.")
    worst_late_ms: float = Field(description="Greatest delay of a burst, ms.")
    worst_skew_ms: float = Field(description="Longest time between the first and last message of a burst, ms.")
    moving: bool = Field(description="A servo is still following its profile.")
    ended: str | None = Field(default=None, description="Reason why it ended. Null while it runs.")
    ended_summary: str | None = Field(
        default=None, description="`ended` without requests for programs. Null while it runs."
    )


class TakeOver(Model):
    """Asking the holder for motion control."""

    holder: str = Field(
        min_length=1, max_length=64, description="Client that requests motion control, shown to the holder."
    )
    ttl_s: float = Field(default=2.0, ge=0.5, le=60, description="Time to live after each renewal, s.")
    reason: str = Field(default="", max_length=200, description="Reason, shown to users and written to the audit.")
    patience_s: float = Field(
        default=10.0, ge=1, le=120, description="Time after which the lease passes unless refused, s."
    )


class TakeOverState(Model):
    """How the asking went. `lease_id` is there once, for whoever asked, when it was granted."""

    id: str = Field(description="ID, as used in paths.")
    by: str = Field(description="Client that requests motion control.")
    reason: str = Field(description="Reason for the request.")
    state: Literal["waiting", "granted", "refused", "withdrawn"] = Field(description="State of the request.")
    expires_in_s: float = Field(description="Time until it is granted unless refused, s.")
    lease_id: str | None = Field(
        default=None, description="ID of the lease. Returned once, to the client that requested it, when granted."
    )
    holder: LeaseView | None = Field(default=None, description="Current lease. Null if nobody else has motion control.")


class PositionUnitPut(Model):
    """Force a unit, or (null) measure it."""

    unit: PositionUnit | None = Field(description="Unit of position 1.0. Null: measure it.")


class FaultsRead(Model):
    """The fault bits of several servos."""

    servos: dict[str, "ServoFaults"] = Field(description="Results by unique ID.")


class ServoFaults(Model):
    """The fault bits of one of several servos; `problem` instead of them where there is no such servo."""

    faults: list[Fault] = Field(description="Failures, then warnings, then notifications. Active before past.")
    problem: Problem | None = Field(default=None, description="Reason why there are none. Null otherwise.")


class StepTest(Model):
    """A small safe step there and back, repeated. Needs a lease and torque on."""

    step_deg: float = Field(default=5.0, ge=-45, le=45, description="Step size, °. The sign gives the direction.")
    runs: int = Field(default=1, ge=1, le=20, description="Number of repetitions.")
    dwell_s: float = Field(default=1.0, ge=0.3, le=10, description="Time measured on each side, s.")
    band_deg: float | None = Field(
        default=None, gt=0, le=10, description="Settling band, °. Null for 0.5° or the deadband, whichever is larger."
    )
    note: str = Field(default="", max_length=200, description="Note on load, mounting or other conditions.")


class StepTrace(Model):
    """One step: samples from the command on."""

    direction: Literal["there", "back"] = Field(description="Towards the target, or back.")
    from_deg: float = Field(description="Start angle, °.")
    to_deg: float = Field(description="Target angle, °.")
    t: list[float] = Field(description="Time of each sample after the command, s.")
    angle_deg: list[float] = Field(description="Angle of each sample, °.")
    metrics: StepMetrics


class StepRun(Model):
    """A finished step test, with what it was measured under."""

    id: int = Field(description="ID, as used in paths.")
    uid: UidField
    at: float = Field(description="Time of the test, seconds since 1970 UTC.")
    note: str = Field(description="Note of the user.")
    firmware: str | None = Field(description="Firmware version, such as `1.300`. Null if unknown.")
    model: str | None = Field(description="Model, such as `BLA21-06U-A0`. Null if unknown.")
    voltage_v: float | None = Field(description="Supply voltage during the test, V. Null if unknown.")
    temperature_c: float | None = Field(description="Servo temperature during the test, °C. Null if unknown.")
    parameters: dict[str, bool | int | float | str | None] = Field(
        description="Values of all rows during the test, by key."
    )
    warnings: list[str] = Field(description="Warnings, one sentence each.")
    step_deg: float = Field(description="Step size, °.")
    band_deg: float = Field(description="Settling band around the target, °.")
    achieved_hz: float = Field(description="Samples per second.")
    steps: list[StepTrace] = Field(description="Steps in order.")


class RunOverlay(Model):
    """Runs side by side; `differences`: the parameters that are not the same in all of them, in their order."""

    runs: list[StepRun] = Field(description="Runs in the requested order.")
    differences: dict[str, list[bool | int | float | str | None]] = Field(
        description="Rows that differ, one value per run."
    )
