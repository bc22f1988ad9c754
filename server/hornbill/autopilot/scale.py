"""Scale of an output: integer value ⇄ angle of the servo (ArrayCommand UNITLESS, table 2-21: 1.0 is 180°)."""

import math
import struct
from dataclasses import dataclass
from typing import Final

from hornbill.autopilot.plan import PlanOutput
from hornbill.domain.autopilot import Program
from hornbill.wire.messages import unitless_degrees

STEP_DEG: Final = 0.36
"""Angle of one µs (ArduPilot) or one unit (PX4)."""

_HALF: Final = struct.Struct("<e")


@dataclass(frozen=True, slots=True)
class Scale:
    """Integers of one autopilot: `lowest` sends −1, `highest` +1. Unit: µs for ArduPilot, none for PX4."""

    lowest: int
    highest: int

    @property
    def middle(self) -> int:
        """The integer that sends 0."""
        return (self.lowest + self.highest) // 2

    def wire(self, number: int) -> float:
        """The value in ArrayCommand: clamped to ±1, in half precision."""
        value = (number - self.lowest) / 500 - 1
        found: float = _HALF.unpack(_HALF.pack(max(-1.0, min(1.0, value))))[0]
        return found

    def degrees(self, number: int) -> float:
        """Angle that the servo takes, ° in its steps of 0.1°."""
        return unitless_degrees(self.wire(number))

    def inside(self, degrees: float, *, upper: bool) -> int:
        """The integer nearest to an end of the linkage that does not exceed it."""
        exact = self.middle + degrees / STEP_DEG
        number = math.floor(exact + 1e-9) if upper else math.ceil(exact - 1e-9)
        number = max(self.lowest, min(self.highest, number))
        # half precision may round away from zero, by up to 0.05°
        step = -1 if upper else 1
        while (self.degrees(number) > degrees + 1e-6) if upper else (self.degrees(number) < degrees - 1e-6):
            number += step
        return number

    def nearest(self, degrees: float) -> int:
        """The integer nearest to an angle."""
        return max(self.lowest, min(self.highest, round(self.middle + degrees / STEP_DEG)))


SCALES: Final[dict[Program, Scale]] = {"ardupilot": Scale(1000, 2000), "px4": Scale(0, 1000)}


@dataclass(frozen=True, slots=True)
class Travel:
    """Integers of one output: ends and neutral."""

    low: int
    high: int
    neutral: int


def travel(program: Program, output: PlanOutput) -> Travel:
    """The integers of an output, within its ends."""
    scale = SCALES[program]
    low, high = scale.inside(output.low_deg, upper=False), scale.inside(output.high_deg, upper=True)
    return Travel(low, high, max(low, min(high, scale.nearest(output.neutral_deg))))
