"""Owns the refusals before motion: which command a servo may be given now, and the raw value that may be sent."""

from dataclasses import dataclass

from hornbill.errors import (
    BusReadOnly,
    Busy,
    ConfigurationLost,
    ModeOff,
    NoAnswer,
    NotInThisModel,
    OutOfRange,
    TorqueOff,
)
from hornbill.schema import scale
from hornbill.schema.parameter import Parameter
from hornbill.servo.servo import Servo, State
from hornbill.units import Raw

ROW_OF = {"angle": "command_angle", "speed": "command_speed", "torque": "command_torque"}

_WHY_BUSY = {
    State.IDENTIFYING: "is still being identified",
    State.SAVING: "is saving",
    State.RESTARTING: "is restarting",
    State.UPDATING: "is in software update",
    State.SOFT_START: "is in soft start: its horn is on the way to 0°",
    State.PROTECTED: "protects itself: output is off and comes back on by itself",
}


@dataclass(frozen=True, slots=True)
class Target:
    """What may be sent: the row, the raw value, and whether it was clamped.

    `warnings`: what to tell who asked; `confirmed`: the words for which it had to be asked.
    """

    parameter: Parameter
    raw: Raw
    clamped: bool
    warnings: tuple[str, ...] = ()
    confirmed: frozenset[str] = frozenset()


def check_ready(servo: Servo) -> None:
    """Raises NoAnswer for a servo that is offline, Busy for one that is doing something else."""
    state = servo.state
    if state is State.OFFLINE:
        raise NoAnswer(f"{servo.title} is offline. Check its supply and the wiring.")
    why = _WHY_BUSY.get(state)
    if why is not None:
        raise Busy(f"{servo.title} {why}. Wait until it is ready.", state=state.value)


def check_writable(servo: Servo) -> None:
    """As `check_ready`, but a servo that protects itself takes writes: they may be the remedy."""
    if servo.state is not State.PROTECTED:
        check_ready(servo)


def check_movable(servo: Servo) -> None:
    """As `check_ready`; raises BusReadOnly for a servo of a recording, and ConfigurationLost for one that could not
    load what was saved (4.12, features B56).

    On defaults its limits, its zero and its direction may all be others than those its mechanism needs.
    """
    if servo.recorded:
        raise BusReadOnly(f"{servo.title} is one of a recording: nothing moves. Connect its bus: PUT /api/v1/bus.")
    check_ready(servo)
    if servo.rom_lost:
        raise ConfigurationLost(
            f"{servo.title} runs on defaults: what was saved could not be loaded at its last start (warning bit 15). "
            "So it is not moved. Restore a snapshot "
            f"(POST /api/v1/servos/{servo.uid}/snapshots/{{id}}/restore) and save, or save what it holds now."
        )


def row_for(servo: Servo, kind: str) -> Parameter:
    """The row that commands `kind` (angle, speed or torque). Raises NotInThisModel for a servo of unknown model."""
    register = servo.registers.get(ROW_OF[kind])
    if register is None:
        raise NotInThisModel(f"{servo.title} is of no known model, so hornbill does not move it.")
    return register.parameter


def check_mode(servo: Servo, kind: str) -> None:
    """Raises ModeOff or TorqueOff; call it when 0x20 and 0x25 have just been read (sections 4.13, 4.18)."""
    if kind != "angle" and servo.raw("speed_torque_control") != 1:
        raise ModeOff(
            f"{servo.title} ignores {kind} commands: speed and torque control (0x25) is off. "
            f"Switch it on first: PUT /api/v1/servos/{servo.uid}/parameters/speed_torque_control.",
            key="speed_torque_control",
        )
    if servo.raw("torque_mode") != 0:
        raise TorqueOff(
            f"Torque is off on {servo.title}, so it would not move. "
            f'Turn it on first: POST /api/v1/servos/{servo.uid}/torque {{"mode": "on"}}.',
        )


def target(servo: Servo, kind: str, value: float, *, clamp: bool) -> Target:
    """The raw value for a command of `value` degrees, rpm or %.

    Raises OutOfRange outside the row's range or, for angles, the servo's own limits (B31), unless `clamp`;
    InvalidValue between two steps of the register.
    """
    row = row_for(servo, kind)
    low, high = bounds(servo, kind, row)
    if clamp:
        wanted = value * row.per_unit
        return Target(row, round(min(max(wanted, low), high)), clamped=not low - 0.5 < wanted < high + 0.5)
    raw = scale.to_raw(row, value)
    if not low <= raw <= high:
        lowest, highest = low / row.per_unit, high / row.per_unit
        side = "above" if raw > high else "below"
        limit = highest if raw > high else lowest
        raise OutOfRange(
            f"{value:g} {row.unit} is {side} the {limit:g} {row.unit} {servo.title} is limited to. "
            f"Enter {lowest:g} to {highest:g} {row.unit}, or widen the limit first.",
            minimum=lowest, maximum=highest, unit=row.unit, requested=value,
        )  # fmt: skip
    return Target(row, raw, clamped=False)


def bounds(servo: Servo, kind: str, row: Parameter) -> tuple[Raw, Raw]:
    """What the servo would really do: the row's range, cut by the limits that apply to this kind of command."""
    low, high = row.minimum or 0, row.maximum or 0
    limits = {
        "angle": ("angle_limit_ccw", "angle_limit_cw"),
        "speed": ("speed_limit_ccw", "speed_limit_cw"),
        "torque": ("torque_limit_ccw", "torque_limit_cw"),
    }[kind]
    below, above = servo.raw(limits[0]), servo.raw(limits[1])
    return (low if below is None else max(low, below)), (high if above is None else min(high, above))
