"""Restore of a servo from a snapshot, another servo, a profile or the defaults."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any, Final

from hornbill.domain.change import LeftOut, Reason
from hornbill.domain.fields import known
from hornbill.domain.note import Note
from hornbill.errors import BadRequest, InvalidValue
from hornbill.schema import scale
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import Value
from hornbill.servo.configuration.changes import Changes
from hornbill.servo.configuration.writing import Outcome, WriteOptions
from hornbill.servo.device import permission
from hornbill.servo.device.identification import read_rows
from hornbill.servo.device.output import KEY, ON
from hornbill.servo.device.requests import ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.servo.profiles.comparing import Side
from hornbill.servo.profiles.profiles import left_out, not_in
from hornbill.units import Raw

_NEVER_ON: Final = Note(
    "A restore never turns torque on. Restore with save, or turn torque on separately.", "torque_never_on"
)


class Restoring:
    """Selects the values of a side for one servo and writes them atomically through Changes."""

    def __init__(self, requests: ServoRequests, changes: Changes) -> None:
        self._requests = requests
        self._changes = changes

    async def restore(
        self,
        servo: Servo,
        side: Side,
        options: WriteOptions,
        *,
        keys: Sequence[str] | None = None,
        identity: bool = False,
    ) -> tuple[Outcome, list[LeftOut]]:
        """Write (and save) the values of `side`, either for `keys` or for all rows of the servo. Also returns the rows
        left out.

        Without `keys`, torque mode is left out, and identity rows (0x44 to 0x46) unless `identity`. Raises the errors
        of `choose` and Changes.edit before anything is written.
        """
        if servo.model is None:
            raise permission.unknown_series(servo)
        for key in keys or ():
            self._changes.row(servo, key)
        rows = {key: one.parameter for key, one in servo.registers.items()}
        units = [row.unit_when.parameter for row in rows.values() if row.unit_when is not None]
        await read_rows(self._requests, servo, [key for key in units if servo.registers[key].at is None])
        lacks = not_in(servo.model.name, servo.firmware_text)
        values, stay = choose(rows, servo.raws(), side, lacks, keys=keys, identity=identity, save=options.save)
        if not values:
            raise InvalidValue(
                f"No value of {side.title} can be written to {servo.title}. Specify the rows in keys.",
                left_out=[asdict(one) for one in stay],
                cause="nothing_to_write",
                servo=servo.title,
                side=side.title,
            )
        return await self._changes.edit(servo, values, replace(options, reason=_reason(side))), stay


def _reason(side: Side) -> Reason:
    form, _, number = side.name.partition(":")
    params = known(side=side.title, snapshot=int(number) if form == "snapshot" and number.isdigit() else None)
    return Reason(f"restore of {side.title}", "restore", params)


def choose(
    rows: Mapping[str, Parameter],
    known: Mapping[str, Raw | None],
    side: Side,
    lacks: Note,
    *,
    keys: Sequence[str] | None = None,
    identity: bool = False,
    save: bool = False,
) -> tuple[dict[str, Value], list[LeftOut]]:
    """The values of `side` for a servo with these `rows`, and the rows left out, each with the reason.

    `known`: its RAM values, raw. `lacks`: the note for a row that it does not have. Raises OutOfRange or InvalidValue
    if a value is not valid for this model, or 0x36 has another unit. The fact `problems` lists all of them.
    """
    stay: list[LeftOut] = []
    values: dict[str, Value] = {}
    for key in dict.fromkeys(side.values if keys is None else keys):
        value = side.values.get(key)
        why = _why_not(rows, key, side, lacks, identity) if keys is None else _check_named(rows, key, side)
        if key == KEY and keys is not None and value == "on" and known.get(KEY) != ON and not save:
            why = _NEVER_ON
        if why is None:
            values[key] = value
        else:
            stay.append(left_out(key, why))
    _check(rows, known, side, values)
    return values, stay


def _why_not(rows: Mapping[str, Parameter], key: str, side: Side, lacks: Note, identity: bool) -> Note | None:
    """Reason why a row that is not in `keys` is left out."""
    if key not in rows:
        return lacks
    if side.values[key] is None:
        return Note(f"The value in {side.title} is unknown.", "side_unknown", {"side": side.title})
    if rows[key].identity and not identity:
        return Note("The row is specific to one servo. Specify it in keys, or set identity.", "identity_row")
    if key == KEY:
        return Note("A restore does not switch torque. To write off or brake, specify it in keys.", "torque_row")
    return None


def _check_named(rows: Mapping[str, Parameter], key: str, side: Side) -> None:
    if not rows[key].rom or not rows[key].writable:
        raise InvalidValue(
            f"{key} is not a configuration row, so it cannot be restored. Remove it from keys.",
            key=key,
            cause="not_restorable",
        )
    if key not in side.values:
        raise InvalidValue(
            f"{side.title} does not have {key}. Remove it from keys.", key=key, cause="not_in_source", servo=side.title
        )
    if side.values[key] is None:
        raise InvalidValue(
            f"The value of {key} in {side.title} is unknown. Remove it from keys.",
            key=key,
            cause="value_unknown_in_source",
            servo=side.title,
        )


def _check(
    rows: Mapping[str, Parameter], known: Mapping[str, Raw | None], side: Side, values: Mapping[str, Value]
) -> None:
    """Raise all problems of `values` as one error. A single problem is raised unchanged."""
    now = dict(known)
    problems: list[BadRequest] = []
    for key, value in sorted(values.items(), key=lambda item: rows[item[0]].unit_when is not None):
        row = rows[key]
        try:
            _check_unit(row, now, side)
            now[key] = scale.to_raw(row, value, now)
        except BadRequest as error:
            error.facts.setdefault("key", key)
            problems.append(error)
    if not problems:
        return
    listed = [
        {"key": one.facts["key"], "code": one.code, "detail": one.detail, "params": one.params} for one in problems
    ]
    first = problems[0]
    first.facts["problems"] = listed
    if len(problems) == 1:
        raise first
    shown = " ".join(f"{rows[str(one['key'])].label}: {one['detail']}" for one in listed)
    facts: dict[str, Any] = {
        **first.facts, "cause": "rows_invalid", "servo": side.title, "count": len(problems),
        "keys": [one["key"] for one in listed],
    }  # fmt: skip
    raise type(first)(f"{len(listed)} rows of {side.title} are not valid for this servo. {shown}", **facts)


def _check_unit(row: Parameter, known: Mapping[str, Raw | None], side: Side) -> None:
    other = row.unit_when
    stated, unit = side.units.get(row.key), scale.unit_of(row, known)[0]
    if other is not None and stated is not None and stated != unit:
        raise InvalidValue(
            f'{row.label} of {side.title} is in "{stated}", but this servo uses "{unit}" because of '
            f"{other.parameter}. Restore {other.parameter} together with it.",
            unit=unit,
            cause="unit_depends_on_other_row",
            key=row.key,
            servo=side.title,
            stated=stated,
            other=other.parameter,
        )
