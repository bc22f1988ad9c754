"""Reading of a parameter as shown to users and programs: register, row, and whether it has an effect now."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from hornbill.domain.servo import Reading
from hornbill.schema import effect, scale
from hornbill.schema.effect import COMMANDS, Effect, LastCommand, Why
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import Value
from hornbill.servo.device.servo import Register, Servo
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant, Raw
from hornbill.wire.messages import Mode

LIVE_PERIOD_S = {"command": 2.5, "status": 5.0, "faults": 2.5}
"""Groups whose values change on their own, and the age at which readings are stale, s (twice the background period)."""

ANGLE_STALE_S: Final = 0.5
"""Age at which an angle is stale. Status arrives every 0.1 s, and a WebSocket of a full bus is updated every 0.25 s."""

STALE_AFTER_S: Final = {"angle": ANGLE_STALE_S, **LIVE_PERIOD_S}
"""Staleness limits for clients, s."""


@dataclass(frozen=True, slots=True)
class Circumstance:
    """A state of a servo in which certain `rows` have no effect.

    `why` completes "No effect now: …", `reason` is its code. Effects of other registers are in schemas/effects.toml.
    """

    applies: Callable[[Servo], bool]
    rows: Callable[[Parameter], bool]
    why: str
    section: str
    reason: Why


def _beyond_limits_of(reading: str) -> Callable[[Servo], bool]:
    return lambda servo: any(servo.catalog.protections[bit][0] == reading for bit in servo.beyond_limits)


def _shapes_output(row: Parameter) -> bool:
    return row.shapes_output


def _updating(servo: Servo) -> bool:
    return servo.status is not None and servo.status.mode == Mode.SOFTWARE_UPDATE


CIRCUMSTANCES: Final = (
    Circumstance(_updating, lambda row: row.writable, "the servo's software is being replaced", "2.2",
                 Why("software_update")),
    Circumstance(
        lambda servo: servo.output_failed, _shapes_output,
        "the servo reports a failure (0x1B) that leaves the motor without output", "4.12",
        Why("motor_failure", {"parameter": "fault_failure"}),
    ),
    Circumstance(
        _beyond_limits_of("current_temperature"), _shapes_output,
        "output is off while the temperature (0x0B) is outside its limits; it returns automatically, "
        "without the last command", "4.7", Why("temperature", {"parameter": "current_temperature"}),
    ),
    Circumstance(
        _beyond_limits_of("current_voltage"), _shapes_output,
        "output is off while the supply voltage (0x0C) is outside its limits; it returns automatically, "
        "without the last command", "4.8", Why("supply", {"parameter": "current_voltage"}),
    ),
    Circumstance(
        lambda servo: servo.soft_starting, lambda row: row.soft_start is not None,
        "soft start (0x21) overrides it until the horn is at 0°", "4.14",
        Why("soft_start", {"parameter": "soft_start"}),
    ),
    Circumstance(
        lambda servo: servo.rom_lost, lambda row: row.key in COMMANDS,
        "the saved configuration could not be loaded (0x1A), so motion is refused", "4.12",
        Why("configuration_lost", {"parameter": "fault_warning"}),
    ),
)  # fmt: skip
"""In order of precedence: the first that applies gives the reason."""


def reading(servo: Servo, key: str, base: TimeBase) -> Reading:
    """Current reading of one row of a servo."""
    return readings(servo, base, (key,))[key]


def readings(servo: Servo, base: TimeBase, keys: Iterable[str] | None = None) -> dict[str, Reading]:
    """Current readings of rows of a servo, in address order; all rows by default."""
    values, now = servo.raws(), base.now()
    found = _verdicts(servo, servo.registers if keys is None else keys, values)
    return {key: _reading(servo, key, base, now, values, effect) for key, effect in found.items()}


def _reading(
    servo: Servo, key: str, base: TimeBase, now: Instant, values: Mapping[str, Raw | None], found: Effect
) -> Reading:
    register = servo.registers[key]
    row = register.parameter
    unit, per_unit = scale.unit_of(row, values)

    def value(raw: Raw | None) -> Value:
        return None if raw is None else scale.to_value(row, raw, values)

    bounded = row.kind == "number"
    return Reading(
        key=key,
        address=row.address,
        value=value(register.raw),
        raw=register.raw,
        unit=unit,
        at=None if register.at is None else base.utc(register.at),
        age_s=None if register.at is None else round(now - register.at, 3),
        rom=value(register.rom),
        configured=value(servo.configured(key)),
        default=value(row.default),
        minimum=row.minimum / per_unit if bounded and row.minimum is not None else None,
        maximum=row.maximum / per_unit if bounded and row.maximum is not None else None,
        in_effect=found.in_effect,
        why_not=found.why_not,
        why=found.why,
        stale=is_stale(servo, register, now),
        differs_from_default=_differs_from_default(servo, register),
        unsaved=servo.differs_from_rom(key),
    )


def verdicts(servo: Servo, keys: Iterable[str]) -> dict[str, Effect]:
    """Whether rows of a servo are in effect now. Its state takes precedence over its registers."""
    return _verdicts(servo, keys, servo.raws())


def _verdicts(servo: Servo, keys: Iterable[str], values: Mapping[str, Raw | None]) -> dict[str, Effect]:
    applying = [one for one in CIRCUMSTANCES if one.applies(servo)]
    rows = servo.registers
    last = effect.in_force(values, rows)
    return {key: _verdict(servo, rows[key], applying, values, last) for key in keys}


def _verdict(
    servo: Servo,
    register: Register,
    applying: Iterable[Circumstance],
    values: Mapping[str, Raw | None],
    last: LastCommand | None,
) -> Effect:
    row = register.parameter
    if row.writable and not servo.online:
        return Effect(None, "Effect unknown: the servo is offline.", Why("offline"))
    for one in applying:
        if one.rows(row):
            return Effect(False, f"No effect now: {one.why}.", one.reason)
    if row.after_restart:
        return _since_the_start(servo, register)
    return effect.why_not(servo.catalog, row.key, values, last, rows=servo.registers)


def circumstances(servo: Servo) -> tuple[object, ...]:
    """The part of a servo's state that decides verdicts. While it is unchanged, only registers can change them."""
    return (servo.online, servo.node_id, *(one.applies(servo) for one in CIRCUMSTANCES))


def _since_the_start(servo: Servo, register: Register) -> Effect:
    """Effect of rows that the servo evaluates only at its start, from ROM (sections 4.11, 4.14, 4.38)."""
    raw, rom = register.raw, register.rom
    if rom is None and register.parameter.key == "node_id" and raw:
        rom = servo.node_id  # a fixed node ID is either in use or not
    if raw is None or rom is None:
        missing = "has not been read" if raw is None else "in ROM, which the servo started with, is unknown"
        why = Why("not_read" if raw is None else "rom_unknown", {"parameter": register.parameter.key})
        return Effect(None, f"Effect unknown: {register.parameter.label.lower()} {missing}.", why)
    if raw != rom:
        return Effect(False, "No effect now: takes effect at the next start after a save.", Why("not_saved"))
    return Effect(True, None)


def _differs_from_default(servo: Servo, register: Register) -> bool | None:
    """For rows stored in ROM. None while soft start overrides the value."""
    row = register.parameter
    value = servo.configured(row.key)
    if not row.rom or row.default is None or value is None:
        return None
    return None if servo.temporary(row.key) else value != row.default


def is_stale(servo: Servo, register: Register, now: float) -> bool:
    """Whether the value may be out of date: never read, read before a restart or going offline, or too old.

    Configuration changes only by a write or a restart, so age alone does not make it stale while the servo has stayed
    online.
    """
    if register.at is None or not servo.online:
        return True
    limit = LIVE_PERIOD_S.get(register.parameter.group)
    return limit is not None and now - register.at > limit
