"""Writer of surfaces with materials and baked shading as a binary glTF 2.0 file."""

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hornbill.view.case import MM
from tools.meshes.surface import Surface


@dataclass(frozen=True, slots=True)
class Material:
    """A glTF metal-rough material; `srgb` is the sRGB colour (0..255), converted to linear on writing."""

    name: str
    srgb: tuple[int, int, int]
    metal: float
    rough: float
    shadow: bool = False
    """Black and unlit, with the missing baked light as opacity: the shadow of the model."""
    unlit: bool = False
    """The baked light is the colour that is seen."""


@dataclass(frozen=True, slots=True)
class Part:
    """A surface in one material, with the baked light of each point (0..1), or its linear colour if unlit (n, 3)."""

    material: Material
    surface: Surface
    light: NDArray[np.float64]


def linear(srgb: tuple[int, int, int]) -> list[float]:
    """sRGB bytes as linear factors 0..1, as required by glTF."""
    part = np.array(srgb) / 255
    value = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    return [round(float(channel), 5) for channel in value]


def encode(parts: Sequence[Part]) -> bytes:
    """GLB file: a mesh with one primitive per part. Lengths are converted to scene units."""
    blob = bytearray()
    views: list[dict[str, int]] = []
    accessors: list[dict[str, object]] = []

    def add(data: NDArray[np.generic], kind: str, component: int, target: int, **more: object) -> int:
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": data.nbytes, "target": target})
        blob.extend(data.tobytes())
        blob.extend(bytes(-len(blob) % 4))
        accessors.append(
            {"bufferView": len(views) - 1, "componentType": component, "count": len(data), "type": kind, **more}
        )
        return len(accessors) - 1

    # Dark linear colours need more than a byte, and viser joins only parts of one type.
    exact = any(part.material.unlit for part in parts)
    primitives: list[dict[str, object]] = []
    for index, part in enumerate(parts):
        points = np.round(part.surface.points * MM, 5).astype("<f4")
        normals = np.round(part.surface.normals(), 4).astype("<f4")
        shades = _shades(part)
        shades = np.round(shades, 4).astype("<f4") if exact else np.round(shades * 255).astype("u1")
        corners = part.surface.triangles.astype("<u2" if len(points) < 65536 else "<u4").reshape(-1)
        attributes = {
            "POSITION": add(points, "VEC3", 5126, 34962, min=_row(points.min(0)), max=_row(points.max(0))),
            "NORMAL": add(normals, "VEC3", 5126, 34962),
            "COLOR_0": add(shades, "VEC4", 5126 if exact else 5121, 34962, normalized=not exact),
        }
        indices = add(corners, "SCALAR", 5123 if corners.dtype == np.dtype("<u2") else 5125, 34963)
        primitives.append({"attributes": attributes, "indices": indices, "material": index})
    document = {
        "asset": {"version": "2.0", "generator": "hornbill"},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": [_material(part.material) for part in parts],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(blob)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + len(blob)
    return b"".join(
        (
            struct.pack("<4sII", b"glTF", 2, total),
            struct.pack("<I4s", len(text), b"JSON"),
            text,
            struct.pack("<I4s", len(blob), b"BIN\0"),
            bytes(blob),
        )
    )


def _shades(part: Part) -> NDArray[np.float64]:
    """Red, green, blue and opacity of the points."""
    if part.material.shadow:
        return np.column_stack((np.zeros((len(part.light), 3)), 1.0 - part.light))
    rgb = part.light if part.material.unlit else np.repeat(part.light[:, None], 3, axis=1)
    return np.column_stack((rgb, np.ones(len(rgb))))


def _material(material: Material) -> dict[str, object]:
    surface = {
        "baseColorFactor": [*linear(material.srgb), 1.0],
        "metallicFactor": material.metal,
        "roughnessFactor": material.rough,
    }
    made: dict[str, object] = {"name": material.name, "pbrMetallicRoughness": surface}
    if material.shadow or material.unlit:
        made |= {"extensions": {"KHR_materials_unlit": {}}}
    if material.shadow:
        made |= {"alphaMode": "BLEND"}
    return made


def _row(values: NDArray[np.generic]) -> list[float]:
    return [round(float(value), 5) for value in values.tolist()]
