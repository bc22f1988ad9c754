"""Conversion between raw integers and engineering values, and errors for invalid values."""

import math
from collections.abc import Mapping
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Decimal
from typing import Any, TypeAlias

from hornbill.errors import ForbiddenParameter, InvalidValue, OutOfRange
from hornbill.schema.fault import WORD
from hornbill.schema.parameter import DUMMY, Choice, Parameter

Value: TypeAlias = bool | int | float | str | None
Values: TypeAlias = Mapping[str, int | None]

# Arithmetic on tenths has errors of about 1e-8 at the end of the angle range; a real half step is 0.5.
_TOLERANCE = Decimal("1e-6")


def unit_of(parameter: Parameter, values: Values | None = None) -> tuple[str, int]:
    """Unit and raw steps per unit. For 0x36 they depend on the raw value of 0x37 in `values` (4.30).

    If that value is unknown, the unit is that of the row, for the default mode.
    """
    other = parameter.unit_when
    if other is not None and values is not None and values.get(other.parameter) == other.raw:
        return other.unit, other.per_unit
    return parameter.unit, parameter.per_unit


def to_value(parameter: Parameter, raw: int, values: Values | None = None) -> Value:
    """Engineering value of `raw`: a number in the row's unit, the key of a choice, a bool, or None for inactive.

    An unknown choice (or a switch other than 0 or 1) is returned unchanged.
    """
    if parameter.dummy and raw == DUMMY:
        return None
    match parameter.kind:
        case "choice":
            return next((choice.key for choice in parameter.choices if choice.raw == raw), raw)
        case "switch":
            return bool(raw) if raw in (0, 1) else raw
        case "bits":
            return raw & WORD
        case "number":
            per_unit = unit_of(parameter, values)[1]
            return _engineering(raw, per_unit)


def to_raw(parameter: Parameter, value: object, values: Values | None = None) -> int:
    """Raw integer for `value`, which has the form returned by `to_value`.

    Raises OutOfRange (facts minimum, maximum, unit, requested in engineering units), InvalidValue (wrong type, or
    between two steps: fact `nearest`) and ForbiddenParameter for 0x49.
    """
    if parameter.forbidden:
        raise ForbiddenParameter(
            f"{parameter.label} ({parameter.name}) is never written.", key=parameter.key, cause="write_never_allowed"
        )
    match parameter.kind:
        case "choice":
            for choice in _legal(parameter):
                if choice.key == value:
                    return choice.raw
            raise _wrong_kind(parameter, value, allowed(parameter))
        case "switch":
            if isinstance(value, bool):
                return int(value)
            raise _wrong_kind(parameter, value, allowed(parameter))
        case "number" | "bits":
            return _number_to_raw(parameter, value, values)


def to_nearest_raw(parameter: Parameter, value: object) -> int:
    """Nearest raw integer for `value`, for commands: 8.66° in steps of 0.1° is 87. Halves round to even.

    Raises OutOfRange and InvalidValue as `to_raw` does, except between two steps.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not _finite(value):
        raise _wrong_kind(parameter, value, allowed(parameter))
    nearest = (_exactly(value) * parameter.per_unit).to_integral_value(ROUND_HALF_EVEN)
    _check_range(parameter, nearest, value, None)
    return int(nearest)


def to_text(parameter: Parameter, raw: int, values: Values | None = None) -> str:
    """`raw` as text with unit: "4.0 V", "−90.0°", "Brake", "On", "inactive", "0x00000100"."""
    value = to_value(parameter, raw, values)
    if value is None:
        return "inactive"
    if parameter.kind == "bits":
        return f"0x{value:08X}"
    if isinstance(value, bool):
        return "On" if value else "Off"
    if isinstance(value, str):
        return next(choice.label for choice in parameter.choices if choice.key == value)
    unit, per_unit = unit_of(parameter, values)
    return with_unit(number(raw, per_unit), unit if parameter.kind == "number" else "")


def number(raw: int, per_unit: int) -> str:
    """`raw` in engineering units, with the decimals of its step and a true minus sign."""
    decimals = len(str(per_unit)) - 1
    return f"{Decimal(raw) / per_unit:.{decimals}f}".replace("-", "−")


def with_unit(text: str, unit: str) -> str:
    """A number with its unit: the degree sign without, other units with a space."""
    return f"{text}{'' if unit in ('', '°') else ' '}{unit}"


def allowed(parameter: Parameter, values: Values | None = None) -> str:
    """Allowed values as text: "0 to 100 %", "on, off or brake", "true or false"."""
    if parameter.kind == "choice":
        return _listed([choice.key for choice in _legal(parameter)])
    if parameter.kind == "switch":
        return "true or false"
    unit, per_unit = unit_of(parameter, values)
    if parameter.minimum is None or parameter.maximum is None:
        return "a number"
    low, high = number(parameter.minimum, per_unit), number(parameter.maximum, per_unit)
    return with_unit(high, unit) if low == high else with_unit(f"{low} to {high}", unit)


def _number_to_raw(parameter: Parameter, value: object, values: Values | None) -> int:
    unit, per_unit = unit_of(parameter, values)
    if isinstance(value, bool) or not isinstance(value, int | float) or not _finite(value):
        raise _wrong_kind(parameter, value, allowed(parameter, values))
    scaled = _exactly(value) * per_unit
    nearest = scaled.to_integral_value(ROUND_HALF_EVEN)
    exact = abs(scaled - nearest) <= _TOLERANCE
    _check_range(parameter, nearest if exact else scaled, value, values)
    if exact:
        return int(nearest)
    steps = [int(scaled.to_integral_value(rounding)) for rounding in (ROUND_FLOOR, ROUND_CEILING)]
    step = with_unit(number(1, per_unit), unit) if unit else number(1, per_unit)
    remedy = with_unit(" or ".join(number(raw, per_unit) for raw in steps), unit)
    raise InvalidValue(
        f"{with_unit(_shown(value, per_unit), unit)} is between two steps of {step}. Enter {remedy}.",
        requested=value,
        unit=unit,
        nearest=[_engineering(raw, per_unit) for raw in steps],
        cause="between_steps",
    )


def _check_range(parameter: Parameter, scaled: Decimal, value: float, values: Values | None) -> None:
    low, high = parameter.minimum, parameter.maximum
    if low is None or high is None or low <= scaled <= high:
        return
    unit, per_unit = unit_of(parameter, values)
    side, limit = ("below", low) if scaled < low else ("above", high)
    shown, bound = with_unit(_shown(value, per_unit), unit), with_unit(number(limit, per_unit), unit)
    raise OutOfRange(
        f"{shown} is {side} this model's limit of {bound}. Enter {allowed(parameter, values)}.",
        minimum=_engineering(low, per_unit),
        maximum=_engineering(high, per_unit),
        unit=unit,
        requested=value,
        cause="beyond_model_limit",
        key=parameter.key,
    )


def _wrong_kind(parameter: Parameter, value: object, remedy: str) -> InvalidValue:
    facts: dict[str, Any] = {"allowed": [choice.key for choice in _legal(parameter)]} if parameter.choices else {}
    if value is None:
        shown = "empty"
    elif isinstance(value, bool):
        shown = str(value).lower()
    elif isinstance(value, str):
        shown = f'"{value[:40]}"'
    elif isinstance(value, int | float):
        shown = _shown(value, 1)
    else:
        shown = "a list or an object"
    if value is None or isinstance(value, str | int):
        facts["requested"] = value
    return InvalidValue(
        f"{parameter.label} cannot be {shown}. Enter {remedy}.", **facts, cause="wrong_type", key=parameter.key
    )


def _shown(value: float, per_unit: int) -> str:
    """The entered value, with the decimals of a step if exact, otherwise as many as needed."""
    if not _finite(value):
        return "NaN" if math.isnan(value) else "infinite"
    scaled = _exactly(value) * per_unit
    if scaled == scaled.to_integral_value() and abs(scaled) < 10**12:
        return number(int(scaled), per_unit)
    text = f"{value:.10g}" if isinstance(value, float) else f"{Decimal(value):.9e}"
    return text.replace("-", "−")


def _legal(parameter: Parameter) -> list[Choice]:
    """Choices allowed for this model."""
    low, high = parameter.minimum, parameter.maximum
    return [one for one in parameter.choices if low is None or high is None or low <= one.raw <= high]


def _finite(value: float) -> bool:
    return isinstance(value, int) or math.isfinite(value)


def _exactly(value: float) -> Decimal:
    """Exact decimal of a float's shortest representation, so that 0.3 is three tenths, or of an int of any size."""
    return Decimal(value) if isinstance(value, int) else Decimal(repr(float(value)))


def _engineering(raw: int, per_unit: int) -> float | int:
    return raw if per_unit == 1 else raw / per_unit


def _listed(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"
