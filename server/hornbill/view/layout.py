"""Decides where servos stand, where the camera is, and which servo a click meets."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from hornbill.view.case import Case, Vector, case_of
from hornbill.view.pose import Pose

CAMERA_POSITION: Vector = (2.62, -3.72, 3.9)
CAMERA_TARGET: Vector = (-0.12, 0.14, 1.36)
CAMERA_FOV_DEG = 43.0
CAMERA_NEAREST, CAMERA_FARTHEST = 3.0, 18.0
"""How close and how far the camera may be drawn, in scene units; shadows end at 20."""

_PITCH_X, _PITCH_Y = 4.6, 3.8
"""Distance of neighbours: two horns that point at each other stay apart."""
_FIRST_ROW, _MIDDLE = 7.4, -6.6
"""Where the rows begin and the x of their middle: behind the selected servo as the camera first sees it."""


@dataclass(frozen=True, slots=True)
class Placed:
    """A servo and where the foot of its output shaft stands."""

    pose: Pose
    case: Case
    at: Vector


def place(poses: Sequence[Pose], selected: str | None) -> tuple[Placed | None, list[Placed]]:
    """The selected servo at the origin and the others in rows behind it.

    Everybody keeps a place of their own in the rows, in the order given; the place of the selected one stays free,
    so a selection moves two servos and no more. One servo alone has no rows.
    """
    columns = max(3, ceil(sqrt(len(poses) * 1.4)))
    columns += 1 - columns % 2
    chosen: Placed | None = None
    others: list[Placed] = []
    for index, pose in enumerate(poses):
        row, column = divmod(index, columns)
        if pose.uid == selected:
            chosen = Placed(pose, case_of(pose.series), (0.0, 0.0, 0.0))
        else:
            x = _MIDDLE + (column - columns // 2) * _PITCH_X
            others.append(Placed(pose, case_of(pose.series), (x, _FIRST_ROW + row * _PITCH_Y, 0.0)))
    return chosen, others


def pick(origin: Vector, direction: Vector, placed: Sequence[Placed]) -> str | None:
    """The uid of the nearest servo whose box the ray meets, or None."""
    start = np.array(origin)
    with np.errstate(divide="ignore"):
        slope = 1.0 / np.array(direction)
    best: tuple[float, str] | None = None
    for servo in placed:
        low, high = (np.array(corner) + servo.at for corner in servo.case.box)
        with np.errstate(invalid="ignore"):
            one, other = (low - start) * slope, (high - start) * slope
        enter = float(np.nanmax(np.fmin(one, other)))
        leave = float(np.nanmin(np.fmax(one, other)))
        if leave >= max(enter, 0.0) and (best is None or enter < best[0]):
            best = (enter, servo.pose.uid)
    return best[1] if best else None
