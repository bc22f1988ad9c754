"""Trapezoidal profile: an angle over time at limited speed and acceleration."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TrapezoidProfile:
    """`speed` in °/s and `acceleration` in °/s², both above 0."""

    speed: float
    acceleration: float


@dataclass(slots=True)
class Track:
    """Current angle and speed of a move, in degrees and °/s."""

    at: float
    speed: float = 0.0

    def step(self, target: float, profile: TrapezoidProfile, dt: float) -> bool:
        """Advance by `dt` seconds towards `target` within the profile. True once there and at rest.

        The speed is limited so that it can still brake before the target, so a moving target is followed smoothly.
        """
        distance = target - self.at
        # brake from here: v²/2a within the distance left after this step
        brake = profile.acceleration * dt
        most = min(
            profile.speed, max(0.0, math.sqrt(2 * profile.acceleration * abs(distance) + brake * brake / 4) - brake / 2)
        )
        wanted = math.copysign(most, distance)
        self.speed += min(max(wanted - self.speed, -brake), brake)
        moved = self.speed * dt
        if (
            abs(distance) <= abs(moved) + 1e-9
            and abs(self.speed) <= brake + 1e-9
            and (distance == 0 or moved * distance >= 0)
        ):
            self.at, self.speed = target, 0.0
            return True
        self.at += moved
        return False
