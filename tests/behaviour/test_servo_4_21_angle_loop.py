"""Sections 4.21 to 4.24: gains, deadband and boost of the angle loop.

The effect table of 4.24 is that of the deadband, word for word, and contradicts its text; the text is simulated.
"""

import pytest

from behaviour.servo_story import between, follow, go
from unit.sim.desk import FREE, MODELS, QUIET, Desk
from unit.sim.response import Response, step, watch

VISE = 500.0
"""A load inertia that keeps the horn from moving."""
cascaded = pytest.mark.parametrize("cascade", [0, 1])


@pytest.mark.states("B78", "B79", "B80", "B81")
@pytest.mark.parametrize(("name", "raw"), [("0x01", 60), ("0x02", 15)])
@pytest.mark.parametrize(
    ("key", "low", "high"),
    [("angle_p_gain", 1, 100), ("angle_d_gain", 0, 100), ("angle_boost", 0, 100), ("angle_dead_band", 0, 3_600)],
)
def test_none_has_an_effect_on_a_speed_or_torque(key: str, low: int, high: int, name: str, raw: int) -> None:
    def course(value: int) -> list[int]:
        desk = Desk("BLA21-12U-A0", rom=FREE | {"smoothing": 0, key: value}).under(load_inertia=1.0)
        desk.write(name, raw)
        return watch(desk, "0x09", 1.0)

    assert course(low) == course(high)


# The proportional gain.


def heavy(p_gain: int, inertia: float = 3.0, **rom: int) -> Response:
    """A step without D gain and deadband, with `inertia` times the horn's own on it."""
    settings = FREE | {"angle_d_gain": 0, "angle_dead_band": 0, "angle_p_gain": p_gain} | rom
    return step(Desk("BLA21-12U-A0", rom=settings).under(load_inertia=inertia), seconds=4.0)


@pytest.mark.states("B78")
@cascaded
def test_a_larger_p_gain_holds_more_firmly(cascade: int) -> None:
    def left(p_gain: int) -> int:
        rom = FREE | {"speed_torque_control": cascade, "speed_i_gain": 0, "angle_p_gain": p_gain}
        return step(Desk(rom=rom).under(load_pct=-40.0), seconds=1.0).left

    assert left(10) > left(40) > left(100)


@pytest.mark.states("B78")
@cascaded
def test_the_force_grows_with_the_deviation_and_with_the_p_gain(cascade: int) -> None:
    def force(p_gain: int, deviation: int) -> int:
        rom = FREE | {"speed_torque_control": cascade, "speed_i_gain": 0, "angle_p_gain": p_gain, "smoothing": 0}
        desk = Desk(rom=rom).under(load_inertia=VISE)
        desk.write("0x00", deviation)
        return max(watch(desk, "0x0A", 0.02))

    assert 0 < force(10, 10) < force(10, 20) < force(10, 40)
    assert force(10, 10) < force(40, 10)


@pytest.mark.states("B78")
@pytest.mark.parametrize("model", MODELS)
def test_no_model_hunts_with_its_default_gains(model: str) -> None:
    assert step(Desk(model, rom=FREE).under(load_inertia=3.0)).hunting == 0


@pytest.mark.states("B78")
def test_with_too_large_a_p_gain_and_enough_load_it_hunts_by_about_1_degree() -> None:
    calm, uneasy, nervous = (heavy(p_gain) for p_gain in (40, 80, 100))
    assert calm.hunting == 0
    assert calm.hunting < uneasy.hunting < nervous.hunting
    assert 10 <= nervous.hunting <= 40
    assert nervous.swings > 5
    assert heavy(100, inertia=0.0).hunting <= 2


# The derivative gain.


def lively(d_gain: int, inertia: float = 0.0, model: str = "BLA21-06U-A0", **rom: int) -> Response:
    """A step with much P gain."""
    settings = FREE | {"smoothing": 0, "angle_p_gain": 80, "angle_d_gain": d_gain} | rom
    return step(Desk(model, rom=settings).under(load_inertia=inertia), seconds=4.0)


@pytest.mark.states("B79")
@pytest.mark.parametrize("inertia", [0.0, 0.5, 1.0, 3.0])
def test_a_small_d_gain_overshoots_and_the_larger_it_is_the_less(inertia: float) -> None:
    if inertia <= 1.0:
        assert lively(0, inertia, angle_p_gain=40).overshoot > 20
        assert lively(100, inertia, angle_p_gain=40).overshoot < 0
    small, medium, large = (lively(d_gain, inertia).overshoot for d_gain in (0, 40, 100))
    assert small > medium > large


@pytest.mark.states("B79")
@pytest.mark.parametrize("model", MODELS)
def test_a_larger_d_gain_overshoots_less_on_every_model(model: str) -> None:
    assert lively(100, 1.0, model).overshoot < lively(0, 1.0, model).overshoot


@pytest.mark.states("B79")
def test_the_d_gain_slows_the_horn_before_the_target() -> None:
    def speed_near_the_target(d_gain: int) -> int:
        desk = Desk(rom=FREE | {"smoothing": 0, "angle_p_gain": 80, "angle_d_gain": d_gain})
        desk.write("0x00", 900)
        while desk.value("0x08") < 860:
            desk.wait(0.001)
        return desk.value("0x09")

    assert speed_near_the_target(100) < speed_near_the_target(0)


@pytest.mark.states("B78", "B79", "B80")
@pytest.mark.parametrize(
    "cure", [{"angle_d_gain": 60}, *({"angle_dead_band": raw} for raw in (10, 20, 30, 50))], ids=str
)
def test_more_d_gain_or_a_wider_deadband_ends_hunting(cure: dict[str, int]) -> None:
    assert heavy(100).hunting >= 10
    assert heavy(100, **cure).hunting <= (1 if "angle_d_gain" in cure else 0)


@pytest.mark.states("B79")
def test_the_d_gain_has_no_effect_without_0x25() -> None:
    assert lively(0, speed_torque_control=0).readings == lively(100, speed_torque_control=0).readings


# The deadband.


@pytest.mark.states("B80")
@cascaded
def test_within_the_deadband_nothing_moves(cascade: int) -> None:
    desk = Desk(rom=QUIET | {"angle_dead_band": 50, "speed_torque_control": cascade})
    follow(desk, ("0x00", 49, 1.0), {"0x08": 0}, go(60), {"0x08": between(10, 60)})


@pytest.mark.states("B80")
@pytest.mark.parametrize(("dead_band", "corrected"), [(3, (6, 15, 40)), (10, (15, 40)), (30, (40,))])
def test_a_smaller_deadband_corrects_smaller_deviations(dead_band: int, corrected: tuple[int, ...]) -> None:
    for deviation in (6, 15, 40):
        desk = Desk(rom=FREE | {"angle_dead_band": dead_band})
        assert (step(desk, deviation, 1.0).readings[-1] > 0) is (deviation in corrected)


@pytest.mark.states("B80")
@pytest.mark.parametrize(("dead_band", "rests"), [(0, False), (3, True)])
def test_the_default_deadband_just_covers_the_play_of_the_gear(dead_band: int, rests: bool) -> None:
    # With much gain and no deadband, the horn rattles within its play.
    desk = Desk(rom=FREE | {"angle_dead_band": dead_band, "angle_p_gain": 100, "angle_boost": 100})
    step(desk)
    assert desk.servo.asleep is rests


@pytest.mark.states("B80")
@cascaded
@pytest.mark.parametrize("dead_band", [3, 20, 50])
def test_a_horn_rests_within_the_deadband(dead_band: int, cascade: int) -> None:
    desk = Desk(rom=QUIET | {"angle_dead_band": dead_band, "speed_torque_control": cascade})
    assert step(desk).left <= dead_band
    desk.settle()


# Boost.

WEAK = QUIET | {"angle_dead_band": 0, "angle_p_gain": 5}


@pytest.mark.states("B81", "B101")
@pytest.mark.parametrize(
    ("firmware", "boost", "moves"), [("1.300", 0, False), ("1.300", 50, True), ("1.100", 0, False)]
)
def test_boost_corrects_a_small_deviation(firmware: str, boost: int, moves: bool) -> None:
    desk = Desk(firmware=firmware, rom=WEAK | ({"angle_boost": boost} if firmware == "1.300" else {}))
    assert desk.read("0x2F") == boost
    assert (step(desk, target=8, seconds=1.0).readings[-1] > 0) is moves


@pytest.mark.states("B81")
@cascaded
def test_more_boost_corrects_smaller_deviations(cascade: int) -> None:
    def smallest(boost: int) -> int:
        for target in range(1, 40):
            desk = Desk(rom=WEAK | {"speed_torque_control": cascade, "speed_i_gain": 0, "angle_boost": boost})
            if step(desk, target, 0.5).readings[-1]:
                return target
        raise AssertionError("no deviation is corrected")

    assert smallest(0) > smallest(15) > smallest(40)


@pytest.mark.states("B81")
@cascaded
@pytest.mark.parametrize("target", [20, -20])
def test_boost_adds_its_tenths_of_a_percent_to_the_output(target: int, cascade: int) -> None:
    def output(boost: int) -> int:
        rom = WEAK | {"speed_torque_control": cascade, "speed_i_gain": 0, "smoothing": 0, "angle_boost": boost}
        desk = Desk(rom=rom | {"angle_p_gain": 1}).under(load_inertia=VISE)
        desk.write("0x00", target)
        return abs(watch(desk, "0x0A", 0.05)[-1])

    assert output(100) - output(0) == pytest.approx(10, abs=1)


@pytest.mark.states("B81")
def test_within_the_deadband_boost_has_no_effect() -> None:
    desk = Desk(rom=WEAK | {"angle_boost": 100, "angle_dead_band": 30})
    assert set(step(desk, target=25, seconds=0.5).readings) == {0}
