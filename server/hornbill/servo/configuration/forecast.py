"""The forecast of a restart: what it does to the horn, and what speaks against it (sections 4.1, 4.11 to 4.14)."""

from collections.abc import Mapping

from hornbill.domain.change import Change, Code, Forecast, ForecastWarning
from hornbill.domain.fields import Param, known
from hornbill.schema import scale
from hornbill.servo.device.output import KEY, MODES, ON
from hornbill.servo.device.servo import Servo
from hornbill.units import Raw

SOFT_START_DEG_S = 180.0
"""30 rpm, the speed of soft start (section 4.14)."""

SOFT_START_MARGIN_S = 0.1
"""How much longer than the way at that speed a soft start may take."""

ARRIVED_DEG = 1.0
"""Soft start ends this near to 0 degrees (section 4.14)."""

Loaded = Mapping[str, Raw | None]
"""What a start brings into RAM, raw by key; None or absent where nobody knows."""


def forecast(servo: Servo, saved: Loaded | None = None) -> Forecast:
    """What a restart does: one that follows a save of `saved`, or one that loads what ROM is known to hold.

    Asks nothing: it is as fresh as what was read last. What is not known is taken to move the horn.
    """
    warnings: list[ForecastWarning] = []
    if servo.rom_lost and saved is not None:
        text = (
            "The servo runs on defaults, because what was saved could not be loaded at its last start. A save makes "
            "them permanent: restore a snapshot first if they are not what you want."
        )
        warnings.append(_warning("defaults_saved", text))
    elif servo.rom_lost:
        text = (
            "What was saved could not be loaded at the last start, and may not be at the next: then it runs on "
            "defaults again. Restore a snapshot and save."
        )
        warnings.append(_warning("rom_lost", text))
    if saved is not None and saved.get(KEY) == ON and servo.raw(KEY) in MODES.values():
        text = "Its output comes on for a moment before ROM is written, and holds the horn where it stands. Keep clear."
        warnings.append(_warning("energised", text))
        warnings += _outside(servo)
    return forecast_of(servo, servo.rom() if saved is None else saved, warnings)


def forecast_params(one: Forecast) -> dict[str, Param]:
    """A forecast as values of a step's evidence."""
    return known(
        horn=one.code,
        from_deg=one.from_deg,
        to_deg=one.to_deg,
        warnings=[warning.code for warning in one.coded_warnings],
    )


def forecast_of(servo: Servo, loaded: Loaded, warnings: list[ForecastWarning] | None = None) -> Forecast:
    """What a restart does that brings `loaded` into RAM. `warnings` come before those that are found here."""
    found = [*(warnings or []), *_warnings(servo, loaded)]
    angle, lost = _angle(servo)
    if lost:
        text = (
            f"Turn count lost: the horn stands at {_deg(angle)}, beyond ±180°, and comes back as "
            f"{_deg(_wrapped(angle))}. The next move may go the other way."
        )
        found.append(_warning("turn_count_lost", text, {"before_deg": angle or 0.0, "after_deg": _wrapped(angle)}))
    start = None if angle is None or _zero_changes(servo, loaded) else _wrapped(angle)
    torque, soft = loaded.get("torque_mode"), loaded.get("soft_start")
    if torque in (1, 2):
        if torque == 2:
            text = "The servo starts on the weak brake, without torque: nothing moves."
            return _forecast("brake", False, start, None, None, lost, text, found)
        text = "The servo starts without torque: nothing moves, and the horn is free."
        return _forecast("no_torque", False, start, None, None, lost, text, found)
    if torque == 0 and soft == 0:
        text = "No soft start: the servo takes hold of its horn where it stands."
        return _forecast("holds", False, start, start, None, lost, text, found)
    if torque is None or soft is None:
        text = (
            "Whether the horn moves is not known, because what ROM holds is not: expect it to go slowly to 0°. "
            "Keep its way clear."
        )
        return _forecast("unknown", True, start, 0.0, _takes(start), lost, text, found)
    if start is None:
        text = "The horn goes slowly (30 rpm) to 0°; from where, as it will count then, is not known."
        return _forecast("unknown_start", True, None, 0.0, None, lost, text, found)
    if abs(start) <= ARRIVED_DEG:
        text = f"The horn stays within {ARRIVED_DEG:.0f}° of 0°, where it is now."
        return _forecast("stays", False, start, 0.0, 0.0, lost, text, found)
    took = _takes(start)
    found += _cut_short(loaded, took or 0.0)
    text = f"The horn goes slowly (30 rpm) from {_deg(start)} to 0°, in about {took} s. Keep its way clear."
    return _forecast("moves", True, start, 0.0, took, lost, text, found)


def _forecast(
    code: Code, moves: bool, from_deg: float | None, to_deg: float | None, takes_s: float | None, lost: bool, text: str,
    found: list[ForecastWarning],
) -> Forecast:  # fmt: skip
    texts = [one.text for one in found]
    return Forecast(code, moves, from_deg, to_deg, takes_s, lost, text, texts, found)


def _warning(code: str, text: str, params: Mapping[str, float] | None = None) -> ForecastWarning:
    return ForecastWarning(code, text, dict(params or {}))


def lost_by_restart(servo: Servo) -> list[Change]:
    """Rows that ROM does not hold as they are configured now: what they hold, and what a restart brings back."""
    values, stored = servo.configuration(), servo.rom()
    found: list[Change] = []
    for key in servo.unsaved():
        one, raw = servo.registers[key], values[key]
        if raw is not None and one.rom is not None:
            held = scale.to_value(one.parameter, raw, values)
            found.append(Change(key, held, scale.to_value(one.parameter, one.rom, stored), held, "planned"))
    return found


def supply_problem(servo: Servo, loaded: Loaded | None = None) -> str | None:
    """Why ROM must not be written at the supply last read (0x0C), or None; limits are those of RAM unless `loaded`.

    Beyond 0x40 or 0x41 the output is off (section 4.8), and a brown-out in the middle of a ROM write loses it (4.11).
    """
    measured, row = servo.raw("current_voltage"), servo.catalog.by_key["current_voltage"]
    low, high = _limits(servo, loaded)
    if measured is None or low is None or high is None or "voltage_limit_lower" not in servo.registers:
        return None
    least = servo.registers["voltage_limit_lower"].parameter.minimum or 0
    if measured < max(low, least):
        return (
            f"The supply of {servo.title} is {scale.to_text(row, measured)}, below the "
            f"{scale.to_text(row, max(low, least))} it needs. "
            "A supply that fails while ROM is written loses what it holds. Raise it, then try again."
        )
    if measured > high:
        return (
            f"The supply of {servo.title} is {scale.to_text(row, measured)}, above its limit of "
            f"{scale.to_text(row, high)}: its output "
            "is off. Lower the supply or widen voltage_limit_upper, then try again."
        )
    return None


def _warnings(servo: Servo, loaded: Loaded) -> list[ForecastWarning]:
    found: list[ForecastWarning] = []
    if loaded.get("torque_mode") in (1, 2):
        text = (
            "Torque is saved as off: after every power-up the servo looks dead until torque is turned on. "
            "Turn torque on before saving if it shall hold by itself."
        )
        found.append(_warning("no_torque_after_start", text))
    if servo.raw("torque_mode") in (0, None):
        text = "There is no torque while the servo is silent and starts anew: a load on the horn may drop. Support it."
        found.append(_warning("load_may_drop", text))
    supply = _supply_warning(servo, loaded)
    if supply is not None:
        found.append(supply)
    return found


def _supply_warning(servo: Servo, loaded: Loaded) -> ForecastWarning | None:
    measured, register = servo.raw("current_voltage"), servo.registers.get("voltage_limit_lower")
    row = servo.catalog.by_key["current_voltage"]
    if measured is None or register is None:
        text = "The supply has not been read. A ROM write needs a steady supply."
        return _warning("supply_unknown", text)
    problem = supply_problem(servo) or supply_problem(servo, loaded)
    if problem is not None:
        return _warning("supply_beyond_limit", problem, {"supply_v": measured / row.per_unit})
    low, high = _limits(servo, loaded)
    least, margin = register.parameter.minimum or 0, 0 if row.limits is None else row.limits.tolerance or 0
    below = max(least, low if low is not None else least)
    if measured - below < margin or (high is not None and high - measured < margin):
        limit = below if measured - below < margin else high or 0
        text = (
            f"The supply is {scale.to_text(row, measured)}, within {scale.to_text(row, margin)} of the limit of "
            f"{scale.to_text(row, limit)}. "
            "A ROM write needs a steady supply: do not let it sag."
        )
        return _warning(
            "supply_near_limit", text, {"supply_v": measured / row.per_unit, "limit_v": limit / row.per_unit}
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


def _cut_short(loaded: Loaded, takes_s: float) -> list[ForecastWarning]:
    """What to say of a soft start that lasts longer than the servo's own timeout, which may end it (section 4.14)."""
    action, time_out = loaded.get("timeout_action"), loaded.get("timeout_time")
    if action not in MODES.values() or time_out is None or takes_s + SOFT_START_MARGIN_S < time_out / 1000:
        return []
    after = time_out / 1000
    text = (
        f"Its own timeout (0x26, 0x27) may take the output {after:g} s after the start: the horn then coasts to rest."
    )
    return [_warning("timeout_on_the_way", text, {"after_s": after})]


def _outside(servo: Servo) -> list[ForecastWarning]:
    """What to say of a horn that stands outside its angle limits, where an output that comes on may move it."""
    angle, _ = _angle(servo)
    low, high = servo.number("angle_limit_ccw"), servo.number("angle_limit_cw")
    if angle is None or low is None or high is None or low <= round(angle, 1) <= high:
        return []
    near = low if angle < low else high
    text = f"The horn stands at {_deg(angle)}, outside its angle limits: it may be moved to {_deg(near)}."
    return [_warning("outside_limits", text, {"angle_deg": angle, "limit_deg": near})]


def _zero_changes(servo: Servo, loaded: Loaded) -> bool:
    """Whether the start brings another zero or direction, so that the present angle says nothing of the way to 0."""
    return any(loaded.get(key) != servo.raw(key) for key, one in servo.registers.items() if one.parameter.moves_horn)


def _wrapped(angle: float | None) -> float:
    """Within −180.0 to +179.9 degrees, as the sensor tells it after a start (section 4.1)."""
    return round(((angle or 0.0) + 180.0) % 360.0 - 180.0, 1)


def _takes(start: float | None) -> float | None:
    return None if start is None else round(abs(start) / SOFT_START_DEG_S, 1)


def _deg(angle: float | None) -> str:
    return "?" if angle is None else scale.with_unit(scale.number(round(angle * 10), 10), "°")
