"""Sections 4.15 and 4.20 to 4.28: what the control parameters do to a step."""

import pytest

from unit.sim.desk import Desk

BASE = {"timeout_action": 0, "soft_start": 0}


def step(target: int = 450, load_pct: float = 0.0, **rom: int) -> tuple[Desk, int]:
    """A step to `target` and the furthest reading on the way."""
    desk = Desk(rom=BASE | rom)
    desk.servo.conditions.load_pct = load_pct
    desk.wait(0.1)
    desk.write("0x00", target)
    furthest = 0
    for _ in range(100):
        desk.wait(0.01)
        furthest = max(furthest, desk.read("0x08") or 0)
    return desk, furthest


@pytest.mark.parametrize("cascade", [0, 1])
def test_a_larger_p_gain_holds_harder(cascade: int) -> None:
    def left_over(p_gain: int) -> int:
        desk, _ = step(load_pct=-40.0, speed_torque_control=cascade, speed_i_gain=0, angle_p_gain=p_gain)
        return 450 - (desk.read("0x08") or 0)

    off = [left_over(p_gain) for p_gain in (10, 40, 100)]
    assert off[0] > off[1] > off[2]


def test_a_small_d_gain_overshoots_and_a_large_one_does_not() -> None:
    common = {"speed_torque_control": 1, "smoothing": 0, "angle_p_gain": 80}
    loose, tight = step(angle_d_gain=0, **common)[1], step(angle_d_gain=100, **common)[1]
    assert loose > 450 + 10
    assert tight < loose - 10


def test_d_has_no_effect_without_0x25() -> None:
    common = {"speed_torque_control": 0, "smoothing": 0, "angle_p_gain": 80}
    assert step(angle_d_gain=0, **common)[1] == step(angle_d_gain=100, **common)[1]


@pytest.mark.parametrize("cascade", [0, 1])
def test_within_the_dead_band_nothing_moves(cascade: int) -> None:
    rom = BASE | {"angle_dead_band": 50, "speed_torque_control": cascade}
    desk = Desk(rom=rom)
    desk.write("0x00", 49)
    desk.wait(1.0)
    assert desk.read("0x08") == 0
    desk.write("0x00", 60)
    desk.settle()
    assert 10 <= (desk.read("0x08") or 0) <= 60


def test_boost_moves_a_horn_that_a_small_deviation_does_not() -> None:
    for boost, moves in ((0, False), (50, True)):
        desk, _ = step(target=8, angle_dead_band=0, angle_p_gain=5, angle_boost=boost)
        assert ((desk.read("0x08") or 0) > 0) is moves


def test_the_integral_gain_takes_away_what_a_load_leaves() -> None:
    def speed_error(gain: int) -> int:
        desk = Desk(rom=BASE | {"speed_torque_control": 1, "speed_i_gain": gain, "speed_dead_band": 0})
        desk.servo.conditions.load_pct = -8.0
        desk.write("0x01", 60)
        desk.wait(4.0)
        return abs((desk.read("0x09") or 0) - 60)

    assert speed_error(0) > speed_error(20) == 0


def test_smoothing_levels_a_step() -> None:
    def speed_soon_after(smoothing: int) -> int:
        desk = Desk(rom=BASE | {"smoothing": smoothing})
        desk.write("0x00", 200)
        desk.wait(0.01)
        return desk.read("0x09") or 0

    assert speed_soon_after(1) < speed_soon_after(0)


@pytest.mark.parametrize("cascade", [0, 1])
def test_the_current_limit_takes_torque_away_with_and_without_0x25(cascade: int) -> None:
    desk, _ = step(load_pct=-90.0, target=900, overcurrent_limit=60, speed_torque_control=cascade)
    assert desk.read("0x0A") == pytest.approx(50, abs=2)
    desk, _ = step(load_pct=-90.0, target=900, overcurrent_limit=120, speed_torque_control=cascade)
    assert (desk.read("0x0A") or 0) > 80


def test_a_larger_speed_p_gain_follows_closer() -> None:
    def soon_after(gain: int) -> int:
        desk = Desk(rom=BASE | {"speed_torque_control": 1, "speed_p_gain": gain, "smoothing": 0})
        desk.write("0x01", 100)
        desk.wait(0.02)
        return desk.read("0x09") or 0

    assert soon_after(5) < soon_after(50)
