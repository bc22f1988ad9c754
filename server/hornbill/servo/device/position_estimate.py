"""Estimate: which unit the positions of one servo are in, checked by its Status beside 0x08. Asks nobody."""

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
"""Degrees in a position of 1.0. Tables 2-21 and 2-22 print "0.001/0.1°", which is 100° and what the maker's own program
sends and shows; the public type uavcan.equipment.actuator.Status says radian; the other two are what else a firmware
may have made of it."""

NAMES: Final[dict[PositionUnit, str]] = {
    "hundred_degrees": "hundreds of degrees",
    "radian": "radians",
    "degree": "degrees",
    "tenth_degree": "tenths of a degree",
}
"""What to call them in a sentence."""

LITERAL: Final[PositionUnit] = "hundred_degrees"
"""The maker's unit, taken as given. No candidate is larger: taken wrongly it shows too much, never too little."""

MIN_ANGLE_DEG: Final = 2.0
"""Below this an angle proves nothing: rounding to 0.1° would be more than a tenth of it."""

TOLERANCE_DEG: Final = 0.15
"""0x08 is in steps of 0.1°, rounded or cut off, and the horn of a holding servo trembles by half a step."""

MAX_UNCERTAINTY: Final = 0.1
"""What a pair leaves open may be a tenth of the angle at most; the closest two candidates are 1.7 apart."""

PAIRS_AT_ONE_ANGLE: Final = 5
"""Pairs in a row that prove a unit at one angle: an angle that happens to fit another unit does so once, while the
horn passes, and not every time for a second."""

PAIRS_AT_TWO_ANGLES: Final = 3
"""Pairs in a row that prove it when the horn stood at two angles MIN_ANGLE_DEG apart meanwhile: only a factor fits both."""

MAX_CONTRADICTIONS: Final = 2
"""Readings in a row that disagree with a unit which one has borne out."""

MAX_GAP_S: Final = 0.35
"""Status comes every 0.1 s (table 2-2); when more than two in a row were lost the horn may have been anywhere."""

MIN_INTERVAL_S: Final = 0.15
"""Pairs nearer than this are one observation."""

MAX_FLOAT16: Final = 65504.0
"""The largest float16. A servo has reached the end of what Status can say, so such a position proves nothing."""

MIN_DIFFERENCE_DEG: Final = 0.3
"""By so much 0x08 may differ from Status before it is worth another look."""


class Angle(NamedTuple):
    """0x08 as it was read: degrees, and when the answer came."""

    degrees: float
    at: Instant


class _Status(NamedTuple):
    position: float
    at: Instant


class Estimate:
    """Feed it every Status with the last reading of 0x08. It compares the two while the horn is at rest or slow.

    A pair is a reading between the last two of three Statuses that agree about where the horn is, so that a reading
    that is somewhat older than its answer belongs to them as well.
    """

    __slots__ = (
        "_contradictions", "_statuses", "_judged_at", "_run", "_run_unit", "supported", "clash", "evidence", "firmware", "forced",
        "measured",
    )  # fmt: skip

    def __init__(self, *, forced: PositionUnit | None = None, firmware: int | None = None) -> None:
        self.measured: PositionUnit | None = None
        self.forced: PositionUnit | None = forced
        """Somebody said which it is; what is measured is kept beside it."""
        self.firmware = firmware
        """The firmware it is measured on (0x52)."""
        self.clash = False
        """Pairs fit no unit, or two."""
        self.evidence = Note("The maker's unit, not checked yet: at 0° every unit reads the same.", "unit_unchecked")
        """How that is known, for people; of what was measured, not of what is forced."""
        self._contradictions = 0
        self.supported = False
        """Whether the last readings of a horn at rest agree with the maker's unit, while nothing was measured."""
        self.forget_motion()

    def forget_motion(self) -> None:
        """What is heard next has nothing to do with what was heard last: the servo was silent, or somebody else."""
        self._statuses: deque[_Status] = deque(maxlen=3)
        self._judged_at: Instant = -math.inf
        self._run: list[float] = []
        self._run_unit: PositionUnit | None = None

    @property
    def unit(self) -> PositionUnit:
        """What positions are taken to be in."""
        return self.forced or self.measured or LITERAL

    @property
    def state(self) -> UnitState:
        """How far that can be relied on."""
        if self.forced is not None:
            return "forced"
        if self.clash or self.measured not in (None, LITERAL):
            return "conflict"
        return "assumed" if self.measured is None else "confirmed"

    @property
    def sure(self) -> bool:
        """Whether an angle may be commanded in it: unless Status and 0x08 disagree about the maker's unit."""
        return self.state != "conflict"

    @property
    def unmeasured(self) -> bool:
        """Whether it is still to be measured."""
        return self.measured is None and self.forced is None and not self.clash

    @property
    def still(self) -> bool:
        """Whether the last Statuses agree, so that 0x08 read now would make a pair with the next."""
        positions = [status.position for status in self._statuses]
        return len(positions) > 1 and max(positions) - min(positions) <= MAX_UNCERTAINTY / 2 * max(map(abs, positions))

    def shown(self, position: float) -> float | None:
        """Degrees of a position of Status; None where 0x08 disagrees or was not read yet, and is shown instead."""
        known = self.forced is not None or (not self.clash and (self.measured is not None or self.supported))
        return position * DEGREES[self.unit] if known else None

    def add_status(self, position: float, at: Instant, reading: Angle | None) -> bool:
        """Take a Status, and the last reading of 0x08 if there is one. True when what is known has changed."""
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
        """Whether one reading between two Statuses agrees with the maker's unit, though the horn may be turning."""
        low, high = sorted((before * DEGREES[LITERAL], after * DEGREES[LITERAL]))
        slack = TOLERANCE_DEG + abs(degrees) / 4
        if low - slack <= degrees <= high + slack:
            self.supported, self._contradictions = True, 0
        elif high - low <= slack:  # it rests, so nothing but an answer that was late explains the difference
            self._contradictions += 1
            self.supported = self.supported and self._contradictions < MAX_CONTRADICTIONS

    def _conclude(self, position: float, degrees: float) -> bool:
        """Whether the pairs in a row are enough to know something new."""
        unit, run = self._run_unit, self._run
        moved = unit is not None and len(run) >= PAIRS_AT_TWO_ANGLES and max(run) - min(run) >= MIN_ANGLE_DEG
        if self.clash or not (moved or len(run) >= PAIRS_AT_ONE_ANGLE) or (unit is not None and unit == self.measured):
            return False
        pairs = f"{len(run)} times in a row, last {position:.6g} in Status beside {degrees:.1f}° in 0x08"
        values = known(times=len(run), position=f"{position:.6g}", angle_deg=round(degrees, 1), unit=unit)
        if unit is None:
            self.evidence = Note(f"Status and 0x08 agree in no unit that is known: {pairs}.", "unit_none_fits", values)
        elif self.measured is not None:
            text = f"Measured as {NAMES[self.measured]} before, and as {NAMES[unit]} now: {pairs}."
            self.evidence = Note(text, "unit_changed", {**values, "before": self.measured})
        else:
            self.measured = unit
            self.evidence = Note(f"Status and 0x08 agreed on {NAMES[unit]} {pairs}.", "unit_agreed", values)
            return True
        self.clash = True
        return True


def _unit_of(positions: list[float], degrees: float) -> "PositionUnit | Literal['no_unit', 'nothing']":
    """The one unit in which positions around a reading mean the same as it; `nothing` where they prove nothing."""
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
    """The distance of two neighbouring float16 numbers there: 11 significant bits."""
    return 2.0 ** max(math.frexp(position)[1] - 11, -24)
