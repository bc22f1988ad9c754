"""Rotations and points of angles and limits: 0° is +y, positive is clockwise seen from above."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from hornbill.view.geometry import BAND_FACES, band, dashed, horn_wxyz, rim, scale_lines, span, wrapped


def turned(wxyz: tuple[float, float, float, float], point: NDArray[np.float64]) -> NDArray[np.float64]:
    """A point turned by a unit quaternion, by the textbook formula."""
    w, axis = wxyz[0], np.array(wxyz[1:])
    return point + 2 * np.cross(axis, np.cross(axis, point) + w * point)


NOTCH = np.array([0.0, 1.0, 0.0])


@pytest.mark.parametrize(
    ("angle", "expected"),
    [
        (0.0, (0, 1, 0)),
        (90.0, (1, 0, 0)),  # the viewer looks down -z with +y up: clockwise is towards +x
        (-90.0, (-1, 0, 0)),
        (180.0, (0, -1, 0)),
        (45.0, (2**-0.5, 2**-0.5, 0)),
        (270.0, (-1, 0, 0)),
        (-36_000_000.0 + 90.0, (1, 0, 0)),
    ],
)
def test_a_positive_angle_turns_the_notch_clockwise_seen_from_above(
    angle: float, expected: tuple[float, float, float]
) -> None:
    assert turned(horn_wxyz(angle), NOTCH) == pytest.approx(expected, abs=1e-6)


@given(st.floats(-36_000_000, 36_000_000))
def test_limit_arc_and_horn_have_the_same_direction(angle: float) -> None:
    assert turned(horn_wxyz(angle), NOTCH) == pytest.approx(rim(np.array([wrapped(angle)]), 1.0)[0], abs=1e-5)
    assert np.linalg.norm(horn_wxyz(angle)) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("cw", "ccw", "expected"),
    [
        (90.0, -75.0, (-75.0, 90.0)),
        (179.9, -180.0, (-180.0, 180.0)),
        (720.0, -720.0, (-180.0, 180.0)),
        (0.0, 0.0, (0.0, 0.0)),
        (-5.0, 5.0, (5.0, 5.0)),
        (300.0, 100.0, (100.0, 300.0)),
    ],
)
def test_limits_of_a_full_turn_close_the_ring(cw: float, ccw: float, expected: tuple[float, float]) -> None:
    assert span(cw, ccw) == expected


def test_the_band_lies_between_its_radii_and_faces_up() -> None:
    points = band(90.0, -75.0, 1.0, 1.2)
    radii = np.linalg.norm(points, axis=1)
    assert radii[0::2] == pytest.approx(1.0)
    assert radii[1::2] == pytest.approx(1.2)
    a, b, c = (points[BAND_FACES[:, corner]] for corner in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()
    assert BAND_FACES.max() == len(points) - 1


@given(st.floats(0, 720), st.floats(-720, 0))
def test_the_band_has_the_same_number_of_points_for_any_limits(cw: float, ccw: float) -> None:
    assert band(cw, ccw, 1.0, 1.2).shape == band(90, -90, 1.0, 1.2).shape


def ticks(lines: NDArray[np.float32]) -> NDArray[np.float64]:
    """The angles of the pieces that run outwards."""
    inner, outer = np.linalg.norm(lines[:, 0], axis=1), np.linalg.norm(lines[:, 1], axis=1)
    radial = lines[outer - inner > 0.01][:, 1]
    return np.degrees(np.arctan2(radial[:, 0], radial[:, 1]))


def test_the_scale_has_a_tick_every_ten_degrees_and_marks_both_limits() -> None:
    found = sorted(round(float(angle), 3) for angle in ticks(scale_lines(36.0, -24.0, 1.2, tick=0.05, end=0.2)))
    assert found == [-24.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0, 36.0]
    assert len(ticks(scale_lines(180.0, -180.0, 1.2, tick=0.05, end=0.2))) == 36, "a closed scale has no ends"


def test_dashes_cover_their_share_of_the_outline() -> None:
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=np.float64)
    pieces = dashed(square, 0.06, 0.04)
    assert np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1).sum() == pytest.approx(4 * 0.6, rel=0.02)
