"""The trapezoid of a move: an angle over time at a limited speed and acceleration."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TrapezoidProfile:
    """`speed` in degrees a second and `acceleration` in degrees a second squared, both above 0."""

    speed: float
    acceleration: float


@dataclass(slots=True)
class Track:
    """Where a move is: degrees and degrees a second."""

    at: float
    speed: float = 0.0

    def step(self, target: float, profile: TrapezoidProfile, dt: float) -> bool:
        """Go on for `dt` seconds towards `target`, never faster than the profile; true when there and at rest.

        The speed is kept to what can still be braked before the target: a target that moves is followed smoothly.
        """
        way = target - self.at
        # brake from here: v²/2a within the way that is left after this step
        brake = profile.acceleration * dt
        most = min(
            profile.speed, max(0.0, math.sqrt(2 * profile.acceleration * abs(way) + brake * brake / 4) - brake / 2)
        )
        wanted = math.copysign(most, way)
        self.speed += min(max(wanted - self.speed, -brake), brake)
        moved = self.speed * dt
        if abs(way) <= abs(moved) + 1e-9 and abs(self.speed) <= brake + 1e-9 and (way == 0 or moved * way >= 0):
            self.at, self.speed = target, 0.0
            return True
        self.at += moved
        return False
