"""Owns the rules over several rows: what must hold of a servo, and between servos, once a change is written."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from hornbill.errors import Conflict, InvalidValue, NeedsConfirmation
from hornbill.schema import scale
from hornbill.schema.parameter import Parameter
from hornbill.units import Raw, Uid

Rows = Mapping[str, Parameter]
Raws = Mapping[str, Raw | None]


@dataclass(frozen=True, slots=True)
class Window:
    """Two limits, the reading that output depends on, and how far that may be wrong, in the reading's unit.

    `word` is what confirms a change that would switch output off now.
    """

    lower: str
    upper: str
    reading: str
    margin: float
    word: str


WINDOWS = (
    Window("voltage_limit_lower", "voltage_limit_upper", "current_voltage", 0.5, "supply"),
    Window("temperature_limit_lower", "temperature_limit_upper", "current_temperature", 5.0, "temperature"),
)
"""Limits with output off outside (sections 4.34, 4.35), and the tolerance of the reading (4.7, 4.8; B92, B93)."""

GIVEN_IDS = {"servo_id": (1, 254), "node_id": (1, 125)}
"""Rows that are one number a servo, and the numbers that can be proposed; 0 is "none yet", which all may share.
Node ids 126 and 127 are for tools (section 4.38)."""


@dataclass(frozen=True, slots=True)
class Claim:
    """A number that somebody has: the owner's uid if it has one, its name, and how it has the number ("in ROM")."""

    number: int
    owner: Uid | None
    title: str
    where: str


def to_read(keys: Collection[str]) -> list[str]:
    """What else must be read before these rows are judged: the other limit, and the reading between the two."""
    wanted: list[str] = []
    for window in WINDOWS:
        if window.lower in keys or window.upper in keys:
            wanted += [key for key in (window.lower, window.upper, window.reading) if key not in keys]
    return wanted


def check_order(rows: Rows, now: Raws, wanted: Mapping[str, Raw]) -> None:
    """Raises InvalidValue when a lower limit would not lie below its upper one, whichever of them is written.

    `now` is what the servo holds, `wanted` what is to be written, both raw by key. Limits that would not change are
    not looked at, nor are those of which one is not known.
    """
    after = {**now, **wanted}
    for window in WINDOWS:
        low, high = after.get(window.lower), after.get(window.upper)
        if low is None or high is None or low < high or not _changes(window, now, wanted):
            continue
        lower, upper = rows[window.lower], rows[window.upper]
        key = window.lower if window.lower in wanted else window.upper
        raise InvalidValue(
            f"{lower.label} ({scale.to_text(lower, low)}) must lie below {upper.label.lower()} "
            f"({scale.to_text(upper, high)}). Change one of the two, or both at once.",
            key=key, keys=[window.lower, window.upper],
        )  # fmt: skip


def check_readings(rows: Rows, now: Raws, wanted: Mapping[str, Raw], confirm: Collection[str]) -> None:
    """Raises NeedsConfirmation when a limit is drawn in so far that output would go off here and now.

    The reading may be wrong by the window's margin, so the limit must keep that distance (B92, B93). A limit that
    is moved outward never asks: it cannot make anything worse.
    """
    for window in WINDOWS:
        if window.word in confirm or window.reading not in rows:
            continue
        reading = now.get(window.reading)
        for key, side in ((window.lower, -1), (window.upper, 1)):
            limit, before = wanted.get(key), now.get(key)
            if limit is None or (before is not None and (limit - before) * side >= 0):
                continue
            _check_side(rows, window, key, side, limit, reading)


def _check_side(rows: Rows, window: Window, key: str, side: int, limit: Raw, reading: Raw | None) -> None:
    row, shown = rows[key], rows[window.reading]
    margin = round(window.margin * shown.per_unit)
    if reading is not None and (limit - reading) * side >= margin:
        return
    tolerance = f"±{window.margin:g} {shown.unit}"
    seen = "is not known" if reading is None else f"is {scale.to_text(shown, reading)} ({tolerance}) now"
    remedy = ""
    if reading is not None:
        bound = "at least" if side > 0 else "at most"
        remedy = f"Enter {bound} {scale.to_text(row, reading + side * margin)}, or send it"
    raise NeedsConfirmation(
        f"{row.label} {scale.to_text(row, limit)} could switch the output off here and now: "
        f"{shown.label.lower()} {seen}. {remedy or 'Send it'} again with confirm: [\"{window.word}\"].",
        confirm=window.word, key=key, requested=limit / row.per_unit,
        reading=None if reading is None else reading / shown.per_unit, margin=window.margin, unit=shown.unit,
    )  # fmt: skip


def check_id(row: Parameter, requested: Raw, claims: Iterable[Claim]) -> None:
    """Raises Conflict when `requested` (a servo id or node id, sections 4.37, 4.38) is among the `claims` of others.

    0, "none yet" and "give me one", belongs to nobody. The remedy is the lowest number that nobody has.
    """
    taken = list(claims)
    claim = next((one for one in taken if one.number == requested), None)
    if requested == 0 or claim is None:
        return
    low, high = GIVEN_IDS[row.key]
    numbers = {one.number for one in taken}
    free = next((number for number in range(low, high + 1) if number not in numbers), None)
    remedy = "None is free: take one away from a servo that is gone" if free is None else f"{free} is free"
    raise Conflict(
        f"{row.label} {requested} belongs to {claim.title} ({claim.where}). {remedy}.",
        key=row.key, requested=requested, owner=claim.owner, owner_title=claim.title, free=free,
    )  # fmt: skip


def _changes(window: Window, now: Raws, wanted: Mapping[str, Raw]) -> bool:
    return any(key in wanted and wanted[key] != now.get(key) for key in (window.lower, window.upper))
