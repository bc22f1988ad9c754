"""What a page may settings of its frame, and what is refused."""

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


def test_an_empty_object_is_the_usual_wish() -> None:
    assert read("{}") == ViewSettings()


def test_everything_of_a_wish_is_taken_over() -> None:
    told = {
        "select": UID, "theme": "light", "quality": "low", "visible": False, "resets": 3, "alone": True,
        "wall": {"columns": 4, "scale": 0.5, "uids": [UID]},
        "poses": [
            {"uid": UID, "series": "BLA15", "angle": 12.5, "command": None, "limit_cw": 60.0, "limit_ccw": -45.0},
            {"uid": OTHER, "stale": True},
        ],
    }  # fmt: skip
    settings = read(json.dumps(told))
    assert (settings.selected, settings.dark, settings.quality, settings.visible, settings.resets) == (
        UID,
        False,
        "low",
        False,
        3,
    )
    assert settings.alone
    assert settings.wall == Wall(4, 0.5, (UID,))
    assert settings.poses == (
        Pose(UID, "", "BLA15", 12.5, None, 60.0, -45.0, stale=False),
        Pose(OTHER, "", "", None, None, None, None, stale=True),
    )


def test_an_instant_of_a_full_bus_is_within_what_a_socket_takes() -> None:
    """The longest numbers the page sends, for as many servos as a settings may show."""
    one = {"uid": UID, "series": "BLA15", "angle": -1234.567891, "command": -1234.567891}
    one |= {"limit_cw": 1234.567891, "limit_ccw": -1234.567891, "stale": False}
    told = json.dumps({"select": UID, "poses": [one] * 256}, separators=(",", ":"))
    assert len(told) <= LARGEST
    assert len(read(told).poses or ()) == 256


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
def test_what_is_no_wish_is_refused(wrong: Any) -> None:
    with pytest.raises(InvalidSettings):
        read(json.dumps(wrong))


@given(st.binary(max_size=300))
def test_no_bytes_do_more_than_be_refused(data: bytes) -> None:
    try:
        read(data)
    except InvalidSettings:
        return


@pytest.mark.parametrize("key", ["", "abc", "g" * 32, "A" * 32, "a" * 65, "a" * 32 + "\n"])
def test_a_key_is_hex_and_long(key: str) -> None:
    assert not KEY.fullmatch(key)


def test_each_key_has_a_wish_of_its_own_and_the_oldest_is_forgotten() -> None:
    frames = FrameSettings()
    assert frames.of("never") == ViewSettings()
    frames.put("first", ViewSettings(dark=False))
    for number in range(MAX_FRAMES):
        frames.put(f"{number}", ViewSettings(resets=number))
    assert frames.of("first") == ViewSettings()
    assert [frames.of(str(number)).resets for number in (0, MAX_FRAMES - 1)] == [0, MAX_FRAMES - 1]


def test_the_page_lays_names_over_the_wall_with_the_camera_the_view_has() -> None:
    """The page computes where a servo of the wall is in the picture: with these numbers, or beside it."""
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
        said = f"[{numbers}]" if isinstance(value, tuple) else numbers
        assert f"export const {name} = {said}" in text, f"{name} is {said} in hornbill.view.layout"
    assert layout.WALL_CAMERA_TARGET == (0.0, 0.0, 0.0)
