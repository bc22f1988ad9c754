"""Section 4.21: the proportional gain of the angle: more of it holds harder, and hunts sooner."""

import pytest

from unit.sim.desk import FREE, MODELS, Desk
from unit.sim.response import step, watch

NERVOUS = FREE | {"angle_d_gain": 0, "angle_dead_band": 0}


def heavy(p_gain: int, model: str = "BLA21-12U-A0", **rom: int) -> Desk:
    """A horn with three times its own inertia on it."""
    return Desk(model, rom=NERVOUS | {"angle_p_gain": p_gain} | rom).under(load_inertia=3.0)


@pytest.mark.states("B78")
@pytest.mark.parametrize("cascade", [0, 1])
def test_a_larger_p_gain_holds_harder(cascade: int) -> None:
    def left_over(p_gain: int) -> int:
        rom = FREE | {"speed_torque_control": cascade, "speed_i_gain": 0, "angle_p_gain": p_gain}
        return step(Desk(rom=rom).under(load_pct=-40.0), seconds=1.0).left

    left = [left_over(p_gain) for p_gain in (10, 40, 100)]
    assert left[0] > left[1] > left[2]


@pytest.mark.states("B78")
@pytest.mark.parametrize("cascade", [0, 1])
def test_a_deviation_is_answered_with_a_force_that_grows_with_it_and_with_the_gain(cascade: int) -> None:
    def force(p_gain: int, deviation: int) -> int:
        rom = FREE | {"speed_torque_control": cascade, "speed_i_gain": 0, "angle_p_gain": p_gain, "smoothing": 0}
        desk = Desk(rom=rom).under(load_inertia=500.0)  # as good as a vice
        desk.write("0x00", deviation)
        return max(watch(desk, "0x0A", 0.02))

    assert 0 < force(10, 10) < force(10, 20) < force(10, 40)
    assert force(10, 10) < force(40, 10)


@pytest.mark.states("B78")
@pytest.mark.parametrize("model", MODELS)
def test_no_model_hunts_with_the_gains_it_is_delivered_with(model: str) -> None:
    desk = Desk(model, rom=FREE).under(load_inertia=3.0)
    assert step(desk).hunting == 0


@pytest.mark.states("B78")
def test_too_much_hunts_by_about_a_degree_to_either_side() -> None:
    calm, nervous = step(heavy(40), seconds=4.0), step(heavy(100), seconds=4.0)
    assert calm.hunting == 0
    assert 10 <= nervous.hunting <= 40
    assert nervous.swings > 5


@pytest.mark.states("B78")
def test_more_of_it_hunts_more() -> None:
    found = [step(heavy(p_gain), seconds=4.0).hunting for p_gain in (40, 80, 100)]
    assert found[0] < found[1] < found[2]


@pytest.mark.states("B78")
def test_whether_it_hunts_depends_on_the_load_on_the_horn() -> None:
    bare = heavy(100).under(load_inertia=0.0)
    assert step(bare, seconds=4.0).hunting <= 2
    assert step(heavy(100), seconds=4.0).hunting >= 10


@pytest.mark.states("B78")
@pytest.mark.parametrize(("name", "raw"), [("0x01", 60), ("0x02", 15)])
def test_it_changes_nothing_under_a_speed_or_torque(name: str, raw: int) -> None:
    def course(p_gain: int) -> list[int]:
        desk = heavy(p_gain)
        desk.write(name, raw)
        return watch(desk, "0x09", 1.0)

    assert course(1) == course(100)
