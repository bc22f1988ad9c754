"""Sections 4.25 to 4.28: the speed loop inside the angle loop: two gains, a dead band, and a limit of the I part."""

import pytest

from unit.sim.desk import FREE, MODELS, Desk
from unit.sim.response import step, watch


@pytest.mark.states("B82")
def test_a_larger_speed_p_gain_follows_closer() -> None:
    def soon_after(gain: int) -> int:
        desk = Desk(rom=FREE | {"speed_p_gain": gain, "smoothing": 0})
        desk.write("0x01", 100)
        desk.wait(0.02)
        return desk.read("0x09") or 0

    assert soon_after(5) < soon_after(50)


@pytest.mark.states("B82")
def test_a_larger_speed_p_gain_leaves_less_under_a_load() -> None:
    def left_over(gain: int) -> int:
        desk = Desk(rom=FREE | {"speed_p_gain": gain, "speed_i_gain": 0}).under(load_pct=-30.0)
        desk.write("0x01", 80)
        desk.wait(2.0)
        return 80 - (desk.read("0x09") or 0)

    assert left_over(10) > left_over(30) > left_over(100) >= 0


@pytest.mark.states("B82")
def test_the_integral_gain_takes_away_what_a_load_leaves() -> None:
    def speed_error(gain: int) -> int:
        desk = Desk(rom=FREE | {"speed_i_gain": gain, "speed_dead_band": 0})
        desk.servo.conditions.load_pct = -8.0
        desk.write("0x01", 60)
        desk.wait(4.0)
        return abs((desk.read("0x09") or 0) - 60)

    assert speed_error(0) > speed_error(20) == 0


@pytest.mark.states("B82")
def test_it_does_so_over_time_the_sooner_the_larger_it_is() -> None:
    def error_after(gain: int) -> list[int]:
        desk = Desk(rom=FREE | {"speed_i_gain": gain, "speed_p_gain": 10, "speed_i_limit": 500_000, "smoothing": 0})
        desk.under(load_pct=-20.0)
        desk.write("0x01", 60)
        speeds = watch(desk, "0x09", 1.0)
        return [60 - speeds[n] for n in (4, 9, 29, 99)]

    without, slow, quick = error_after(0), error_after(1), error_after(3)
    assert without[2] == without[3] > 10
    assert slow[0] > slow[1] > slow[2]
    assert quick[0] < slow[0]
    assert max(abs(slow[3]), abs(quick[3])) <= 1


@pytest.mark.states("B82")
def test_within_the_speed_dead_band_a_deviation_is_left_alone() -> None:
    def left_over(dead_band: int) -> float:
        desk = Desk(rom=FREE | {"speed_dead_band": dead_band, "speed_i_gain": 20}).under(load_pct=-8.0)
        desk.write("0x01", 60)
        desk.wait(4.0)
        return abs(60 - desk.servo.speed_rpm)

    assert left_over(0) < 0.2
    assert 1.0 < left_over(2_000) < 2.5


@pytest.mark.states("B82")
def test_the_limit_of_the_i_part_bounds_what_it_adds() -> None:
    def left_over(limit: int) -> int:
        desk = Desk(rom=FREE | {"speed_i_limit": limit, "speed_i_gain": 20}).under(load_pct=-30.0)
        desk.write("0x01", 60)
        desk.wait(4.0)
        return 60 - (desk.read("0x09") or 0)

    found = [left_over(limit) for limit in (1, 1_500, 3_000, 500_000)]
    assert found[0] > found[1] > found[2] > found[3] == 0


@pytest.mark.states("B82")
def test_what_was_added_does_not_stay_when_the_load_goes() -> None:
    desk = Desk(rom=FREE | {"speed_i_gain": 20, "speed_i_limit": 500_000}).under(load_pct=-30.0)
    desk.write("0x01", 60)
    desk.wait(3.0)
    desk.under(load_pct=0.0).wait(2.0)
    assert desk.read("0x09") == pytest.approx(60, abs=1)


@pytest.mark.states("B82")
def test_the_loop_serves_angles_too() -> None:
    def left_over(i_gain: int) -> int:
        return step(Desk(rom=FREE | {"speed_i_gain": i_gain, "angle_dead_band": 0}).under(load_pct=-15.0)).left

    assert left_over(0) > left_over(20)


@pytest.mark.states("B82")
@pytest.mark.parametrize("key", ["speed_p_gain", "speed_i_gain"])
def test_it_does_nothing_under_a_torque(key: str) -> None:
    def course(gain: int) -> list[int]:
        desk = Desk(rom=FREE | {key: gain})
        desk.write("0x02", 20)
        return watch(desk, "0x09", 0.5)

    assert course(1) == course(100)


@pytest.mark.states("B82", "B105")
@pytest.mark.parametrize("model", MODELS)
def test_with_what_it_is_delivered_with_every_model_keeps_a_speed(model: str) -> None:
    desk = Desk(model, rom=FREE)
    desk.write("0x01", 60)
    desk.wait(1.0)
    assert set(watch(desk, "0x09", 1.0)) <= {59, 60, 61}
