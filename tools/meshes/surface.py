"""Triangle surfaces in millimetres, and their constructors: loft, cap, lathe, tube.

Points shared between triangles are shaded smoothly, repeated points form a crease: the viewer computes its normals from
the points, so creases must be in the points and not in the normals.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tools.meshes.outline import Outline, circle, inset
from tools.meshes.triangulate import region

Ring = NDArray[np.float64]
"""A closed outline in space, (k, 3), counter-clockwise seen from the end of the loft."""

_LIP = 0.22
"""Width in mm of the flat strip between a rounded edge and its face."""
_HOLE = 0.6
"""Bevel of a hole relative to that of the outer edge."""


@dataclass(frozen=True, slots=True)
class Surface:
    """Points (n, 3) in mm and triangles (m, 3), counter-clockwise seen from outside."""

    points: NDArray[np.float64]
    triangles: NDArray[np.int64]

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> "Surface":
        """The surface, translated."""
        return Surface(self.points + np.array([x, y, z]), self.triangles)

    def scaled(self, factor: float) -> "Surface":
        """The surface, scaled about the origin."""
        return Surface(self.points * factor, self.triangles)

    def turned(self, columns: Sequence[Sequence[float]]) -> "Surface":
        """The surface, rotated: `columns` are the images of x, y and z, a right-handed set."""
        return Surface(self.points @ np.array(columns, dtype=np.float64), self.triangles)

    def normals(self) -> NDArray[np.float64]:
        """Unit normals at the points, weighted by triangle area, as in the viewer."""
        a, b, c = (self.points[self.triangles[:, corner]] for corner in range(3))
        face = np.cross(b - a, c - a)
        total = np.zeros_like(self.points)
        for corner in range(3):
            np.add.at(total, self.triangles[:, corner], face)
        length = np.linalg.norm(total, axis=1, keepdims=True)
        return total / np.where(length > 0, length, 1.0)


def join(parts: Sequence[Surface]) -> Surface:
    """Several surfaces as one, without merging points."""
    starts = np.cumsum([0, *(len(part.points) for part in parts)])
    return Surface(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.triangles + start for part, start in zip(parts, starts, strict=False)]),
    )


def at(outline: Outline, z: float) -> Ring:
    """An outline at a height."""
    return np.column_stack((outline, np.full(len(outline), z)))


def loft(rings: Sequence[Ring], *, inward: bool = False) -> Surface:
    """A smooth skin over rings of equal length, bottom first; `inward` flips it, for the wall of a hole."""
    size = len(rings[0])
    here = np.arange(size)
    there = (here + 1) % size
    quads: list[NDArray[np.int64]] = []
    for level in range(len(rings) - 1):
        low, high = level * size, (level + 1) * size
        quads.append(np.column_stack((low + here, low + there, high + there)))
        quads.append(np.column_stack((low + here, high + there, high + here)))
    triangles = np.concatenate(quads)
    return Surface(np.concatenate(rings), triangles[:, ::-1] if inward else triangles)


def cap(
    outer: Outline,
    z: float,
    *,
    holes: Sequence[Outline] = (),
    up: bool = True,
    spacing: float | None = None,
) -> Surface:
    """A flat face at height z, with holes, seen from above (`up`) or from below."""
    flat, triangles = region(outer, list(holes), spacing)
    return Surface(at(flat, z), triangles if up else triangles[:, ::-1])


def slab(
    outer: Outline,
    z0: float,
    z1: float,
    *,
    bevel: float,
    steps: int,
    holes: Sequence[Outline] = (),
    spacing: float | None = None,
    rise: float | None = None,
    bottom: bool = True,
) -> Surface:
    """A plate with rounded edges and holes from z0 to z1.

    `spacing` adds points inside the faces, `rise` adds levels to the wall; both only for baked shading.
    """
    parts = [
        _wall(outer, z0, z1, bevel=bevel, steps=steps, rise=rise),
        *(_wall(hole, z0, z1, bevel=bevel * _HOLE, steps=steps, rise=rise, inward=True) for hole in holes),
    ]
    face = inset(outer, bevel + _LIP)
    rims = [inset(hole, -bevel * _HOLE - _LIP) for hole in holes]
    parts.append(cap(face, z1, holes=rims, spacing=spacing))
    if bottom:
        parts.append(cap(face, z0, holes=rims, up=False))
    return join(parts)


def lathe(profile: Sequence[tuple[float, float]], count: int) -> Surface:
    """A solid of revolution about z: profile of (radius, z), from the bottom outside up and inwards.

    Sharp corners become creases. A last radius of 0 closes the part.
    """
    return join([loft([at(circle(max(r, 1e-4), count), z) for r, z in run]) for run in _smooth_runs(profile)])


def stack(outline: Outline, profile: Sequence[tuple[float, float]]) -> Surface:
    """An upright skin whose outline is inset by a depth at each height: profile of (inset, z), bottom first."""
    return join([loft([at(inset(outline, depth), z) for depth, z in run]) for run in _smooth_runs(profile)])


def tube(path: NDArray[np.float64], radius: float, count: int) -> Surface:
    """A round cable along (n, 3) points, closed at its far end; the profile is swept without twist."""
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along[0], [0.0, 0.0, 1.0])
    if np.linalg.norm(side) < 1e-6:
        side = np.array([1.0, 0.0, 0.0])
    rings: list[Ring] = []
    turn = np.arange(count) * (2 * np.pi / count)
    for point, direction in zip(path, along, strict=True):
        side = side - direction * (side @ direction)
        side /= np.linalg.norm(side)
        other = np.cross(direction, side)
        rings.append(point + radius * (np.outer(np.cos(turn), side) + np.outer(np.sin(turn), other)))
    end = np.repeat(path[-1][None, :], count, axis=0)
    return join([loft(rings), loft([rings[-1], end])])


def _wall(
    outline: Outline,
    z0: float,
    z1: float,
    *,
    bevel: float,
    steps: int,
    rise: float | None,
    inward: bool = False,
) -> Surface:
    """The upright part between two faces, with quarter rounds towards them.

    A narrow flat strip follows each round, so that its shading runs into the face without a line.
    """
    sign = -1.0 if inward else 1.0
    turns = np.linspace(0.0, np.pi / 2, steps + 1)
    lip = inset(outline, sign * (bevel + _LIP))
    low = [at(inset(outline, sign * bevel * (1 - np.sin(turn))), z0 + bevel * (1 - np.cos(turn))) for turn in turns]
    high = [at(inset(outline, sign * bevel * (1 - np.cos(turn))), z1 - bevel * (1 - np.sin(turn))) for turn in turns]
    levels = 1 if rise is None else max(1, round((z1 - z0 - 2 * bevel) / rise))
    between = np.linspace(z0 + bevel, z1 - bevel, levels + 1)[1:-1]
    rings = [at(lip, z0), *low, *(at(outline, float(z)) for z in between), *high, at(lip, z1)]
    return loft(rings, inward=inward)


def _smooth_runs(profile: Sequence[tuple[float, float]]) -> list[list[tuple[float, float]]]:
    """The profile split at corners sharper than 40°, with each corner in both pieces."""
    runs: list[list[tuple[float, float]]] = [[profile[0]]]
    for before, here, after in zip(profile, profile[1:], profile[2:], strict=False):
        runs[-1].append(here)
        first, second = np.subtract(here, before), np.subtract(after, here)
        cosine = float(first @ second) / float(np.linalg.norm(first) * np.linalg.norm(second))
        if cosine < np.cos(np.radians(40)):
            runs.append([here])
    runs[-1].append(profile[-1])
    return runs
