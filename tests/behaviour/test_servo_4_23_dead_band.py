"""Section 4.23: within the dead band nothing is corrected; a wider one calms, and is less exact."""

import pytest

from unit.sim.desk import FREE, QUIET, Desk
from unit.sim.response import step, watch

NERVOUS = FREE | {"angle_p_gain": 100, "angle_d_gain": 0}


@pytest.mark.states("B80")
@pytest.mark.parametrize("cascade", [0, 1])
def test_within_the_dead_band_nothing_moves(cascade: int) -> None:
    rom = QUIET | {"angle_dead_band": 50, "speed_torque_control": cascade}
    desk = Desk(rom=rom)
    desk.write("0x00", 49)
    desk.wait(1.0)
    assert desk.read("0x08") == 0
    desk.write("0x00", 60)
    desk.settle()
    assert 10 <= (desk.read("0x08") or 0) <= 60


@pytest.mark.states("B80")
def test_the_smaller_it_is_the_smaller_the_deviation_that_is_answered() -> None:
    def answers(dead_band: int) -> list[bool]:
        deviations = (6, 15, 40)
        return [
            step(Desk(rom=FREE | {"angle_dead_band": dead_band}), each, 1.0).readings[-1] > 0 for each in deviations
        ]

    assert answers(3) == [True, True, True]
    assert answers(10) == [False, True, True]
    assert answers(30) == [False, False, True]


@pytest.mark.states("B80", "B78")
def test_a_wider_one_ends_the_hunting_of_too_much_p() -> None:
    def hunting(dead_band: int) -> int:
        desk = Desk("BLA21-12U-A0", rom=NERVOUS | {"angle_dead_band": dead_band}).under(load_inertia=3.0)
        return step(desk, seconds=5.0).hunting

    assert hunting(0) >= 10
    assert [hunting(dead_band) for dead_band in (10, 20, 30, 50)] == [0, 0, 0, 0]


@pytest.mark.states("B80")
def test_the_delivered_one_just_swallows_the_play_of_the_gear() -> None:
    # With much gain and none of it, the horn rattles within its play; at 0.3° it rests.
    def rests(dead_band: int) -> bool:
        desk = Desk(rom=FREE | {"angle_dead_band": dead_band, "angle_p_gain": 100, "angle_boost": 100})
        step(desk)
        return desk.servo.asleep

    assert (rests(0), rests(3)) == (False, True)


@pytest.mark.states("B80")
@pytest.mark.parametrize("cascade", [0, 1])
@pytest.mark.parametrize("dead_band", [3, 20, 50])
def test_a_horn_comes_to_rest_inside_it(dead_band: int, cascade: int) -> None:
    rom = QUIET | {"angle_dead_band": dead_band, "speed_torque_control": cascade}
    desk = Desk(rom=rom)
    assert step(desk).left <= dead_band
    desk.settle()


@pytest.mark.states("B80")
def test_it_does_nothing_under_a_speed() -> None:
    def course(dead_band: int) -> list[int]:
        desk = Desk(rom=FREE | {"angle_dead_band": dead_band})
        desk.write("0x01", 60)
        return watch(desk, "0x09", 0.5)

    assert course(0) == course(3_600)
