"""The committed models are up to date, fit the sizes of the scene, and have the right orientation."""

import json
import struct
from typing import Any

import numpy as np
import pytest

from hornbill.view.case import CASES, HORN_REACH, MM, Case
from hornbill.view.models import Name, glb, triangles
from tools.meshes.__main__ import FOLDER, bake

NAMES: tuple[Name, ...] = (
    "bla21-near", "bla21-far", "bla15-near", "bla15-far", "plain-near", "plain-far",
    "horn-near", "horn-far", "horn-ghost",
)  # fmt: skip


def document(content: bytes) -> dict[str, Any]:
    magic, version, total, length, kind = struct.unpack_from("<4sIII4s", content)
    assert (magic, version, total, kind) == (b"glTF", 2, len(content), b"JSON")
    return json.loads(content[20 : 20 + length])


def numbers(content: bytes, attribute: str, kind: str) -> list[Any]:
    """An attribute of every primitive."""
    described = document(content)
    start = 28 + struct.unpack_from("<I", content, 12)[0]
    found: list[Any] = []
    for primitive in described["meshes"][0]["primitives"]:
        accessor = described["accessors"][primitive["attributes"][attribute]]
        view = described["bufferViews"][accessor["bufferView"]]
        begin = start + view["byteOffset"]
        found.append(np.frombuffer(content[begin : begin + view["byteLength"]], dtype=kind))
    return found


def test_the_committed_models_are_up_to_date() -> None:
    """Rounding may differ between machines in the last digit, so not to the byte."""
    baked = bake()
    for name in (path.stem for path in FOLDER.glob("*.glb")):
        remedy = f"{name}.glb is out of date: python -m tools.meshes"
        committed, fresh = (FOLDER / f"{name}.glb").read_bytes(), baked[f"{name}.glb"]
        assert document(committed)["materials"] == document(fresh)["materials"], remedy
        colours = ("COLOR_0", "<f4", 0.02) if name.endswith("-low") else ("COLOR_0", "u1", 3)
        for attribute, kind, tolerance in (("POSITION", "<f4", 2e-5), colours):
            for old, new in zip(numbers(committed, attribute, kind), numbers(fresh, attribute, kind), strict=True):
                assert old.shape == new.shape, remedy
                assert np.abs(old.astype(float) - new.astype(float)).max() <= tolerance, remedy


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.key)
@pytest.mark.parametrize("detail", ["near", "far"])
def test_a_case_fills_its_box_on_the_floor(case: Case, detail: str) -> None:
    name: Name = f"{case.key}-{detail}"  # type: ignore[assignment]
    points, _ = triangles(name)
    low, high = case.box
    assert points[:, 2].min() == pytest.approx(0.0, abs=0.01)
    assert points[:, 0].max() == pytest.approx(high[0], abs=0.6)  # the shadow on the floor
    assert case.top * MM < points[:, 2].max() < high[2]
    body = points[(points[:, 2] > 0.2) & (points[:, 0] > case.back * MM)]
    assert body[:, 1].min() == pytest.approx(low[1], abs=0.02)


def test_the_arm_points_to_zero_and_has_a_notch() -> None:
    points, _ = triangles("horn-near")
    assert points[:, 1].max() == pytest.approx(HORN_REACH, abs=0.02)
    assert points[:, 1].min() > -0.5 * HORN_REACH
    assert points[:, 0].max() == pytest.approx(-points[:, 0].min(), abs=1e-4)
    tip = points[(np.abs(points[:, 0]) < 1e-4) & (points[:, 1] > 0.8 * HORN_REACH)]
    assert tip[:, 1].max() == pytest.approx(HORN_REACH - 1.7 * MM, abs=0.04)


@pytest.mark.parametrize("name", NAMES)
def test_triangles_face_outwards(name: Name) -> None:
    """The signed volume of a closed, outward surface is positive; inside out it would be negative."""
    points, faces = triangles(name)
    a, b, c = (points[faces[:, corner]].astype(float) for corner in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() > 0


@pytest.mark.parametrize("name", [name for name in NAMES if not name.startswith("horn-ghost")])
def test_low_quality_is_one_unlit_part_of_the_same_size(name: Name) -> None:
    far: Name = name.replace("near", "far")  # type: ignore[assignment]
    high, low = glb(far, "high"), glb(name, "low")
    (material,) = document(low)["materials"]
    assert material["extensions"] == {"KHR_materials_unlit": {}}
    (points,) = numbers(low, "POSITION", "<f4")
    limit = 2000 if "near" in name else 500
    assert len(points) / 3 < limit
    solid = [part for part in numbers(high, "POSITION", "<f4") if part.reshape(-1, 3)[:, 2].max() > 0.1]
    assert points.reshape(-1, 3).max(axis=0) == pytest.approx(
        np.concatenate(solid).reshape(-1, 3).max(axis=0), abs=0.12
    )


def test_colours_are_linear() -> None:
    """sRGB 163 is 0.366 of full light; 163 / 255 = 0.639 would be too bright."""
    horn = document(glb("horn-near", "high"))["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"]
    assert horn[0] == pytest.approx(0.366, abs=0.002)


def test_models_need_no_decoder_and_have_few_triangles() -> None:
    for name in NAMES:
        assert document(glb(name, "high"))["extensionsUsed"] == ["KHR_materials_unlit"]
        assert all("uri" not in buffer for buffer in document(glb(name, "high"))["buffers"])
    for name in ("bla21-far", "bla15-far", "horn-far", "horn-ghost"):
        assert len(triangles(name)[1]) < 2200
