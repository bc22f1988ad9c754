"""Where servos stand, and which one a click meets."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hornbill.view.case import BLA15, BLA21, HORN_REACH
from hornbill.view.layout import pick, place
from unit.view.servos import pose


def test_the_selected_servo_stands_at_the_origin_and_the_others_keep_their_places() -> None:
    poses = [pose(number) for number in range(8)]
    first, others = place(poses, poses[2].uid)
    assert first is not None
    assert (first.pose, first.at) == (poses[2], (0.0, 0.0, 0.0))
    before = {servo.pose.uid: servo.at for servo in others}
    _, later = place(poses, poses[5].uid)
    moved = {servo.pose.uid for servo in later if before.get(servo.pose.uid) != servo.at}
    assert moved == {poses[2].uid}


@given(st.integers(1, 127), st.integers(0, 126))
def test_horns_never_reach_each_other(count: int, selected: int) -> None:
    poses = [pose(number) for number in range(count)]
    first, others = place(poses, poses[selected % count].uid)
    assert first is not None
    assert len(others) == count - 1
    places = np.array([servo.at for servo in (first, *others)])
    apart = np.abs(places[:, None, :] - places[None, :, :]).max(axis=2)
    assert (apart + np.eye(count) * 9 > 2 * HORN_REACH).all()


def test_nobody_is_selected_when_the_uid_is_unknown() -> None:
    first, others = place([pose(1), pose(2)], "nobody")
    assert first is None
    assert len(others) == 2


def test_each_series_has_its_case_and_an_unknown_model_the_larger_one() -> None:
    _, others = place([pose(1, series="BLA15"), pose(2), pose(3, series="")], None)
    assert [servo.case for servo in others] == [BLA15, BLA21, BLA21]


def test_a_click_meets_the_nearest_servo_on_its_ray() -> None:
    poses = [pose(number) for number in range(6)]
    first, others = place(poses, poses[0].uid)
    assert first is not None
    everybody = [first, *others]
    for servo in everybody:
        x, y, _ = servo.at
        assert pick((x, y, 9.0), (0.0, 0.0, -1.0), everybody) == servo.pose.uid
    near, behind = others[0].at, others[-1].at
    assert near[1] < behind[1]
    row = [servo for servo in others if servo.at[0] == near[0]]
    assert len(row) > 1
    assert pick((near[0], near[1] - 20, 0.5), (0.0, 1.0, 0.0), row) == others[0].pose.uid


def test_a_click_beside_every_servo_meets_none() -> None:
    first, _ = place([pose(1)], pose(1).uid)
    assert first is not None
    assert pick((0.0, -10.0, 1.0), (1.0, 0.0, 0.0), [first]) is None
    assert pick((0.0, -10.0, 1.0), (0.0, -1.0, 0.0), [first]) is None  # it is behind the eye
