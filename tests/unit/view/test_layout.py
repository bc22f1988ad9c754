"""Places of servos, and the servo at a click."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hornbill.view.case import BLA15, BLA21, HORN_REACH, PLAIN
from hornbill.view.layout import WALL_NEARER, WALL_PITCH, pick, place, wall
from unit.view.servos import pose


def test_the_selected_servo_is_at_the_origin_and_others_keep_their_places() -> None:
    poses = [pose(number) for number in range(8)]
    first, others = place(poses, poses[2].uid)
    assert first is not None
    assert (first.pose, first.at) == (poses[2], (0.0, 0.0, 0.0))
    before = {servo.pose.uid: servo.at for servo in others}
    _, later = place(poses, poses[5].uid)
    moved = {servo.pose.uid for servo in later if before.get(servo.pose.uid) != servo.at}
    assert moved == {poses[2].uid}


@given(st.integers(1, 127), st.integers(0, 126))
def test_horns_never_touch(count: int, selected: int) -> None:
    poses = [pose(number) for number in range(count)]
    first, others = place(poses, poses[selected % count].uid)
    assert first is not None
    assert len(others) == count - 1
    places = np.array([servo.at for servo in (first, *others)])
    apart = np.abs(places[:, None, :] - places[None, :, :]).max(axis=2)
    assert (apart + np.eye(count) * 9 > 2 * HORN_REACH).all()


def test_an_unknown_uid_selects_no_servo() -> None:
    first, others = place([pose(1), pose(2)], "unknown")
    assert first is None
    assert len(others) == 2


def test_each_series_has_its_case_and_unknown_series_a_plain_one() -> None:
    _, others = place(
        [pose(1, series="BLA15"), pose(2), pose(3, series="BLA34"), pose(4, series=""), pose(5, series="BLA99")], None
    )
    assert [servo.case for servo in others] == [BLA15, BLA21, BLA21, PLAIN, PLAIN]


def test_a_click_selects_the_nearest_servo_on_its_ray() -> None:
    poses = [pose(number) for number in range(6)]
    first, others = place(poses, poses[0].uid)
    assert first is not None
    everything = [first, *others]
    for servo in everything:
        x, y, _ = servo.at
        assert pick((x, y, 9.0), (0.0, 0.0, -1.0), everything) == servo.pose.uid
    column = [others[0], others[3]]
    x, y, _ = column[0].at
    away = np.subtract(column[1].at, column[0].at)
    start = (x - away[0], y - away[1], 0.5)
    assert pick(start, (float(away[0]), float(away[1]), 0.0), column[::-1]) == column[0].pose.uid
    assert pick((0.0, -10.0, 1.0), (1.0, 0.0, 0.0), [first]) is None
    assert pick((0.0, -10.0, 1.0), (0.0, -1.0, 0.0), [first]) is None, "the servo is behind the eye"


@given(st.integers(1, 127), st.integers(1, 20), st.floats(0.05, 1.5))
def test_a_wall_has_a_place_for_each_servo_and_the_centre_of_the_page(count: int, columns: int, scale: float) -> None:
    poses = [pose(number) for number in range(count)]
    uids = [one.uid for one in poses]
    placed = wall(poses, uids, columns, scale)
    assert [servo.pose.uid for servo in placed] == uids
    places = np.array([servo.at for servo in placed])
    apart = np.abs(places[:, None, :] - places[None, :, :]).max(axis=2)
    assert (apart + np.eye(count) * 9 > 2 * HORN_REACH * scale).all()
    depth = WALL_PITCH[1] * scale * (-(-count // columns) - 1)
    assert np.isclose(places[0, 1], depth / 2 - WALL_NEARER * scale)
    assert np.isclose(places[:, 1].min(), -depth / 2 - WALL_NEARER * scale)
    assert all(pick((*servo.at[:2], 9.0), (0.0, 0.0, -1.0), placed) == servo.pose.uid for servo in placed[:5])


def test_a_missing_servo_leaves_its_place_in_the_wall_free() -> None:
    poses = [pose(1), pose(2), pose(3)]
    uids = [one.uid for one in poses]
    before, after = wall(poses, uids, 3, 1.0), wall([poses[0], poses[2]], uids, 3, 1.0)
    assert [servo.at for servo in after] == [before[0].at, before[2].at]
