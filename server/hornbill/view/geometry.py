"""Conversion of angles and limits to rotations and points. 1 scene unit is 20 mm; z is up, away from the nameplate."""

from math import ceil, cos, floor, radians, remainder, sin

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float32]

ARC_STEPS = 96
"""Segments of a limit arc, independent of its span, so that the number of points is constant."""


def wrapped(angle_deg: float) -> float:
    """The angle within ±180°."""
    return remainder(angle_deg, 360.0)


def horn_wxyz(angle_deg: float) -> tuple[float, float, float, float]:
    """Rotation of a horn. Positive is clockwise seen from above, so about -z (section 4.1)."""
    half = -radians(wrapped(angle_deg)) / 2
    return (cos(half), 0.0, 0.0, sin(half))


def rim(angles_deg: NDArray[np.float64], radius: float) -> Points:
    """Points on a circle at these angles. 0° is +y, positive towards +x."""
    turn = np.radians(angles_deg)
    return np.column_stack((radius * np.sin(turn), radius * np.cos(turn), np.zeros_like(turn))).astype(np.float32)


def span(cw_deg: float, ccw_deg: float) -> tuple[float, float]:
    """First and last angle of the limit arc, at most one turn, in ascending order.

    Limits beyond one turn result in a full circle; contradictory limits in an empty arc.
    """
    if cw_deg - ccw_deg >= 359.0:
        return (-180.0, 180.0)
    return (ccw_deg, max(cw_deg, ccw_deg))


def band(cw_deg: float, ccw_deg: float, inner: float, outer: float) -> Points:
    """Points of a ring sector, alternately on the inner and the outer radius. BAND_FACES connects them."""
    first, last = span(cw_deg, ccw_deg)
    angles = np.linspace(first, last, ARC_STEPS + 1)
    points = np.empty((2 * (ARC_STEPS + 1), 3), dtype=np.float32)
    points[0::2] = rim(angles, inner)
    points[1::2] = rim(angles, outer)
    return points


def _band_faces() -> NDArray[np.uint32]:
    start = np.arange(ARC_STEPS, dtype=np.uint32) * 2
    lower = np.column_stack((start, start + 2, start + 1))
    upper = np.column_stack((start + 1, start + 2, start + 3))
    return np.concatenate((lower, upper))


BAND_FACES = _band_faces()


ORIGIN_FACES = np.array([[0, 1, 2]], dtype=np.uint32)


def origin_mark(radius: float, size: float) -> Points:
    """The triangle outside a limit arc that marks 0°, the position of the notch at the servo's origin."""
    return np.array(
        [(0.0, radius, 0.0), (-0.6 * size, radius + size, 0.0), (0.6 * size, radius + size, 0.0)], dtype=np.float32
    )


def scale_lines(
    cw_deg: float, ccw_deg: float, radius: float, *, tick: float, end: float, steps: int = ARC_STEPS
) -> Points:
    """The limit scale as (n, 2, 3) line segments: arc, a tick every 10°, a longer tick every 30°, and both ends.

    `tick` and `end`: lengths outwards from `radius`. A long tick is twice as long as a short one. 0: no ticks. `steps`:
    segments of the arc.
    """
    first, last = span(cw_deg, ccw_deg)
    closed = last - first >= 360.0
    arc = rim(np.linspace(first, last, steps + 1), radius)
    pieces = [np.stack((arc[:-1], arc[1:]), axis=1)]
    tens = [ten * 10.0 for ten in range(-18, 18)] if closed else _tens(first, last)
    if not closed:
        ends = np.array([first, last])
        pieces.append(np.stack((rim(ends, radius - end * 0.4), rim(ends, radius + end)), axis=1))
    for ten in tens if tick else ():
        length = tick if ten % 30 else 2 * tick
        turn = np.array([ten])
        pieces.append(np.stack((rim(turn, radius), rim(turn, radius + length)), axis=1))
    return np.concatenate(pieces)


def _tens(first: float, last: float) -> list[float]:
    """Multiples of 10° between two limits, except those too close to the line at a limit."""
    tens = [ten * 10.0 for ten in range(ceil(first / 10), floor(last / 10) + 1)]
    return [ten for ten in tens if ten - first > 2.0 and last - ten > 2.0]


def dashed(outline: NDArray[np.floating], dash: float, gap: float) -> Points:
    """A closed (k, 3) outline as (n, 2, 3) dashes, distributed evenly around it."""
    closed = np.concatenate((outline, outline[:1]))
    walked = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))))
    count = max(1, round(walked[-1] / (dash + gap)))
    starts = np.arange(count) * walked[-1] / count
    share = dash / (dash + gap) * walked[-1] / count
    knots = np.array([[start, start + share / 2, start + share] for start in starts])
    points = np.stack([np.interp(knots, walked, closed[:, axis]) for axis in range(3)], axis=-1)
    return np.concatenate((points[:, :2], points[:, 1:])).astype(np.float32)


def ribbons(lines: NDArray[np.floating], width: float) -> Points:
    """Level (n, 2, 3) line segments as quads of this width: (2 n, 3, 3) triangles, facing up."""
    along = lines[:, 1] - lines[:, 0]
    aside = np.column_stack((-along[:, 1], along[:, 0], np.zeros(len(along))))
    aside *= width / 2 / np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), 1e-9)
    a, b, c, d = lines[:, 0] - aside, lines[:, 1] - aside, lines[:, 1] + aside, lines[:, 0] + aside
    return np.concatenate((np.stack((a, b, c), axis=1), np.stack((a, c, d), axis=1))).astype(np.float32)
