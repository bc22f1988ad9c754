"""Checks before motion: whether a servo may be commanded now, and the raw value that may be sent."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from hornbill.errors import (
    BusReadOnly,
    Busy,
    ConfigurationLost,
    ModeOff,
    NoResponse,
    NotInThisModel,
    OutOfRange,
    TorqueOff,
)
from hornbill.schema import scale
from hornbill.schema.effect import COMMANDS
from hornbill.schema.parameter import Parameter
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.runtime.jobs import Jobs
from hornbill.units import Raw

ROW_OF: Final[Mapping[str, str]] = {kind: key for key, kind in COMMANDS.items()}
"""Row of each kind of command."""

_WHY_BUSY = {
    State.IDENTIFYING: "is still being identified",
    State.SAVING: "is saving",
    State.RESTARTING: "is restarting",
    State.UPDATING: "is in software update",
    State.SOFT_START: "is in soft start: its horn is moving to 0°",
    State.PROTECTED: "is in protection: output is off and returns automatically",
}

_OFFLINE = "{} is offline. Check its supply and the wiring."


@dataclass(frozen=True, slots=True)
class Target:
    """A permitted command: the row, the raw value, and whether it was clamped.

    `warnings`: texts for the client; `confirmed`: the codes that the client had to confirm.
    """

    parameter: Parameter
    raw: Raw
    clamped: bool
    warnings: tuple[str, ...] = ()
    confirmed: frozenset[str] = frozenset()


def check_free(servo: Servo, jobs: Jobs) -> None:
    """Raises Busy while a job of the servo (even a queued one) or a change is running."""
    if jobs.running(servo.uid) is not None or servo.changing.locked():
        raise Busy(
            f"{servo.title} is busy with a job or a change. Try again when it has ended.",
            uid=servo.uid,
            cause="job_in_progress",
            servo=servo.title,
        )


def check_ready(servo: Servo) -> None:
    """Raises NoResponse if the servo is offline, Busy if it is not ready."""
    state = servo.state
    if state is State.OFFLINE:
        raise NoResponse(_OFFLINE.format(servo.title), cause="offline", servo=servo.title)
    why = _WHY_BUSY.get(state)
    if why is not None:
        raise Busy(
            f"{servo.title} {why}. Wait until it is ready.", state=state.value, cause="not_ready", servo=servo.title
        )


def check_readable(servo: Servo) -> None:
    """As `check_ready`, but a servo in protection passes: it can be read."""
    if servo.state is not State.PROTECTED:
        check_ready(servo)


def check_writable(servo: Servo) -> None:
    """As `check_ready`, but a servo in protection passes: a write may be the remedy.

    Raises NotInThisModel for a servo of an unknown series, and Busy while rows have temporary values that could not be
    restored yet.
    """
    check_readable(servo)
    check_series(servo)
    _check_owed(servo)


def check_restartable(servo: Servo) -> None:
    """As `check_writable`, but rows with temporary values pass: a restart restores them."""
    check_readable(servo)
    check_series(servo)


def _check_owed(servo: Servo) -> None:
    """Raises Busy while rows have temporary values that could not be restored yet."""
    if servo.owed:
        raise Busy(
            f"{servo.title} has temporary values that could not be restored yet: {', '.join(servo.owed)}. hornbill "
            "restores them as soon as the servo responds. Check its supply and wiring, or restart it.",
            cause="values_owed",
            servo=servo.title,
            keys=servo.owed,
        )


def check_series(servo: Servo) -> None:
    """Raises NotInThisModel for a servo of an unknown series, because its registers and limits are unknown."""
    if servo.of_unknown_series:
        raise unknown_series(servo)


def unknown_series(servo: Servo) -> NotInThisModel:
    """The error for writes and motion on a servo of an unknown series, with the remedy."""
    number = servo.model_number
    return NotInThisModel(
        f"{servo.title} is of series {number} (0x50), which this version of hornbill does not support. Motion and "
        "writes other than torque off are refused; reading, snapshots and comparison are possible. Use a version that "
        f"supports series {number}, or Futaba's own program.",
        series_number=number,
        cause="unknown_series",
        servo=servo.title,
    )


def check_movable(servo: Servo) -> None:
    """As `check_ready`; also raises BusReadOnly for a servo of a recording, and ConfigurationLost for one that could
    not load its saved configuration (4.12, features B56).

    With defaults, its limits, zero position and direction may not fit its mechanism.
    """
    _check_recorded(servo)
    check_ready(servo)
    _check_owed(servo)
    _check_loaded(servo)


def check_energise(servo: Servo) -> None:
    """As `check_movable`, for a job that works on the servo itself: the state caused by that job is ignored."""
    _check_recorded(servo)
    row_for(servo, "angle")
    if not servo.online:
        raise NoResponse(_OFFLINE.format(servo.title), cause="offline", servo=servo.title)
    if servo.beyond_limits:
        raise Busy(
            f"{servo.title} {_WHY_BUSY[State.PROTECTED]}. Wait until it is ready.",
            state=State.PROTECTED.value,
            cause="not_ready",
            servo=servo.title,
        )
    _check_loaded(servo)


def _check_recorded(servo: Servo) -> None:
    if servo.recorded:
        raise BusReadOnly(
            f"{servo.title} is part of a recording and cannot move. Connect its bus.",
            cause="recorded_servo",
            servo=servo.title,
        )


def _check_loaded(servo: Servo) -> None:
    if servo.rom_lost:
        raise ConfigurationLost(
            f"{servo.title} runs on defaults: its saved configuration could not be loaded at the last start "
            "(warning bit 15). Motion is refused. Restore a snapshot and save, or save the current values.",
            cause="runs_on_defaults",
            servo=servo.title,
            uid=servo.uid,
        )


def row_for(servo: Servo, kind: str) -> Parameter:
    """Command row of `kind` (angle, speed, torque). Raises NotInThisModel for a servo of unknown series."""
    check_series(servo)
    register = servo.registers.get(ROW_OF[kind])
    if register is None:
        raise NotInThisModel(
            f"{servo.title} has not been identified yet, so it cannot be moved.",
            cause="not_identified",
            servo=servo.title,
        )
    return register.parameter


def check_kind(servo: Servo, kind: str) -> None:
    """Raises NotInThisModel if its series is unknown or its firmware has no commands of that kind (4.18)."""
    row_for(servo, kind)
    switch = servo.catalog.by_key["speed_torque_control"]
    if kind != "angle" and switch.key not in servo.registers:
        raise NotInThisModel(
            f"{servo.title} does not support {kind} commands: firmware {servo.firmware_text} has no speed and torque "
            f"control (0x25). It was added in {switch.since}. Command an angle instead.",
            key=switch.key,
            cause="commands_unsupported",
            servo=servo.title,
            kind=kind,
            since=switch.since,
        )


def check_mode(servo: Servo, kind: str) -> None:
    """As `check_enabled`, or raises TorqueOff. Call after reading 0x20 and 0x25 (4.13, 4.18)."""
    check_enabled(servo, kind)
    if servo.raw("torque_mode") != 0:
        raise TorqueOff(
            f"Torque is off on {servo.title}, so it would not move. Turn torque on first.",
            cause="torque_is_off",
            servo=servo.title,
            uid=servo.uid,
        )


def check_enabled(servo: Servo, kind: str) -> None:
    """Raises NotInThisModel or ModeOff. Call after reading 0x25 (4.18)."""
    check_kind(servo, kind)
    if kind != "angle" and servo.raw("speed_torque_control") != 1:
        raise ModeOff(
            f"{servo.title} ignores {kind} commands: speed and torque control (0x25) is off. Turn it on first.",
            key="speed_torque_control",
            cause="mode_off",
            servo=servo.title,
            uid=servo.uid,
            kind=kind,
        )


def target(servo: Servo, kind: str, value: float, *, clamp: bool) -> Target:
    """The raw value of a command of `value` degrees, rpm or %, rounded to the register's step.

    Raises OutOfRange outside the row's range or, for angles, outside the servo's own limits (B31), unless `clamp`.
    """
    row = row_for(servo, kind)
    low, high = bounds(servo, row)
    if clamp:
        wanted = value * row.per_unit
        return Target(row, round(min(max(wanted, low), high)), clamped=not low - 0.5 < wanted < high + 0.5)
    raw = scale.to_nearest_raw(row, value)
    if not low <= raw <= high:
        raise _beyond_limit(servo, row, value, raw)
    return Target(row, raw, clamped=False)


def bounds(servo: Servo, row: Parameter) -> tuple[Raw, Raw]:
    """The effective range: the row's range within the servo's own limits (4.31 to 4.33)."""
    low, high = row.minimum or 0, row.maximum or 0
    if row.limits is None:
        return low, high
    below, above = servo.raw(row.limits.lower), servo.raw(row.limits.upper)
    return (low if below is None else max(low, below)), (high if above is None else min(high, above))


def _beyond_limit(servo: Servo, row: Parameter, value: float, raw: Raw) -> OutOfRange:
    """The error for a value within the row's range but beyond a limit of the servo, naming that limit."""
    low, high = bounds(servo, row)
    assert row.limits is not None
    key, limit = (row.limits.upper, high) if raw > high else (row.limits.lower, low)
    name = servo.registers[key].parameter
    lowest, highest = scale.to_text(row, low), scale.to_text(row, high)
    return OutOfRange(
        f"{scale.to_text(row, raw)} is beyond the {name.label} of {servo.title}, {scale.to_text(row, limit)} "
        f"({name.name}). Enter {lowest} to {highest}, or change that limit first.",
        minimum=low / row.per_unit, maximum=high / row.per_unit, unit=row.unit, requested=value, limit=key,
        cause="beyond_servo_limit", servo=servo.title, key=row.key,
    )  # fmt: skip
