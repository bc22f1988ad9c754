"""Section 4.24: boost adds to the motor's output, so that small deviations are answered.

The effect table of this section is that of the dead band, word for word, and contradicts its prose; the prose counts.
"""

import pytest

from unit.sim.desk import FREE, QUIET, Desk
from unit.sim.response import step, watch

BASE = QUIET | {"angle_dead_band": 0, "angle_p_gain": 5}


@pytest.mark.states("B81")
def test_boost_moves_a_horn_that_a_small_deviation_does_not() -> None:
    for boost, moves in ((0, False), (50, True)):
        response = step(Desk(rom=BASE | {"angle_boost": boost}), target=8, seconds=1.0)
        assert (response.readings[-1] > 0) is moves


@pytest.mark.states("B81")
@pytest.mark.parametrize("cascade", [0, 1])
def test_more_boost_answers_smaller_deviations(cascade: int) -> None:
    def smallest_answered(boost: int) -> int:
        for target in range(1, 40):
            desk = Desk(rom=BASE | {"speed_torque_control": cascade, "speed_i_gain": 0, "angle_boost": boost})
            if step(desk, target, 0.5).readings[-1]:
                return target
        raise AssertionError("none is answered")

    found = [smallest_answered(boost) for boost in (0, 15, 40)]
    assert found[0] > found[1] > found[2]


@pytest.mark.states("B81")
@pytest.mark.parametrize("cascade", [0, 1])
@pytest.mark.parametrize("target", [20, -20])
def test_it_adds_its_tenths_of_a_percent_to_the_output(target: int, cascade: int) -> None:
    def output(boost: int) -> int:
        rom = BASE | {"speed_torque_control": cascade, "speed_i_gain": 0, "smoothing": 0, "angle_boost": boost}
        desk = Desk(rom=rom | {"angle_p_gain": 1}).under(load_inertia=500.0)  # as good as a vice
        desk.write("0x00", target)
        return abs(watch(desk, "0x0A", 0.05)[-1])

    assert output(100) - output(0) == pytest.approx(10, abs=1)


@pytest.mark.states("B81")
def test_within_the_dead_band_it_does_nothing() -> None:
    desk = Desk(rom=BASE | {"angle_boost": 100, "angle_dead_band": 30})
    assert set(step(desk, target=25, seconds=0.5).readings) == {0}


@pytest.mark.states("B81")
@pytest.mark.parametrize(("name", "raw"), [("0x01", 60), ("0x02", 15)])
def test_it_does_nothing_under_a_speed_or_torque(name: str, raw: int) -> None:
    def course(boost: int) -> list[int]:
        desk = Desk(rom=FREE | {"angle_boost": boost})
        desk.write(name, raw)
        return watch(desk, "0x09", 0.5)

    assert course(0) == course(100)


@pytest.mark.states("B81", "B101")
def test_a_firmware_without_the_row_has_no_boost() -> None:
    desk = Desk(firmware="1.100", rom=BASE)
    assert desk.read("0x2F") == 0
    assert step(desk, target=8, seconds=1.0).readings[-1] == 0
