"""Triangulation of a flat region with holes: Delaunay over its rims and an inner lattice."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from tools.meshes.outline import Outline, area, contains

Triangles = NDArray[np.int64]


def region(outer: Outline, holes: list[Outline], spacing: float | None) -> tuple[NDArray[np.float64], Triangles]:
    """Points (the rims first, in order) and counter-clockwise triangles of `outer` without `holes`.

    `spacing` (mm) adds inner points, so that the shading baked into points can vary. Raises ValueError if a rim is too
    coarse for its neighbour, which results in a wrong total area.
    """
    points = np.concatenate([outer, *holes])
    if spacing is not None:
        points = np.concatenate((points, _lattice(outer, holes, spacing)))
    triangles: Triangles = Delaunay(points).simplices.astype(np.int64)
    centres = points[triangles].mean(axis=1)
    keep = contains(outer, centres)
    for hole in holes:
        keep &= ~contains(hole, centres)
    triangles = triangles[keep]
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    found = float(np.sum(_cross(b - a, c - a))) / 2
    wanted = area(outer) - sum(area(hole) for hole in holes)
    if abs(found - wanted) > 1e-3 * wanted:
        raise ValueError(f"Triangles cover {found:.3f} mm² of {wanted:.3f} mm². Sample the rims more finely.")
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


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
