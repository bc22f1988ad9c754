"""Section 4.22: the derivative gain brakes before the target; it acts on angles with 0x25 on, and on nothing else."""

import pytest

from unit.sim.desk import FREE, MODELS, Desk
from unit.sim.response import Response, step, watch

LIVELY = FREE | {"smoothing": 0, "angle_p_gain": 80}


def answer(d_gain: int, inertia: float = 0.0, model: str = "BLA21-06U-A0", **rom: int) -> Response:
    desk = Desk(model, rom=LIVELY | {"angle_d_gain": d_gain} | rom).under(load_inertia=inertia)
    return step(desk, seconds=4.0)


@pytest.mark.states("B79")
def test_a_small_d_gain_overshoots_and_a_large_one_does_not() -> None:
    for inertia in (0.0, 0.5, 1.0):
        loose, tight = answer(0, inertia, angle_p_gain=40), answer(100, inertia, angle_p_gain=40)
        assert loose.overshoot > 20
        assert tight.overshoot < 0


@pytest.mark.states("B79")
@pytest.mark.parametrize("inertia", [0.0, 1.0, 3.0])
def test_the_more_of_it_the_less_overshoot(inertia: float) -> None:
    found = [answer(d_gain, inertia).overshoot for d_gain in (0, 40, 100)]
    assert found[0] > found[1] > found[2]


@pytest.mark.states("B79")
@pytest.mark.parametrize("model", MODELS)
def test_on_every_model(model: str) -> None:
    assert answer(100, 1.0, model).overshoot < answer(0, 1.0, model).overshoot


@pytest.mark.states("B79")
def test_it_slows_the_horn_before_the_target() -> None:
    def speed_near_the_target(d_gain: int) -> int:
        desk = Desk(rom=LIVELY | {"angle_d_gain": d_gain})
        desk.write("0x00", 900)
        while (desk.read("0x08") or 0) < 860:
            desk.wait(0.001)
        return desk.read("0x09") or 0

    assert speed_near_the_target(100) < speed_near_the_target(0)


@pytest.mark.states("B79")
def test_it_ends_the_hunting_of_too_much_p() -> None:
    assert answer(0, 3.0, angle_p_gain=100, angle_dead_band=0).hunting >= 10
    assert answer(60, 3.0, angle_p_gain=100, angle_dead_band=0).hunting <= 1


@pytest.mark.states("B79")
def test_d_has_no_effect_without_0x25() -> None:
    assert answer(0, speed_torque_control=0).readings == answer(100, speed_torque_control=0).readings


@pytest.mark.states("B79")
@pytest.mark.parametrize(("name", "raw"), [("0x01", 60), ("0x02", 15)])
def test_it_changes_nothing_under_a_speed_or_torque(name: str, raw: int) -> None:
    def course(d_gain: int) -> list[int]:
        desk = Desk(rom=LIVELY | {"angle_d_gain": d_gain})
        desk.write(name, raw)
        return watch(desk, "0x09", 1.0)

    assert course(0) == course(100)
