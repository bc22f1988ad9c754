"""Baked ambient occlusion: the share of the sky visible from a point past the model and the floor.

The model is rasterised into a grid of cells, then rays are cast from every point over its hemisphere. The viewer has no
ambient occlusion; without it, parts appear disconnected.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tools.meshes.outline import Outline, contains
from tools.meshes.surface import Surface

_CELL = 0.5
"""Edge of a cell in mm."""
_REACH = 11.0
"""Maximum distance at which a surface darkens another, mm."""
_RAYS = 72


@dataclass(frozen=True, slots=True)
class Solid:
    """Upright prism that blocks light: an outline without its holes, from z0 to z1 (mm)."""

    outline: Outline
    z0: float
    z1: float
    holes: tuple[Outline, ...] = ()


class Occlusion:
    """Grid of one model on the floor z = 0."""

    def __init__(self, solids: Sequence[Solid], *, floor: bool = True) -> None:
        margin = _REACH + 2
        outlines = np.concatenate([solid.outline for solid in solids])
        bottom, top = min(solid.z0 for solid in solids), max(solid.z1 for solid in solids)
        low = np.append(outlines.min(axis=0), bottom) - margin
        high = np.append(outlines.max(axis=0), top) + margin
        self._origin: NDArray[np.float64] = low
        counts: NDArray[np.intp] = np.ceil((high - low) / _CELL).astype(np.intp)
        x, y, z = (_middles(float(low[axis]), int(counts[axis])) for axis in range(3))
        flat = np.column_stack((np.repeat(x, len(y)), np.tile(y, len(x))))
        filled = np.zeros((len(x), len(y), len(z)), dtype=np.float32)
        for solid in solids:
            inside = contains(solid.outline, flat)
            for hole in solid.holes:
                inside &= ~contains(hole, flat)
            share = np.clip((np.minimum(z + _CELL / 2, solid.z1) - np.maximum(z - _CELL / 2, solid.z0)) / _CELL, 0, 1)
            filled = np.maximum(filled, inside.reshape(len(x), len(y), 1) * share[None, None, :])
        if floor:
            filled[:, :, z < 0] = 1.0
        self._filled: NDArray[np.float32] = filled.astype(np.float32)

    def light(self, surface: Surface, *, strength: float = 1.0) -> NDArray[np.float64]:
        """Share of light that reaches each point, 1 = unobstructed; `strength` 0..1 blends it with unobstructed."""
        normals = surface.normals()
        directions = _sphere(_RAYS)
        facing = normals @ directions.T
        weight = np.maximum(facing, 0.0)
        through = np.ones_like(weight)
        start = surface.points + normals * _CELL * 1.1
        steps = np.arange(0.6, _REACH, 0.75)
        for step in steps:
            here = start[:, None, :] + directions[None, :, :] * step
            fade = 1.0 - (step / _REACH) ** 1.5
            through = np.minimum(through, 1.0 - fade * self._sample(here))
        open_sky = np.sum(through * weight, axis=1) / np.maximum(np.sum(weight, axis=1), 1e-9)
        return 1.0 - strength * (1.0 - np.clip(open_sky, 0.0, 1.0))

    def _sample(self, where: NDArray[np.float64]) -> NDArray[np.float32]:
        cell = np.floor((where - self._origin) / _CELL).astype(np.intp)
        limit: NDArray[np.intp] = np.array(self._filled.shape, dtype=np.intp) - 1
        inside = np.all((cell >= 0) & (cell <= limit), axis=-1)
        cell = np.clip(cell, 0, limit)
        return np.where(inside, self._filled[cell[..., 0], cell[..., 1], cell[..., 2]], 0.0)


def _middles(low: float, count: int) -> NDArray[np.float64]:
    return low + (np.arange(count, dtype=np.float64) + 0.5) * _CELL


def _sphere(count: int) -> NDArray[np.float64]:
    """Evenly distributed directions over the sphere, on a golden spiral."""
    index = np.arange(count) + 0.5
    z = 1 - 2 * index / count
    turn = index * np.pi * (1 + 5**0.5)
    flat = np.sqrt(1 - z * z)
    return np.column_stack((flat * np.cos(turn), flat * np.sin(turn), z))
