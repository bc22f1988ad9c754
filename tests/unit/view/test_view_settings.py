"""Settings that a page may send for its frame, and invalid ones."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.view import layout
from hornbill.view.case import ARC_HEIGHT, ARC_REACH, CASES, HORN_REACH
from hornbill.view.pose import Pose
from hornbill.view.settings_socket import LARGEST
from hornbill.view.view_settings import KEY, MAX_FRAMES, FrameSettings, InvalidSettings, ViewSettings, Wall, read

UID, OTHER = "0" * 31 + "7", "0" * 31 + "8"


def test_settings_are_read() -> None:
    assert read("{}") == ViewSettings()
    sent = {
        "select": UID, "theme": "light", "quality": "low", "visible": False, "resets": 3, "alone": True,
        "wall": {"columns": 4, "scale": 0.5, "uids": [UID]},
        "poses": [
            {"uid": UID, "series": "BLA15", "angle": 12.5, "command": None, "limit_cw": 60.0, "limit_ccw": -45.0},
            {"uid": OTHER, "stale": True},
        ],
    }  # fmt: skip
    settings = read(json.dumps(sent))
    poses = (
        Pose(UID, "", "BLA15", 12.5, None, 60.0, -45.0, stale=False),
        Pose(OTHER, "", "", None, None, None, None, stale=True),
    )
    assert settings == ViewSettings(
        selected=UID, dark=False, quality="low", visible=False, resets=3, alone=True, wall=Wall(4, 0.5, (UID,)),
        poses=poses,
    )  # fmt: skip


def test_poses_of_a_full_bus_fit_into_a_message() -> None:
    """The longest numbers that the page sends, for the largest number of servos."""
    one = {"uid": UID, "series": "BLA15", "angle": -1234.567891, "command": -1234.567891}
    one |= {"limit_cw": 1234.567891, "limit_ccw": -1234.567891, "stale": False}
    text = json.dumps({"select": UID, "poses": [one] * 256}, separators=(",", ":"))
    assert len(text) <= LARGEST
    assert len(read(text).poses or ()) == 256


@pytest.mark.parametrize(
    "wrong",
    [
        {"select": "../x"},
        {"theme": "pink"},
        {"quality": "highest"},
        {"command": 90},
        {"wall": {"columns": 0, "scale": 1.0, "uids": []}},
        {"wall": {"columns": 4, "scale": 1e9, "uids": []}},
        {"wall": {"columns": 4, "scale": 1.0, "uids": [UID] * 257}},
        {"poses": [{"uid": UID, "angle": 1e300}]},
        {"poses": [{"uid": UID, "series": "BLA99"}]},
        {"poses": [{"uid": UID, "torque": "on"}]},
        {"poses": [{"angle": 1.0}]},
        {"poses": [{"uid": UID}] * 257},
        {"resets": -1},
        [],
        "{}",
    ],
)
def test_invalid_settings_are_rejected(wrong: Any) -> None:
    with pytest.raises(InvalidSettings):
        read(json.dumps(wrong))


@given(st.binary(max_size=300))
def test_any_bytes_are_settings_or_rejected(data: bytes) -> None:
    try:
        read(data)
    except InvalidSettings:
        return


def test_a_key_is_long_and_hexadecimal() -> None:
    assert KEY.fullmatch("a" * 32)
    for key in ("", "abc", "g" * 32, "A" * 32, "a" * 65, "a" * 32 + "\n"):
        assert not KEY.fullmatch(key)


def test_each_key_has_its_settings_and_the_oldest_are_deleted() -> None:
    frames = FrameSettings()
    assert frames.of("never") == ViewSettings()
    frames.put("first", ViewSettings(dark=False))
    for number in range(MAX_FRAMES):
        frames.put(f"{number}", ViewSettings(resets=number))
    assert frames.of("first") == ViewSettings()
    assert [frames.of(str(number)).resets for number in (0, MAX_FRAMES - 1)] == [0, MAX_FRAMES - 1]


def test_the_page_projects_names_on_the_wall_with_the_camera_of_the_view() -> None:
    """The page computes the position of a servo in the picture with the same numbers."""
    source = Path(__file__).parents[3] / "web" / "src" / "view3d" / "wall-projection.ts"
    text = source.read_text("utf-8")
    for name, value in (
        ("CAMERA", layout.WALL_CAMERA_POSITION),
        ("PITCH", layout.WALL_PITCH),
        ("FOV_DEG", layout.WALL_CAMERA_FOV_DEG),
        ("NEARER", layout.WALL_NEARER),
        ("ARC", round(HORN_REACH * ARC_REACH, 2)),
        ("TALL", round(max(case.pivot + ARC_HEIGHT * case.horn for case in CASES), 2)),
    ):
        numbers = ", ".join(f"{part:g}" for part in value) if isinstance(value, tuple) else f"{value:g}"
        expected = f"[{numbers}]" if isinstance(value, tuple) else numbers
        assert f"export const {name} = {expected}" in text, f"{name} is {expected} in hornbill.view.layout"
    assert layout.WALL_CAMERA_TARGET == (0.0, 0.0, 0.0)
