"""Loading of the models, as files for the viewer and as triangles."""

import json
import struct
from collections.abc import Sequence
from functools import cache
from itertools import accumulate
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from hornbill.view.view_settings import Quality

Name: TypeAlias = Literal[
    "bla21-near", "bla21-far", "bla15-near", "bla15-far", "plain-near", "plain-far",
    "horn-near", "horn-far", "horn-far-low", "horn-ghost", "horn-ghost-far",
]  # fmt: skip
NEAR: dict[str, Name] = {"bla21": "bla21-near", "bla15": "bla15-near", "plain": "plain-near"}
FAR: dict[str, Name] = {"bla21": "bla21-far", "bla15": "bla15-far", "plain": "plain-far"}
"""Models of a case, by its key: for the selected servo, and for the others."""

_TYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
"""Types of numbers in a GLB file."""

_FOLDER = Path(__file__).resolve().parent / "meshes"


@cache
def glb(name: Name, quality: Quality) -> bytes:
    """A model file. In low quality it has few triangles, and the light is in its colours."""
    return (_FOLDER / f"{name}{'-low' if quality == 'low' else ''}.glb").read_bytes()


@cache
def triangles(name: Name) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Points (n, 3) in scene units and triangles (m, 3) of a whole model."""
    content = (_FOLDER / f"{name}.glb").read_bytes()
    document, blob = _parts(content)

    def values(accessor: int) -> NDArray[Any]:
        about = document["accessors"][accessor]
        at, columns = document["bufferViews"][about["bufferView"]]["byteOffset"], 3 if about["type"] == "VEC3" else 1
        return np.frombuffer(blob, _TYPES[about["componentType"]], about["count"] * columns, 8 + at).reshape(-1, 3)

    parts = document["meshes"][0]["primitives"]
    points = [values(part["attributes"]["POSITION"]) for part in parts]
    faces = [values(part["indices"]).astype(np.uint32) for part in parts]
    starts = accumulate((len(one) for one in points), initial=0)
    return np.concatenate(points), np.concatenate([one + np.uint32(at) for one, at in zip(faces, starts, strict=False)])


def _parts(content: bytes) -> tuple[dict[str, Any], bytes]:
    """Description and binary chunk of a GLB file. Our models have one node without transformation."""
    (length,) = struct.unpack_from("<I", content, 12)
    return json.loads(content[20 : 20 + length]), content[20 + length :]


def outline(points: Sequence[Sequence[float]] | NDArray[np.float32]) -> NDArray[np.float32]:
    """Convex hull of points seen from above, at their highest z, counter-clockwise: the edge of a ghost."""
    flat = np.asarray(points, dtype=np.float32)
    top = float(flat[:, 2].max())
    ordered = sorted({(float(x), float(y)) for x, y, _ in flat})

    def half(walk: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
        hull: list[tuple[float, float]] = []
        for x, y in walk:
            while len(hull) > 1 and _turn(hull[-2], hull[-1], (x, y)) <= 0:
                hull.pop()
            hull.append((x, y))
        return hull[:-1]

    hull = half(ordered) + half(ordered[::-1])
    return np.array([(x, y, top) for x, y in hull], dtype=np.float32)


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
