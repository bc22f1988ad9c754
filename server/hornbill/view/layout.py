"""Positions of servos and camera, and picking of the clicked servo."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from hornbill.view.case import Case, Vector, case_of
from hornbill.view.pose import Pose

CAMERA_POSITION: Vector = (3.3, -4.7, 4.15)
CAMERA_TARGET: Vector = (0.0, 0.0, 1.55)
CAMERA_POSITION_ALONE: Vector = (2.8, -4.0, 4.0)
CAMERA_TARGET_ALONE: Vector = (0.0, 0.0, 1.2)
"""Without other servos the selected servo is centred and larger."""
CAMERA_FOV_DEG = 42.0
CAMERA_NEAREST, CAMERA_FARTHEST = 3.0, 18.0
"""Range of the camera distance, in scene units. Shadows end at 20."""

WALL_CAMERA_POSITION: Vector = (0.0, -8.0, 13.9)
WALL_CAMERA_TARGET: Vector = (0.0, 0.0, 0.0)
WALL_CAMERA_FOV_DEG = 24.0
WALL_PITCH: tuple[float, float] = (3.8, 4.8)
"""Distance of neighbours in a wall of horns, unscaled, with room for a limit arc and a name in front of it."""
WALL_NEARER = 0.8
"""Offset of the rows towards the camera, unscaled, because horns extend further up than feet extend down."""

_PITCH, _ROW, _FIRST_ROW = 4.7, 4.6, 6.4
"""Distance of neighbours, of rows, and of the first row, so that facing horns do not touch."""
_AWAY = (-0.5746, 0.8184)
"""Initial viewing direction along the floor. Rows are perpendicular to it, behind the selected servo."""
_RIGHT = (0.8184, 0.5746)


@dataclass(frozen=True, slots=True)
class Placed:
    """A servo with the position of the foot of its output shaft, and its scale."""

    pose: Pose
    case: Case
    at: Vector
    scale: float = 1.0


def place(poses: Sequence[Pose], selected: str | None) -> tuple[Placed | None, list[Placed]]:
    """Place the selected servo at the origin and the others in rows behind it.

    Each servo has a fixed place in the rows, in the given order. The place of the selected one stays free, so a
    selection moves only two servos. A single servo has no rows.
    """
    columns = max(3, ceil(sqrt(len(poses) * 0.9)))
    columns += 1 - columns % 2
    chosen: Placed | None = None
    others: list[Placed] = []
    for index, pose in enumerate(poses):
        row, column = divmod(index, columns)
        if pose.uid == selected:
            chosen = Placed(pose, case_of(pose.series), (0.0, 0.0, 0.0))
        else:
            away, aside = _FIRST_ROW + row * _ROW, (column - columns // 2) * _PITCH
            at = (away * _AWAY[0] + aside * _RIGHT[0], away * _AWAY[1] + aside * _RIGHT[1], 0.0)
            others.append(Placed(pose, case_of(pose.series), at))
    return chosen, others


def wall(poses: Sequence[Pose], uids: Sequence[str], columns: int, scale: float) -> list[Placed]:
    """Place the servos of a wall of horns, in the order of `uids` from the back left. An unknown servo leaves its place
    free. The centre of the wall is WALL_NEARER, scaled, in front of the origin."""
    known = {pose.uid: pose for pose in poses}
    across, along = WALL_PITCH[0] * scale, WALL_PITCH[1] * scale
    rows = ceil(len(uids) / columns)
    placed: list[Placed] = []
    for index, uid in enumerate(uids):
        pose = known.get(uid)
        if pose is None:
            continue
        row, column = divmod(index, columns)
        at = ((column - (columns - 1) / 2) * across, ((rows - 1) / 2 - row) * along - WALL_NEARER * scale, 0.0)
        placed.append(Placed(pose, case_of(pose.series), at, scale))
    return placed


def pick(origin: Vector, direction: Vector, placed: Sequence[Placed]) -> str | None:
    """Unique ID of the nearest servo whose box intersects the ray, or None."""
    start = np.array(origin)
    with np.errstate(divide="ignore"):
        slope = 1.0 / np.array(direction)
    best: tuple[float, str] | None = None
    for servo in placed:
        low, high = (np.array(corner) * servo.scale + servo.at for corner in servo.case.box)
        with np.errstate(invalid="ignore"):
            one, other = (low - start) * slope, (high - start) * slope
        enter = float(np.nanmax(np.fmin(one, other)))
        leave = float(np.nanmin(np.fmax(one, other)))
        if leave >= max(enter, 0.0) and (best is None or enter < best[0]):
            best = (enter, servo.pose.uid)
    return best[1] if best else None
