"""Models for software rendering: few triangles in one material, with the light of the scene in their colours."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tools.meshes.gltf import Material, Part, linear
from tools.meshes.surface import join

_KEY = np.array((-3.0, -2.6, 8.2)) / np.linalg.norm((-3.0, -2.6, 8.2))
"""Direction to the light from above, as in `hornbill.view.stage`."""
_SKY, _GROUND, _SUN = 0.85, 0.13, 0.6
_BAKED = Material("baked", (255, 255, 255), 0.0, 1.0, unlit=True)


def baked(parts: Sequence[Part], *, turns: bool) -> list[Part]:
    """One part for all but the shadow on the floor. A model that `turns` about z has the mean light of a turn."""
    solid = [part for part in parts if not part.material.shadow]
    colours = np.concatenate([_colours(part, turns=turns) for part in solid])
    return [Part(_BAKED, join([part.surface for part in solid]), colours)]


def _colours(part: Part, *, turns: bool) -> NDArray[np.float64]:
    """Linear colour of each point. Metal is darker, as there is nothing to reflect."""
    normals = part.surface.normals()
    sun = normals[:, 2] * _KEY[2] if turns else normals @ _KEY
    light = _GROUND + (_SKY - _GROUND) * (0.5 + 0.5 * normals[:, 2]) + _SUN * np.maximum(0.0, sun)
    dull = 1.0 - 0.6 * part.material.metal
    return np.outer(part.light * light * dull, linear(part.material.srgb))
