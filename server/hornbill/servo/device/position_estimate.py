"""Estimate: the position unit of one servo, from its Status compared with 0x08. Sends nothing."""

import math
from collections import deque
from typing import Final, Literal, NamedTuple, TypeAlias

from hornbill.domain.fields import known
from hornbill.domain.note import Note
from hornbill.domain.servo import PositionUnit
from hornbill.units import Instant

UnitState: TypeAlias = Literal["assumed", "confirmed", "forced", "conflict"]

HALF_TURN_DEG: Final = 180.0

DEGREES: Final[dict[PositionUnit, float]] = {
    "hundred_degrees": 100.0,
    "radian": 180.0 / math.pi,
    "degree": 1.0,
    "tenth_degree": 0.1,
}
"""Degrees per position of 1.0. Tables 2-21 and 2-22 give "0.001/0.1°", which is 100° and what the maker's program
sends and shows; the public type uavcan.equipment.actuator.Status specifies radians; the other two are plausible
deviations of a firmware."""

NAMES: Final[dict[PositionUnit, str]] = {
    "hundred_degrees": "hundreds of degrees",
    "radian": "radians",
    "degree": "degrees",
    "tenth_degree": "tenths of a degree",
}
"""Names in text."""

LITERAL: Final[PositionUnit] = "hundred_degrees"
"""The maker's unit, the default. It is the largest candidate: if wrong, angles are shown too large, never too small."""

MIN_ANGLE_DEG: Final = 2.0
"""A smaller angle proves nothing: rounding to 0.1° would exceed a tenth of it."""

TOLERANCE_DEG: Final = 0.15
"""0x08 has steps of 0.1°, rounded or truncated, and the horn of a holding servo jitters by half a step."""

MAX_UNCERTAINTY: Final = 0.1
"""Uncertainty of a pair, as a share of the angle. The closest two candidates differ by a factor of 1.7."""

PAIRS_AT_ONE_ANGLE: Final = 5
"""Consecutive pairs that prove a unit at one angle. An angle that happens to fit another unit does so once, while the
horn passes it, not continuously for a second."""

PAIRS_AT_TWO_ANGLES: Final = 3
"""Consecutive pairs that prove it at two angles MIN_ANGLE_DEG apart: only one factor fits both."""

MAX_CONTRADICTIONS: Final = 2
"""Consecutive readings that contradict a unit supported by an earlier one."""

MAX_GAP_S: Final = 0.35
"""Status arrives every 0.1 s (table 2-2). After more than two lost in a row, the horn may have moved anywhere."""

MIN_INTERVAL_S: Final = 0.15
"""Pairs closer in time count as one observation."""

MAX_FLOAT16: Final = 65504.0
"""The largest float16. Status cannot express more, so such a position proves nothing."""

MIN_DIFFERENCE_DEG: Final = 0.3
"""Difference of 0x08 from Status above which 0x08 is read again."""


class Angle(NamedTuple):
    """A reading of 0x08: degrees, and the time of the response."""

    degrees: float
    at: Instant


class _Status(NamedTuple):
    position: float
    at: Instant


class Estimate:
    """Position unit of one servo. Give it every Status with the last reading of 0x08; it compares them at low speed.

    A pair is a reading between the last two of three Statuses that agree on the position, so that a reading slightly
    older than its response also belongs to them.
    """

    __slots__ = (
        "_contradictions",
        "_judged_at",
        "_run",
        "_run_unit",
        "_statuses",
        "clash",
        "evidence",
        "firmware",
        "forced",
        "measured",
        "supported",
    )  # fmt: skip

    def __init__(self, *, forced: PositionUnit | None = None, firmware: int | None = None) -> None:
        self.measured: PositionUnit | None = None
        self.forced: PositionUnit | None = forced
        """The unit set by a user. The measured one is stored separately."""
        self.firmware = firmware
        """Firmware it was measured on (0x52)."""
        self.clash = False
        """Whether pairs fit no unit, or two."""
        self.evidence = Note("The maker's unit, not checked yet: at 0° all units read the same.", "unit_unchecked")
        """Evidence for the measured unit (not for the forced one), for users."""
        self._contradictions = 0
        self.supported = False
        """Whether the last readings at rest agree with the maker's unit, before one is measured."""
        self.forget_motion()

    def forget_motion(self) -> None:
        """Discard recent Statuses: the servo was silent, or another node was on its ID."""
        self._statuses: deque[_Status] = deque(maxlen=3)
        self._judged_at: Instant = -math.inf
        self._run: list[float] = []
        self._run_unit: PositionUnit | None = None

    @property
    def unit(self) -> PositionUnit:
        """The unit in use."""
        return self.forced or self.measured or LITERAL

    @property
    def state(self) -> UnitState:
        """How certain the unit is."""
        if self.forced is not None:
            return "forced"
        if self.clash or self.measured not in (None, LITERAL):
            return "conflict"
        return "assumed" if self.measured is None else "confirmed"

    @property
    def sure(self) -> bool:
        """Whether angles may be commanded in it. False if Status and 0x08 contradict the maker's unit."""
        return self.state != "conflict"

    @property
    def unmeasured(self) -> bool:
        """Whether it has yet to be measured."""
        return self.measured is None and self.forced is None and not self.clash

    @property
    def still(self) -> bool:
        """Whether the last Statuses agree, so that 0x08 read now would form a pair with the next."""
        positions = [status.position for status in self._statuses]
        return len(positions) > 1 and max(positions) - min(positions) <= MAX_UNCERTAINTY / 2 * max(map(abs, positions))

    def shown(self, position: float) -> float | None:
        """Convert a Status position to degrees. None if 0x08 disagrees or was not read yet; 0x08 is shown instead."""
        known = self.forced is not None or (not self.clash and (self.measured is not None or self.supported))
        return position * DEGREES[self.unit] if known else None

    def add_status(self, position: float, at: Instant, reading: Angle | None) -> bool:
        """Add a Status and the last reading of 0x08, if any. True if the estimate changed."""
        last = self._statuses[-1] if self._statuses else None
        if last is not None and at - last.at > MAX_GAP_S:
            self._statuses.clear()
        self._statuses.append(_Status(position, at))
        before, since = (position, at - MAX_GAP_S) if last is None else last
        if reading is None or not since < reading.at <= at:
            return False
        self._compare(before, position, reading.degrees)
        if len(self._statuses) < 3 or reading.at - self._judged_at < MIN_INTERVAL_S:
            return False
        verdict = _unit_of([status.position for status in self._statuses], reading.degrees)
        if verdict == "nothing":
            return False
        self._judged_at = reading.at
        unit = None if verdict == "no_unit" else verdict
        if unit != self._run_unit:
            self._run, self._run_unit = [], unit
        self._run = [*self._run, reading.degrees][-PAIRS_AT_ONE_ANGLE:]
        return self._conclude(position, reading.degrees)

    def _compare(self, before: float, after: float, degrees: float) -> None:
        """Check a reading between two Statuses against the maker's unit, even while the horn turns."""
        low, high = sorted((before * DEGREES[LITERAL], after * DEGREES[LITERAL]))
        slack = TOLERANCE_DEG + abs(degrees) / 4
        if low - slack <= degrees <= high + slack:
            self.supported, self._contradictions = True, 0
        elif high - low <= slack:  # at rest, only a late response explains the difference
            self._contradictions += 1
            self.supported = self.supported and self._contradictions < MAX_CONTRADICTIONS

    def _conclude(self, position: float, degrees: float) -> bool:
        """Update the estimate from consecutive pairs. True if it changed."""
        unit, run = self._run_unit, self._run
        moved = unit is not None and len(run) >= PAIRS_AT_TWO_ANGLES and max(run) - min(run) >= MIN_ANGLE_DEG
        if self.clash or not (moved or len(run) >= PAIRS_AT_ONE_ANGLE) or (unit is not None and unit == self.measured):
            return False
        pairs = f"{len(run)} times in a row, last {position:.6g} in Status and {degrees:.1f}° in 0x08"
        values = known(times=len(run), position=f"{position:.6g}", angle_deg=round(degrees, 1), unit=unit)
        if unit is None:
            self.evidence = Note(f"Status and 0x08 agree in no known unit: {pairs}.", "unit_none_fits", values)
        elif self.measured is not None:
            text = f"Previously measured as {NAMES[self.measured]}, now as {NAMES[unit]}: {pairs}."
            self.evidence = Note(text, "unit_changed", {**values, "before": self.measured})
        else:
            self.measured = unit
            self.evidence = Note(f"Status and 0x08 agreed on {NAMES[unit]} {pairs}.", "unit_agreed", values)
            return True
        self.clash = True
        return True


def _unit_of(positions: list[float], degrees: float) -> "PositionUnit | Literal['no_unit', 'nothing']":
    """The unit in which the positions around a reading agree with it; `nothing` if they prove nothing."""
    low, high = min(positions), max(positions)
    size = max(abs(low), abs(high))
    if abs(degrees) < MIN_ANGLE_DEG or size >= MAX_FLOAT16:
        return "nothing"
    step = _step(size)
    for unit, per_unit in DEGREES.items():
        near = TOLERANCE_DEG + per_unit * step
        if per_unit * low - near <= degrees <= per_unit * high + near:
            return unit if near + per_unit * (high - low) <= MAX_UNCERTAINTY * abs(degrees) else "nothing"
    rested = high - low <= max(2 * step, size * TOLERANCE_DEG / abs(degrees))
    return "no_unit" if rested else "nothing"


def _step(position: float) -> float:
    """Distance between adjacent float16 values at this position: 11 significant bits."""
    return 2.0 ** max(math.frexp(position)[1] - 11, -24)
