"""Owns the forecast of a restart: what it does to the horn, and what speaks against it (sections 4.1, 4.11 to 4.14)."""

from collections.abc import Mapping
from dataclasses import dataclass

from hornbill.schema import scale
from hornbill.servo.servo import Servo
from hornbill.units import Raw

SOFT_START_DEG_S = 180.0
"""30 rpm, the speed of soft start (section 4.14)."""

ARRIVED_DEG = 1.0
"""Soft start ends this near to 0 degrees (section 4.14)."""

SUPPLY_ERROR_V = 0.5
"""Accuracy of the measured supply (section 4.8): nearer than that to a limit, it may be beyond."""

Loaded = Mapping[str, Raw | None]
"""What a start brings into RAM, raw by key; None or absent where nobody knows."""


@dataclass(frozen=True, slots=True)
class Forecast:
    """What a restart would do to the horn; `takes_s` is about right, angles in degrees within ±180.

    `from_deg` is None where it cannot be known, `to_deg` where the horn is not moved.
    """

    moves: bool
    from_deg: float | None
    to_deg: float | None
    takes_s: float | None
    turn_count_lost: bool
    text: str
    warnings: list[str]


def forecast(servo: Servo, *, as_saved: bool, torque_on: bool = False) -> Forecast:
    """What a restart does. `as_saved`: RAM is written to ROM first (with `torque_on`, and torque on); otherwise what
    ROM is known to hold is loaded.

    Asks nothing: it is as fresh as what was read last. What is not known is taken to move the horn.
    """
    loaded: dict[str, Raw | None] = dict(servo.raws()) if as_saved else dict(servo.rom())
    if as_saved and torque_on:
        loaded["torque_mode"] = 0
    warnings: list[str] = []
    if servo.rom_lost and as_saved:
        warnings.append(
            "The servo runs on defaults, because what was saved could not be loaded at its last start. A save makes "
            "them permanent: restore a snapshot first if they are not what you want."
        )
    elif servo.rom_lost:
        warnings.append(
            "What was saved could not be loaded at the last start, and may not be at the next: then it runs on "
            "defaults again. Restore a snapshot and save."
        )
    return forecast_of(servo, loaded, warnings)


def forecast_of(servo: Servo, loaded: Loaded, warnings: list[str] | None = None) -> Forecast:
    """What a restart does that brings `loaded` into RAM. `warnings` come before those that are found here."""
    found = [*(warnings or []), *_warnings(servo, loaded)]
    angle, lost = _angle(servo)
    if lost:
        found.append(
            f"Turn count lost: the horn stands at {_deg(angle)}, beyond ±180°, and comes back as "
            f"{_deg(_wrapped(angle))}. The next move may go the other way."
        )
    start = None if angle is None or _zero_changes(servo, loaded) else _wrapped(angle)
    torque, soft = loaded.get("torque_mode"), loaded.get("soft_start")
    if torque in (1, 2):
        text = "The servo starts without torque: nothing moves, and the horn is free."
        if torque == 2:
            text = "The servo starts on the weak brake, without torque: nothing moves."
        return Forecast(False, start, None, None, lost, text, found)
    if torque == 0 and soft == 0:
        text = "No soft start: the servo takes hold of its horn where it stands."
        return Forecast(False, start, start, None, lost, text, found)
    if torque is None or soft is None:
        text = (
            "Whether the horn moves is not known, because what ROM holds is not: expect it to go slowly to 0°. "
            "Keep its way clear."
        )
        return Forecast(True, start, 0.0, _takes(start), lost, text, found)
    if start is None:
        text = "The horn goes slowly (30 rpm) to 0°; from where, as it will count then, is not known."
        return Forecast(True, None, 0.0, None, lost, text, found)
    if abs(start) <= ARRIVED_DEG:
        text = f"The horn stays within {ARRIVED_DEG:.0f}° of 0°, where it is now."
        return Forecast(False, start, 0.0, 0.0, lost, text, found)
    took = _takes(start)
    text = f"The horn goes slowly (30 rpm) from {_deg(start)} to 0°, in about {took} s. Keep its way clear."
    return Forecast(True, start, 0.0, took, lost, text, found)


def supply_problem(servo: Servo, loaded: Loaded | None = None) -> str | None:
    """Why ROM must not be written at the supply last read (0x0C), or None; limits are those of RAM unless `loaded`.

    Beyond 0x40 or 0x41 the output is off (section 4.8), and a brown-out in the middle of a ROM write loses it (4.11).
    """
    measured = servo.raw("current_voltage")
    row = servo.registers.get("voltage_limit_lower")
    low, high = _limits(servo, loaded)
    if measured is None or row is None or low is None or high is None:
        return None
    least = row.parameter.minimum or 0
    if measured < max(low, least):
        return (
            f"The supply of {servo.title} is {measured / 10:.1f} V, below the {max(low, least) / 10:.1f} V it needs. "
            "A supply that fails while ROM is written loses what it holds. Raise it, then try again."
        )
    if measured > high:
        return (
            f"The supply of {servo.title} is {measured / 10:.1f} V, above its limit of {high / 10:.1f} V: its output "
            "is off. Lower the supply or widen voltage_limit_upper, then try again."
        )
    return None


def _warnings(servo: Servo, loaded: Loaded) -> list[str]:
    found: list[str] = []
    if loaded.get("torque_mode") in (1, 2):
        found.append(
            "Torque is saved as off: after every power-up the servo looks dead until torque is turned on. "
            "Turn torque on before saving if it shall hold by itself."
        )
    if servo.raw("torque_mode") in (0, None):
        found.append(
            "There is no torque while the servo is silent and starts anew: a load on the horn may drop. Support it."
        )
    supply = _supply_warning(servo, loaded)
    if supply is not None:
        found.append(supply)
    return found


def _supply_warning(servo: Servo, loaded: Loaded) -> str | None:
    measured, register = servo.raw("current_voltage"), servo.registers.get("voltage_limit_lower")
    if measured is None or register is None:
        return "The supply has not been read. A ROM write needs a steady supply."
    problem = supply_problem(servo) or supply_problem(servo, loaded)
    if problem is not None:
        return problem
    low, high = _limits(servo, loaded)
    least, margin = register.parameter.minimum or 0, round(SUPPLY_ERROR_V * 10)
    below = max(least, low if low is not None else least)
    if measured - below < margin or (high is not None and high - measured < margin):
        limit = below if measured - below < margin else high or 0
        return (
            f"The supply is {measured / 10:.1f} V, within {SUPPLY_ERROR_V} V of the limit of {limit / 10:.1f} V. "
            "A ROM write needs a steady supply: do not let it sag."
        )
    return None


def _limits(servo: Servo, loaded: Loaded | None) -> tuple[Raw | None, Raw | None]:
    held = servo.raws() if loaded is None else loaded
    return held.get("voltage_limit_lower"), held.get("voltage_limit_upper")


def _angle(servo: Servo) -> tuple[float | None, bool]:
    """Where the horn stands, in degrees with every turn counted, and whether turns are lost by a restart."""
    register = servo.registers.get("current_angle")
    angle = servo.angle_deg
    if register is not None and register.raw is not None and register.at is not None:
        angle = register.raw / register.parameter.per_unit
    return angle, angle is not None and angle != _wrapped(angle)


def _zero_changes(servo: Servo, loaded: Loaded) -> bool:
    """Whether the start brings another zero or direction, so that the present angle says nothing of the way to 0."""
    return any(loaded.get(key) != servo.raw(key) for key in ("origin", "reverse") if key in servo.registers)


def _wrapped(angle: float | None) -> float:
    """Within −180.0 to +179.9 degrees, as the sensor tells it after a start (section 4.1)."""
    return round(((angle or 0.0) + 180.0) % 360.0 - 180.0, 1)


def _takes(start: float | None) -> float | None:
    return None if start is None else round(abs(start) / SOFT_START_DEG_S, 1)


def _deg(angle: float | None) -> str:
    return "?" if angle is None else scale.with_unit(scale.number(round(angle * 10), 10), "°")
