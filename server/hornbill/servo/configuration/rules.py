"""Rules across rows and servos that a change must satisfy."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from hornbill.errors import Conflict, NeedsConfirmation
from hornbill.schema import scale
from hornbill.schema.parameter import Limits, Parameter
from hornbill.units import Raw, Uid

Rows = Mapping[str, Parameter]
Raws = Mapping[str, Raw | None]


TURN_DEG = 360

MULTI_TURN = "multi_turn"
"""Confirms an angle limit beyond ±180°."""


@dataclass(frozen=True, slots=True)
class Claim:
    """A number in use: unique ID of the owner if known, its title, and where the number is used ("in ROM")."""

    number: int
    owner: Uid | None
    title: str
    where: str


def to_read(rows: Rows, keys: Collection[str]) -> list[str]:
    """Other rows to read before these are checked: the readings that their limits apply to."""
    found = _with_output_off_outside(rows)
    return [row.key for row, limits in found if row.key not in keys and {limits.lower, limits.upper} & {*keys}]


def check_readings(rows: Rows, now: Raws, wanted: Mapping[str, Raw], confirm: Collection[str]) -> None:
    """Raises NeedsConfirmation if a tightened limit would switch the output off immediately.

    The reading has a tolerance, so the limit must keep that distance from it (B92, B93). Widening a limit needs no
    confirmation.
    """
    for shown, limits in _with_output_off_outside(rows):
        if limits.confirm in confirm:
            continue
        for key, side in ((limits.lower, -1), (limits.upper, 1)):
            limit, before = wanted.get(key), now.get(key)
            if limit is None or (before is not None and (limit - before) * side >= 0):
                continue
            _check_side(rows[key], shown, limits, side, limit, now.get(shown.key))


def _with_output_off_outside(rows: Rows) -> list[tuple[Parameter, Limits]]:
    """Readings with limits beyond which the output goes off (sections 4.34, 4.35).

    The ranges of two limits share one value, so a lower limit cannot exceed its upper limit.
    """
    return [(row, row.limits) for row in rows.values() if row.limits is not None and row.limits.tolerance is not None]


def check_turns(rows: Rows, now: Raws, wanted: Mapping[str, Raw], confirm: Collection[str]) -> None:
    """Raises NeedsConfirmation if an angle limit is widened beyond ±180°.

    Beyond ±180° the servo counts turns instead of sensing the angle, and loses the count at power-off (sections 4.1,
    4.31).
    """
    if MULTI_TURN in confirm:
        return
    limits = rows["command_angle"].limits if "command_angle" in rows else None
    for key in () if limits is None else (limits.upper, limits.lower):
        limit, before = wanted.get(key), now.get(key)
        if limit is None or (before is not None and abs(limit) <= abs(before)):
            continue
        row, turns = rows[key], abs(limit) / rows[key].per_unit / TURN_DEG
        if turns <= 0.5:
            continue
        turns = round(turns, 1)
        raise NeedsConfirmation(
            f"{row.label} {scale.to_text(row, limit)} is {turns:g} turns. Beyond ±180° the servo counts turns, and the "
            "count is lost at power-off.",
            confirm=MULTI_TURN, key=key, requested=limit / row.per_unit, turns=turns, unit=row.unit,
            cause="beyond_half_turn",
        )  # fmt: skip


def _check_side(row: Parameter, shown: Parameter, limits: Limits, side: int, limit: Raw, reading: Raw | None) -> None:
    margin = limits.tolerance or 0
    if reading is not None and (limit - reading) * side >= margin:
        return
    tolerance = f"±{margin / shown.per_unit:g} {shown.unit}"
    seen = "is unknown" if reading is None else f"is now {scale.to_text(shown, reading)} ({tolerance})"
    remedy = ""
    if reading is not None:
        bound = "at least" if side > 0 else "at most"
        remedy = f" Enter {bound} {scale.to_text(row, reading + side * margin)}."
    raise NeedsConfirmation(
        f"{row.label} {scale.to_text(row, limit)} could switch the output off immediately: "
        f"{shown.label.lower()} {seen}.{remedy}",
        confirm=limits.confirm, key=row.key, requested=limit / row.per_unit,
        reading=None if reading is None else reading / shown.per_unit, margin=margin / shown.per_unit, unit=shown.unit,
        cause="could_switch_off",
    )  # fmt: skip


def first_free(row: Parameter, taken: Collection[int]) -> int | None:
    """The lowest free number for a row of unique numbers, or None."""
    if row.unique is None:
        return None
    return next((number for number in range(row.unique.lowest, row.unique.highest + 1) if number not in taken), None)


def check_id(row: Parameter, requested: Raw, claims: Iterable[Claim]) -> None:
    """Raises Conflict if `requested` (a servo ID or node ID, sections 4.37, 4.38) is among the `claims` of others.

    0 means unassigned or dynamic and is never in use. The error proposes the lowest free number.
    """
    taken = list(claims)
    claim = next((one for one in taken if one.number == requested), None)
    if requested == 0 or claim is None:
        return
    free = first_free(row, {one.number for one in taken})
    remedy = "No number is free. Forget a servo that is no longer used" if free is None else f"{free} is free"
    raise Conflict(
        f"{row.label} {requested} is in use by {claim.title} ({claim.where}). {remedy}.",
        key=row.key, requested=requested, owner=claim.owner, owner_title=claim.title, free=free,
        cause="id_in_use", where=claim.where,
    )  # fmt: skip
