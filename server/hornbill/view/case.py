"""Dimensions of the servo cases, for the models and the scene."""

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from hornbill.view.pose import Series

MM = 0.05
"""Scene units per millimetre: 1 unit is 20 mm, because shadows end 20 units from the camera."""
Vector: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Case:
    """Dimensions in mm unless noted. x runs along the case from the output shaft, z upwards from the floor."""

    key: Literal["bla21", "bla15", "plain"]
    back: float
    front: float
    half_width: float
    corner: float
    """Radius of the upright edges."""
    seam_low: float
    seam_high: float
    """Heights of the seams between bottom, middle and top."""
    top: float
    """Height of the face with the nameplate."""
    ear: float
    """Length of an ear."""
    ear_half_width: float
    ear_thickness: float
    hole: float
    """Radius of the holes in the ears."""
    hole_y: tuple[float, ...]
    fins: int
    boss: float
    """Radius of the boss around the shaft."""
    horn: float
    """Scale of the horn model."""

    @property
    def small(self) -> float:
        """Scale of the fittings relative to the larger series."""
        return self.boss / 8.4

    @property
    def ear_top(self) -> float:
        """Height of the top of the ears."""
        return self.seam_high - 0.6

    @property
    def hub(self) -> float:
        """Height of the underside of the horn hub."""
        return self.top + 4.6 * self.small

    @property
    def pivot(self) -> float:
        """Height of the underside of the horn hub in scene units."""
        return self.hub * MM

    @property
    def box(self) -> tuple[Vector, Vector]:
        """Bounding box of case, ears and hub, in scene units from the foot of the shaft."""
        roof = self.hub + 6.4 * self.horn
        return (
            ((self.back - self.ear) * MM, -self.half_width * MM, 0.0),
            ((self.front + self.ear) * MM, self.half_width * MM, roof * MM),
        )


BLA21 = Case(
    "bla21",
    back=-30.0,
    front=10.2,
    half_width=10.5,
    corner=2.4,
    seam_low=8.6,
    seam_high=28.6,
    top=37.0,
    ear=7.2,
    ear_half_width=9.4,
    ear_thickness=2.6,
    hole=2.2,
    hole_y=(-5.0, 5.0),
    fins=4,
    boss=8.4,
    horn=1.0,
)
BLA15 = Case(
    "bla15",
    back=-27.6,
    front=7.9,
    half_width=7.6,
    corner=1.9,
    seam_low=6.6,
    seam_high=21.8,
    top=28.6,
    ear=5.8,
    ear_half_width=6.6,
    ear_thickness=2.0,
    hole=1.7,
    hole_y=(0.0,),
    fins=3,
    boss=6.3,
    horn=0.8,
)
PLAIN = replace(BLA21, key="plain", ear=0.0, hole_y=(), fins=0)
"""A servo of an unknown or unsupported series: a block with a shaft."""

CASES = (BLA21, BLA15, PLAIN)
_OF_SERIES = {"BLA21": BLA21, "BLA15": BLA15, "BLA34": BLA21}
"""The dimensions of a BLA34 are unknown, so it is drawn as the larger known series."""

HORN_REACH = 27.1 * MM
"""Length of an unscaled horn from shaft to tip, in scene units."""
ARC_REACH = 1.16
"""Radius of the limit arcs in the crowd, relative to the horn length."""
ARC_HEIGHT = 0.11
"""Height of a limit arc above the underside of an unscaled hub: the middle of the blade."""


def case_of(series: Series) -> Case:
    """Case of a series."""
    return _OF_SERIES.get(series, PLAIN)
