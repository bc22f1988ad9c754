"""Owns Reading: one parameter as people and programs see it, made from a register, its row and the effect rules."""

from dataclasses import dataclass

from hornbill.schema import effect, scale
from hornbill.schema.scale import Value
from hornbill.servo.servo import Register, Servo
from hornbill.servo.timebase import TimeBase
from hornbill.units import Raw

LIVE_PERIOD_S = {"command": 2.5, "status": 5.0, "faults": 2.5}
"""Groups that change by themselves, and the age at which their readings are stale (twice the background poll)."""


@dataclass(frozen=True, slots=True)
class Reading:
    """One parameter of one servo; see `GET …/parameters/{key}` for the meaning of each field."""

    key: str
    address: int
    value: Value
    raw: Raw | None
    unit: str
    at: float | None
    age_s: float | None
    rom: Value
    default: Value
    minimum: float | None
    maximum: float | None
    in_effect: bool | None
    why_not: str | None
    stale: bool


def reading(servo: Servo, key: str, base: TimeBase) -> Reading:
    """The present reading of one row the servo has."""
    register = servo.registers[key]
    row = register.parameter
    values = servo.raws()
    unit, per_unit = scale.unit_of(row, values)
    now = base.now()

    def value(raw: Raw | None) -> Value:
        return None if raw is None else scale.to_value(row, raw, values)

    bounded = row.kind == "number"
    verdict = effect.why_not(servo.catalog, key, values, rows=servo.registers)
    return Reading(
        key=key,
        address=row.address,
        value=value(register.raw),
        raw=register.raw,
        unit=unit,
        at=None if register.at is None else base.utc(register.at),
        age_s=None if register.at is None else round(now - register.at, 3),
        rom=value(register.rom),
        default=value(row.default),
        minimum=row.minimum / per_unit if bounded and row.minimum is not None else None,
        maximum=row.maximum / per_unit if bounded and row.maximum is not None else None,
        in_effect=verdict.in_effect,
        why_not=verdict.why_not,
        stale=_stale(servo, register, now),
    )


def readings(servo: Servo, base: TimeBase) -> dict[str, Reading]:
    """Every row this model and firmware has, in address order."""
    return {key: reading(servo, key, base) for key in servo.registers}


def _stale(servo: Servo, register: Register, now: float) -> bool:
    """Whether the value may no longer be true: never read, read before a restart or silence, or simply too old.

    Configuration changes only when somebody writes it or the servo restarts, so its age alone does not make it
    stale while the servo has been heard all the time.
    """
    if register.at is None or not servo.online:
        return True
    limit = LIVE_PERIOD_S.get(register.parameter.group)
    return limit is not None and now - register.at > limit
