"""Closed 2D outlines in millimetres: (k, 2) arrays, counter-clockwise, no repeated last point."""

from math import acos, ceil, cos, hypot, pi, sin
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Outline: TypeAlias = NDArray[np.float64]


def circle(radius: float, count: int, *, x: float = 0.0, y: float = 0.0) -> Outline:
    """A circle of `count` corners."""
    turn = np.arange(count) * (2 * pi / count)
    return np.column_stack((x + radius * np.cos(turn), y + radius * np.sin(turn)))


def rounded_rectangle(
    x0: float, x1: float, y0: float, y1: float, radius: float, *, corner: int, spacing: float
) -> Outline:
    """A rectangle with round corners of `corner` segments; straight sides are split into pieces <= `spacing`."""
    centres = (
        (x1 - radius, y0 + radius),
        (x1 - radius, y1 - radius),
        (x0 + radius, y1 - radius),
        (x0 + radius, y0 + radius),
    )
    points: list[tuple[float, float]] = []
    for quarter, (x, y) in enumerate(centres):
        start = -pi / 2 + quarter * pi / 2
        for step in range(corner + 1):
            turn = start + step * (pi / 2) / corner
            points.append((x + radius * cos(turn), y + radius * sin(turn)))
    return subdivide(np.array(points), spacing)


def subdivide(outline: Outline, spacing: float) -> Outline:
    """The same shape with extra points, so that no edge is longer than `spacing`."""
    points: list[Outline] = []
    for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        pieces = max(1, ceil(float(np.linalg.norm(end - start)) / spacing - 1e-9))
        part = np.linspace(0.0, 1.0, pieces, endpoint=False)[:, None]
        points.append(start + (end - start) * part)
    return np.concatenate(points)


def arm(root: float, tip: float, length: float, *, notch: float, corner: int, spacing: float) -> Outline:
    """A tapered arm from the origin along +y: two circles and their tangents.

    A V notch of depth `notch` is cut into the round of the tip, on the axis.
    """
    lean = acos((root - tip) / length)  # angle between the axis and the radii to the tangent points
    right, left = pi / 2 - lean, pi / 2 + lean
    half = notch * 0.75 / tip  # half the notch's opening, as an angle on the tip's round
    turns = (
        np.linspace(right, pi / 2 - half, corner + 1),
        np.linspace(pi / 2 + half, left, corner + 1),
        np.linspace(left, right + 2 * pi, 3 * corner + 1),
    )
    rounds = [np.column_stack((np.cos(turn), np.sin(turn))) for turn in turns]
    end = np.array([0.0, length])
    bottom = np.array([[0.0, length + tip - notch]])
    points = np.concatenate((tip * rounds[0] + end, bottom, tip * rounds[1] + end, root * rounds[2]))
    return subdivide(_without_repeats(points), spacing)


def toothed(radius: float, depth: float, teeth: int) -> Outline:
    """A splined shaft: `teeth` trapezoids between `radius - depth` and `radius`."""
    shape = ((0.0, radius - depth), (0.18, radius - depth), (0.42, radius), (0.76, radius))
    points = [
        (r * cos(turn), r * sin(turn))
        for tooth in range(teeth)
        for part, r in shape
        for turn in ((tooth + part) * 2 * pi / teeth,)
    ]
    return np.array(points)


def hexagon(across_flats: float, count: int, *, x: float = 0.0, y: float = 0.0) -> Outline:
    """A hexagon of `count` points at equal angles, so that it can be lofted to a circle of the same number."""
    turn = np.arange(count) * (2 * pi / count)
    from_flat = pi / 6 - np.abs((turn % (pi / 3)) - pi / 6)
    reach = across_flats / 2 / np.cos(from_flat)
    return np.column_stack((x + reach * np.cos(turn), y + reach * np.sin(turn)))


def inset(outline: Outline, distance: float) -> Outline:
    """The outline moved inwards by `distance` (outwards when negative), corners mitred."""
    before = outline - np.roll(outline, 1, axis=0)
    after = np.roll(outline, -1, axis=0) - outline
    normals = [
        np.column_stack((-edge[:, 1], edge[:, 0])) / np.linalg.norm(edge, axis=1, keepdims=True)
        for edge in (before, after)
    ]
    bisector = normals[0] + normals[1]
    scale = 2.0 / np.maximum(np.sum(bisector * bisector, axis=1, keepdims=True), 0.5)
    return outline + bisector * scale * distance


def area(outline: Outline) -> float:
    """Signed area in mm², positive when counter-clockwise."""
    x, y = outline[:, 0], outline[:, 1]
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2)


def contains(outline: Outline, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which of the (n, 2) points lie inside, by counting crossings of a ray along +x."""
    inside = np.zeros(len(points), dtype=np.bool_)
    x, y = points[:, 0], points[:, 1]
    for (ax, ay), (bx, by) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        crosses = (ay > y) != (by > y)
        if ay != by:
            inside ^= crosses & (x < (bx - ax) * (y - ay) / (by - ay) + ax)
    return inside


def _without_repeats(outline: Outline) -> Outline:
    keep = [
        not hypot(*(point - other)) < 1e-9 for point, other in zip(outline, np.roll(outline, 1, axis=0), strict=True)
    ]
    return outline[np.array(keep)]
