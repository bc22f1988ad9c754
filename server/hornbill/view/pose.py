"""What the 3D view wants to know of a servo, and the shape of whoever tells it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

Series: TypeAlias = str
"""The series of a servo's model as the tables name it; empty until it is known."""


@dataclass(frozen=True, slots=True)
class Pose:
    """One servo at one moment. Angles in degrees as the servo counts them: 0 is the horn's notch, positive is
    clockwise seen from the name plate (section 4.1), more than a turn is allowed. None is "not known"."""

    uid: str
    name: str
    series: Series
    angle_deg: float | None
    command_deg: float | None
    limit_cw_deg: float | None
    limit_ccw_deg: float | None
    stale: bool


class PoseSource(Protocol):
    """Who knows the servos."""

    def poses(self) -> Sequence[Pose]:
        """Every known servo, in an order that stays. Called from the view's own thread at its rate while somebody
        looks: it must not block, must not touch the bus and must hand out a snapshot."""
        ...
