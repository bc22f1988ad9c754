"""Forecast of a restart: its effect on the horn, and warnings (sections 4.1, 4.11 to 4.14)."""

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
"""Allowance on top of the calculated duration of a soft start."""

ARRIVED_DEG = 1.0
"""Soft start ends within this distance of 0° (section 4.14)."""

Loaded = Mapping[str, Raw | None]
"""Values that a start loads into RAM, raw by key. None or absent if unknown."""


def forecast(servo: Servo, saved: Loaded | None = None) -> Forecast:
    """Effect of a restart after a save of `saved`, or of one that loads the known ROM values.

    Sends nothing; uses the values last read. Unknown values count as moving the horn.
    """
    warnings: list[ForecastWarning] = []
    if servo.rom_lost and saved is not None:
        text = (
            "The servo runs on defaults because its saved values could not be loaded at its last start. A save makes "
            "the defaults permanent. To keep the previous values, restore a snapshot first."
        )
        warnings.append(_warning("defaults_saved", text))
    elif servo.rom_lost:
        text = (
            "The saved values could not be loaded at the last start. If this repeats, the servo runs on defaults "
            "again. Restore a snapshot and save."
        )
        warnings.append(_warning("rom_lost", text))
    if saved is not None and saved.get(KEY) == ON and servo.raw(KEY) in MODES.values():
        text = "The output turns on briefly before ROM is written and holds the horn at its present angle. Keep clear."
        warnings.append(_warning("energised", text))
        warnings += _outside(servo)
    return forecast_of(servo, servo.rom() if saved is None else saved, warnings)


def forecast_params(one: Forecast) -> dict[str, Param]:
    """Parameters of a step's evidence for a forecast."""
    return known(
        horn=one.code,
        from_deg=one.from_deg,
        to_deg=one.to_deg,
        warnings=[warning.code for warning in one.coded_warnings],
    )


def forecast_of(servo: Servo, loaded: Loaded, warnings: list[ForecastWarning] | None = None) -> Forecast:
    """Effect of a restart that loads `loaded` into RAM. `warnings` precede the warnings found here."""
    found = [*(warnings or []), *_warnings(servo, loaded)]
    angle, lost = _angle(servo)
    if lost:
        text = (
            f"The turn count is lost: the horn is at {_deg(angle)}, beyond ±180°, and will read "
            f"{_deg(_wrapped(angle))} after the restart. The next move may go in the other direction."
        )
        found.append(_warning("turn_count_lost", text, {"before_deg": angle or 0.0, "after_deg": _wrapped(angle)}))
    start = None if angle is None or _zero_changes(servo, loaded) else _wrapped(angle)
    torque, soft = loaded.get("torque_mode"), loaded.get("soft_start")
    if torque in (1, 2):
        if torque == 2:
            text = "The servo starts on the weak brake, without torque. The horn does not move."
            return _forecast("brake", False, start, None, None, lost, text, found)
        text = "The servo starts without torque. The horn does not move and can be turned freely."
        return _forecast("no_torque", False, start, None, None, lost, text, found)
    if torque == 0 and soft == 0:
        text = "No soft start: the servo holds the horn at its present angle."
        return _forecast("holds", False, start, start, None, lost, text, found)
    if torque is None or soft is None:
        text = "The ROM values are unknown, so the horn may move. Expect it to turn slowly to 0°. Keep its path clear."
        return _forecast("unknown", True, start, 0.0, _takes(start), lost, text, found)
    if start is None:
        text = "The horn turns slowly (30 rpm) to 0°. Its start angle after the restart is unknown."
        return _forecast("unknown_start", True, None, 0.0, None, lost, text, found)
    if abs(start) <= ARRIVED_DEG:
        text = f"The horn stays at its present angle, within {ARRIVED_DEG:.0f}° of 0°."
        return _forecast("stays", False, start, 0.0, 0.0, lost, text, found)
    took = _takes(start)
    found += _cut_short(loaded, took or 0.0)
    text = f"The horn turns slowly (30 rpm) from {_deg(start)} to 0° in about {took} s. Keep its path clear."
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
    """Rows whose ROM value differs from the configured value, with the value that a restart loads."""
    values, stored = servo.configuration(), servo.rom()
    found: list[Change] = []
    for key in servo.unsaved():
        one, raw = servo.registers[key], values[key]
        if raw is not None and one.rom is not None:
            held = scale.to_value(one.parameter, raw, values)
            found.append(Change(key, held, scale.to_value(one.parameter, one.rom, stored), held, "planned"))
    return found


def supply_problem(servo: Servo, loaded: Loaded | None = None) -> str | None:
    """Reason not to write ROM at the supply voltage last read (0x0C), or None. Limits: from `loaded`, default RAM.

    Beyond 0x40 or 0x41 the output is off (section 4.8). A brown-out during a ROM write loses the ROM (4.11).
    """
    measured, row = servo.raw("current_voltage"), servo.catalog.by_key["current_voltage"]
    low, high = _limits(servo, loaded)
    if measured is None or low is None or high is None or "voltage_limit_lower" not in servo.registers:
        return None
    least = servo.registers["voltage_limit_lower"].parameter.minimum or 0
    if measured < max(low, least):
        return (
            f"The supply of {servo.title} is {scale.to_text(row, measured)}, below its minimum of "
            f"{scale.to_text(row, max(low, least))}. "
            "If the supply fails during a ROM write, the ROM values are lost. Raise the voltage, then try again."
        )
    if measured > high:
        return (
            f"The supply of {servo.title} is {scale.to_text(row, measured)}, above its limit of "
            f"{scale.to_text(row, high)}, so its output "
            "is off. Lower the voltage or raise voltage_limit_upper, then try again."
        )
    return None


def _warnings(servo: Servo, loaded: Loaded) -> list[ForecastWarning]:
    found: list[ForecastWarning] = []
    if loaded.get("torque_mode") in (1, 2):
        text = (
            "Torque is saved as off: after each power-up the servo does not move until torque is turned on. "
            "To have torque after power-up, turn torque on before saving."
        )
        found.append(_warning("no_torque_after_start", text))
    if servo.raw("torque_mode") in (0, None):
        text = "There is no torque during the restart, so a load on the horn may drop. Support it."
        found.append(_warning("load_may_drop", text))
    supply = _supply_warning(servo, loaded)
    if supply is not None:
        found.append(supply)
    return found


def _supply_warning(servo: Servo, loaded: Loaded) -> ForecastWarning | None:
    measured, register = servo.raw("current_voltage"), servo.registers.get("voltage_limit_lower")
    row = servo.catalog.by_key["current_voltage"]
    if measured is None or register is None:
        text = "The supply voltage has not been read. A ROM write needs a stable supply."
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
            "A ROM write needs a stable supply without voltage drops."
        )
        return _warning(
            "supply_near_limit", text, {"supply_v": measured / row.per_unit, "limit_v": limit / row.per_unit}
        )
    return None


def _limits(servo: Servo, loaded: Loaded | None) -> tuple[Raw | None, Raw | None]:
    held = servo.raws() if loaded is None else loaded
    return held.get("voltage_limit_lower"), held.get("voltage_limit_upper")


def _angle(servo: Servo) -> tuple[float | None, bool]:
    """Horn angle with all turns, °, and whether a restart loses turns."""
    register = servo.registers.get("current_angle")
    angle = servo.angle_deg
    if register is not None and register.raw is not None and register.at is not None:
        angle = register.raw / register.parameter.per_unit
    return angle, angle is not None and angle != _wrapped(angle)


def _cut_short(loaded: Loaded, takes_s: float) -> list[ForecastWarning]:
    """Warning for a soft start longer than the servo's own timeout, which may end it (section 4.14)."""
    action, timeout = loaded.get("timeout_action"), loaded.get("timeout_time")
    if action not in MODES.values() or timeout is None or takes_s + SOFT_START_MARGIN_S < timeout / 1000:
        return []
    after = timeout / 1000
    text = (
        f"The servo's timeout (0x26, 0x27) may turn the output off {after:g} s after the start. The horn then coasts "
        "to a stop."
    )
    return [_warning("timeout_during_soft_start", text, {"after_s": after})]


def _outside(servo: Servo) -> list[ForecastWarning]:
    """Warning for a horn outside its angle limits, which may move when the output turns on."""
    angle, _ = _angle(servo)
    low, high = servo.number("angle_limit_ccw"), servo.number("angle_limit_cw")
    if angle is None or low is None or high is None or low <= round(angle, 1) <= high:
        return []
    near = low if angle < low else high
    text = f"The horn is at {_deg(angle)}, outside its angle limits. It may move to {_deg(near)}."
    return [_warning("outside_limits", text, {"angle_deg": angle, "limit_deg": near})]


def _zero_changes(servo: Servo, loaded: Loaded) -> bool:
    """Whether the start changes the zero or the direction, so that the present angle is not the distance to 0°."""
    return any(loaded.get(key) != servo.raw(key) for key, one in servo.registers.items() if one.parameter.moves_horn)


def _wrapped(angle: float | None) -> float:
    """Angle within −180.0 to +179.9°, as the sensor reports it after a start (section 4.1)."""
    return round(((angle or 0.0) + 180.0) % 360.0 - 180.0, 1)


def _takes(start: float | None) -> float | None:
    return None if start is None else round(abs(start) / SOFT_START_DEG_S, 1)


def _deg(angle: float | None) -> str:
    return "?" if angle is None else scale.with_unit(scale.number(round(angle * 10), 10), "°")
