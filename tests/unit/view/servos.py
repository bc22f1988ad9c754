"""A source of poses that tests set, and that counts its calls."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from hornbill.view.pose import Pose


def pose(number: int = 0, **more: Any) -> Pose:
    """A servo at +45°, commanded to +30°, limited to -75..+90°, by default."""
    usual = Pose(f"{number:032x}", f"servo {number}", "BLA21", 45.0, 30.0, 90.0, -75.0, stale=False)
    return replace(usual, **more)


class Servos:
    """Any number of servos."""

    def __init__(self, *poses: Pose) -> None:
        self.now: tuple[Pose, ...] = poses
        self.calls = 0
        self.broken = False

    def poses(self) -> Sequence[Pose]:
        self.calls += 1
        if self.broken:
            raise LookupError("no poses today")
        return self.now
