"""Cuts a flat region with holes into triangles of even size: Delaunay over its rims and a lattice inside."""

import numpy as np
from numpy.typing import NDArray

from hornbill.view.bake.outline import Outline, area, contains

Triangles = NDArray[np.int64]


def region(outer: Outline, holes: list[Outline], spacing: float | None) -> tuple[NDArray[np.float64], Triangles]:
    """Points (the rims first, in order) and counter-clockwise triangles of `outer` without `holes`.

    With `spacing` in mm the inside gets points of its own, so that shading baked into points can vary there.
    Raises ValueError when a rim is too coarse for its neighbour, which shows as a wrong total area.
    """
    points = np.concatenate([outer, *holes])
    if spacing is not None:
        points = np.concatenate((points, _lattice(outer, holes, spacing)))
    triangles = _delaunay(points)
    centres = points[triangles].mean(axis=1)
    keep = contains(outer, centres)
    for hole in holes:
        keep &= ~contains(hole, centres)
    triangles = triangles[keep]
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    found = float(np.sum(_cross(b - a, c - a))) / 2
    wanted = area(outer) - sum(area(hole) for hole in holes)
    if abs(found - wanted) > 1e-3 * wanted:
        raise ValueError(f"triangles cover {found:.3f} mm² of {wanted:.3f} mm²: sample the rims more finely")
    return points, triangles


def _lattice(outer: Outline, holes: list[Outline], spacing: float) -> NDArray[np.float64]:
    low, high = outer.min(axis=0), outer.max(axis=0)
    rows: list[NDArray[np.float64]] = []
    for row, y in enumerate(np.arange(low[1] + spacing / 2, high[1], spacing * 0.87)):
        x = np.arange(low[0] + spacing * (0.5 + 0.5 * (row % 2)), high[0], spacing)
        rows.append(np.column_stack((x, np.full(len(x), y))))
    points = np.concatenate(rows)
    points = points[contains(outer, points)]
    for hole in holes:
        points = points[~contains(hole, points)]
    for rim in (outer, *holes):
        gap = np.linalg.norm(points[:, None, :] - rim[None, :, :], axis=2).min(axis=1)
        points = points[gap > spacing * 0.6]
    return points


def _delaunay(points: NDArray[np.float64]) -> Triangles:
    """Bowyer and Watson's incremental construction; a minute jitter breaks ties of points on one circle."""
    jitter = np.random.default_rng(7).uniform(-1e-6, 1e-6, points.shape)
    centre, reach = points.mean(axis=0), float(np.ptp(points)) * 50
    frame = centre + reach * np.array([[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]])
    cloud = np.concatenate((points + jitter, frame))
    count = len(points)
    triangles = np.array([[count, count + 1, count + 2]])
    circles = _circumcircles(cloud, triangles)
    for index in range(count):
        away = np.sum((circles[:, :2] - cloud[index]) ** 2, axis=1)
        hit = away < circles[:, 2]
        edges = triangles[hit][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        # An edge of the hole's rim belongs to one removed triangle only, so its reverse is absent.
        known = {(int(a), int(b)) for a, b in edges}
        rim = [(a, b, index) for a, b in sorted(known) if (b, a) not in known]
        fresh = np.array(rim)
        triangles = np.concatenate((triangles[~hit], fresh))
        circles = np.concatenate((circles[~hit], _circumcircles(cloud, fresh)))
    return triangles[(triangles < count).all(axis=1)]


def _circumcircles(cloud: NDArray[np.float64], triangles: Triangles) -> NDArray[np.float64]:
    """Rows of centre x, centre y and squared radius."""
    a, b, c = (cloud[triangles[:, corner]] for corner in range(3))
    b, c = b - a, c - a
    doubled = 2 * _cross(b, c)
    bb, cc = np.sum(b * b, axis=1), np.sum(c * c, axis=1)
    x = (c[:, 1] * bb - b[:, 1] * cc) / doubled
    y = (b[:, 0] * cc - c[:, 0] * bb) / doubled
    return np.column_stack((a[:, 0] + x, a[:, 1] + y, x * x + y * y))


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
