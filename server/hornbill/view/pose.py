"""Data that the 3D view needs of a servo, and the interface of its source."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

Series: TypeAlias = str
"""Series of a servo according to the tables. Empty if unknown."""


@dataclass(frozen=True, slots=True)
class Pose:
    """One servo at one instant. Angles in degrees as counted by the servo: 0 is the horn's notch, positive is clockwise
    seen from the nameplate (section 4.1), more than one turn is possible. None: unknown."""

    uid: str
    name: str
    series: Series
    angle_deg: float | None
    command_deg: float | None
    limit_cw_deg: float | None
    limit_ccw_deg: float | None
    stale: bool


class PoseSource(Protocol):
    """Source of poses."""

    def poses(self) -> Sequence[Pose]:
        """All known servos, in a stable order. Called from the view's thread at its rate while a browser shows the
        scene. Must not block or use the bus, and must return a copy."""
        ...
