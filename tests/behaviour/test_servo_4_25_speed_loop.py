"""Sections 4.25 to 4.28: the speed loop inside the angle loop: two gains, a deadband, and a limit of the I part."""

import pytest

from behaviour.servo_story import follow, near, under
from unit.sim.desk import FREE, MODELS, Desk
from unit.sim.response import step, watch


def deviation(rpm: int, load_pct: float, seconds: float, **rom: int) -> float:
    """By how much the speed remains below the command, in rpm."""
    desk = Desk(rom=FREE | rom).under(load_pct=load_pct)
    desk.run("0x01", rpm, seconds)
    assert desk.read("0x09") == pytest.approx(desk.servo.speed_rpm, abs=0.6)
    return rpm - desk.servo.speed_rpm


@pytest.mark.states("B82")
def test_a_larger_p_gain_follows_faster_and_remains_closer_under_a_load() -> None:
    slow, fast = (deviation(100, 0.0, 0.02, speed_p_gain=gain, smoothing=0) for gain in (5, 50))
    assert slow > fast
    small, medium, large = (deviation(80, -30.0, 2.0, speed_p_gain=gain, speed_i_gain=0) for gain in (10, 30, 100))
    assert small > medium > large >= 0


@pytest.mark.states("B82")
def test_the_i_gain_corrects_the_remaining_deviation_sooner_the_larger_it_is() -> None:
    def errors(gain: int) -> list[int]:
        desk = Desk(rom=FREE | {"speed_i_gain": gain, "speed_p_gain": 10, "speed_i_limit": 500_000, "smoothing": 0})
        desk.under(load_pct=-20.0)
        desk.write("0x01", 60)
        speeds = watch(desk, "0x09", 1.0)
        return [60 - speeds[n] for n in (4, 9, 29, 99)]

    without, slow, quick = errors(0), errors(1), errors(3)
    assert without[2] == without[3] > 10
    assert slow[0] > slow[1] > slow[2]
    assert quick[0] < slow[0]
    assert max(abs(slow[3]), abs(quick[3])) <= 1


@pytest.mark.states("B82")
def test_within_the_deadband_a_deviation_is_not_corrected() -> None:
    narrow, wide = (deviation(60, -8.0, 4.0, speed_dead_band=each, speed_i_gain=20) for each in (0, 2_000))
    assert abs(narrow) < 0.2
    assert 1.0 < abs(wide) < 2.5
    assert abs(deviation(60, -8.0, 4.0, speed_dead_band=0, speed_i_gain=0)) > 0.5


@pytest.mark.states("B82")
def test_the_limit_of_the_i_part_bounds_its_correction() -> None:
    limits = (1, 1_500, 3_000, 500_000)
    found = [round(deviation(60, -30.0, 4.0, speed_i_limit=limit, speed_i_gain=20)) for limit in limits]
    assert found[0] > found[1] > found[2] > found[3] == 0


@pytest.mark.states("B82")
def test_the_correction_ends_with_the_load() -> None:
    desk = Desk(rom=FREE | {"speed_i_gain": 20, "speed_i_limit": 500_000}).under(load_pct=-30.0)
    follow(desk, ("0x01", 60, 3.0), under(load_pct=0.0), 2.0, {"0x09": near(60, 1)})


@pytest.mark.states("B82")
def test_the_loop_acts_on_angles_too() -> None:
    def left(i_gain: int) -> int:
        return step(Desk(rom=FREE | {"speed_i_gain": i_gain, "angle_dead_band": 0}).under(load_pct=-15.0)).left

    assert left(0) > left(20)


@pytest.mark.states("B82")
@pytest.mark.parametrize("key", ["speed_p_gain", "speed_i_gain"])
def test_the_gains_have_no_effect_on_a_torque(key: str) -> None:
    def course(gain: int) -> list[int]:
        desk = Desk(rom=FREE | {key: gain})
        desk.write("0x02", 20)
        return watch(desk, "0x09", 0.5)

    assert course(1) == course(100)


@pytest.mark.states("B82", "B105")
@pytest.mark.parametrize("model", MODELS)
def test_every_model_holds_a_speed_with_its_defaults(model: str) -> None:
    desk = Desk(model, rom=FREE)
    desk.run("0x01", 60, 1.0)
    assert set(watch(desk, "0x09", 1.0)) <= {59, 60, 61}
