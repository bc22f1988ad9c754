"""Frequency responses of linear systems with closed-form solutions, and of static non-linearities."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy import optimize, signal  # pyright: ignore[reportMissingTypeStubs]

from hornbill.domain.frequency_response import Estimate
from hornbill.lab import frequency
from hornbill.lab.excitation import REST_S, SLOT_S, STEP_DEG, ExcitationPlan, offsets
from hornbill.lab.frequency import Curve

PLAN = ExcitationPlan("chirp", 2.0, 0.5, 20.0, 20.0)
FINE_S = 0.001
DELAY_S = 0.008

scipy: Any = (signal, optimize)
Numerator = tuple[float, ...]


def second_order(hz: float, zeta: float) -> tuple[Numerator, Numerator]:
    """Closed loop of a lag with an integrator: unity at rest."""
    omega = 2 * math.pi * hz
    return (omega**2,), (1.0, 2 * zeta * omega, omega**2)


def exact(system: tuple[Numerator, Numerator], hz: np.ndarray, delay_s: float = 0.0) -> np.ndarray:
    s = 2j * np.pi * hz
    return np.polyval(system[0], s) / np.polyval(system[1], s) * np.exp(-s * delay_s)


def respond(
    system: tuple[Numerator, Numerator],
    plan: ExcitationPlan = PLAN,
    *,
    delay_s: float = 0.0,
    noise: float = 0.0,
    step_deg: float = 0.1,
    every_s: float = 0.003,
    seed: int = 1,
    bend: Callable[[np.ndarray], np.ndarray] = lambda angle: angle,
) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Commands and irregular, quantised samples of a system that is integrated exactly under the held commands.

    `bend` changes the commands before the system, and `step_deg` is the resolution of a sample.
    """
    chance = np.random.default_rng(seed)
    slots = offsets(plan)
    command = np.repeat(slots, round(SLOT_S / FINE_S))
    matrices = scipy[0].cont2discrete(scipy[0].tf2ss(*system), FINE_S, method="zoh")
    found: Any = scipy[0].dlsim(matrices, bend(command))
    fine = np.arange(len(command)) * FINE_S
    gaps = every_s * chance.uniform(0.7, 1.3, int(fine[-1] / every_s))
    at = np.cumsum(gaps)
    at = at[at < fine[-1]]
    exact_deg: list[float] = list(np.interp(at - delay_s, fine, np.asarray(found[1], dtype=float)[:, 0]))
    noisy = (deg + noise * float(chance.standard_normal()) for deg in exact_deg)
    seen = [round(deg / step_deg) * step_deg if step_deg else deg for deg in noisy]
    commands = [(number * SLOT_S, offset) for number, offset in enumerate(slots)]
    return commands, list(zip(at.tolist(), seen, strict=True))


def measured(system: tuple[Numerator, Numerator], plan: ExcitationPlan = PLAN, **more: Any) -> Curve:
    commands, samples = respond(system, plan, **more)
    chirp_deg = plan.amplitude_deg if plan.kind == "chirp" else None
    return frequency.estimate(commands, samples, plan.from_hz, plan.to_hz, chirp_deg=chirp_deg)


plans = some.builds(
    ExcitationPlan,
    some.sampled_from(["chirp", "multisine"]),
    some.floats(0.2, 20),
    some.floats(0.5, 5),
    some.floats(10, 25),
    some.floats(10, 20),
)


@settings(max_examples=40)
@given(plans)
def test_an_excitation_stays_within_its_amplitude_and_begins_and_ends_softly(plan: ExcitationPlan) -> None:
    found = np.array(offsets(plan))
    assert len(found) * SLOT_S == pytest.approx(plan.duration_s + 2 * REST_S, abs=2.1 * SLOT_S)
    assert np.abs(found).max() <= plan.amplitude_deg + 1e-9
    assert np.abs(found).max() >= plan.amplitude_deg * 0.8 - STEP_DEG, "it uses its amplitude"
    assert np.allclose(found / STEP_DEG, np.round(found / STEP_DEG)), "the command has a resolution of 0.1°"
    rest = round(REST_S / SLOT_S)
    assert not found[:rest].any()
    assert not found[-rest:].any()
    fastest = 2 * math.pi * plan.to_hz * 1.25 * SLOT_S * plan.amplitude_deg
    assert np.abs(np.diff(found)).max() <= max(fastest, 2 * STEP_DEG) + STEP_DEG, "no jump"


@pytest.mark.parametrize("kind", ["chirp", "multisine"])
def test_the_power_of_an_excitation_is_the_same_in_each_octave_of_the_range(kind: Any) -> None:
    found = np.fft.rfft(offsets(ExcitationPlan(kind, 5.0, 0.5, 16.0, 30.0)))
    hz = np.fft.rfftfreq(len(offsets(ExcitationPlan(kind, 5.0, 0.5, 16.0, 30.0))), SLOT_S)
    power = [(np.abs(found[(hz >= low) & (hz < 2 * low)]) ** 2).sum() for low in (0.5, 1, 2, 4, 8)]
    assert max(power) < 2.5 * min(power)
    assert (np.abs(found[(hz < 0.3) | (hz > 25)]) ** 2).sum() < 0.05 * sum(power)


@pytest.mark.parametrize("kind", ["chirp", "multisine"])
@pytest.mark.parametrize(("hz", "zeta"), [(3.0, 0.7), (8.0, 0.2), (15.0, 1.0)])
def test_gain_and_phase_are_those_of_a_linear_system(kind: Any, hz: float, zeta: float) -> None:
    plan = ExcitationPlan(kind, 4.0, 0.5, 20.0, 20.0)
    system = second_order(hz, zeta)
    found = measured(system, plan, delay_s=DELAY_S)
    true = exact(system, found.hz, DELAY_S)
    good = found.reliable
    assert good.sum() > len(good) / 2
    gain = found.gain_db - 20 * np.log10(np.abs(true))
    phase = (found.phase_deg - np.degrees(np.angle(true)) + 180) % 360 - 180
    assert np.abs(gain[good]).max() < 0.5
    assert np.abs(phase[good]).max() < 5.0
    resonance = np.abs(true) > 0.5
    assert np.abs(gain[good & resonance]).max() < 0.2


@pytest.mark.release
def test_a_stated_interval_contains_the_truth_as_often_as_it_says() -> None:
    """With quantisation and noise, 12 measurements of 44 frequencies and their metrics."""
    system = second_order(6.0, 0.5)
    within: list[bool] = []
    metrics: list[bool] = []
    for seed in range(12):
        found = measured(system, noise=0.2, seed=seed, delay_s=DELAY_S)
        true = exact(system, found.hz, DELAY_S)
        good = found.reliable
        within += (np.abs(found.response - true)[good] <= found.radius[good]).tolist()
        fine = np.linspace(0.5, 20, 20_000)
        gain = 20 * np.log10(np.abs(exact(system, fine)))
        bandwidth = frequency.crossing(fine, gain, -3.0)
        estimate = frequency.metrics(found, loop=True).bandwidth_3db_hz
        assert estimate is not None
        metrics.append(estimate.low <= bandwidth <= estimate.high)
    assert np.mean(within) > 0.93
    assert np.mean(metrics) >= 0.9


@pytest.mark.parametrize(("gain", "lag_s", "delay_s"), [(20.0, 0.03, 0.008), (40.0, 0.02, 0.006), (10.0, 0.05, 0.02)])
def test_margins_are_those_of_the_open_loop(gain: float, lag_s: float, delay_s: float) -> None:
    """An integrator with a lag and a dead time; its crossings are found by a solver."""

    def opened(hz: float) -> complex:
        s = 2j * math.pi * hz
        return gain / (s * (1 + lag_s * s)) * np.exp(-s * delay_s)

    def lag(hz: float) -> float:
        return -90 - math.degrees(math.atan(2 * math.pi * hz * lag_s)) - 360 * hz * delay_s

    def beyond_unity(hz: float) -> float:
        return abs(opened(hz)) - 1

    def until_turned(hz: float) -> float:
        return lag(hz) + 180

    unity, turned = (scipy[1].brentq(one, 0.01, 50) for one in (beyond_unity, until_turned))
    hz = np.geomspace(0.5, 24, 60)
    response = np.array([opened(one) / (1 + opened(one)) for one in hz])
    curve = Curve(hz, response, np.full(60, 1e-4), np.ones(60), np.ones(60, dtype=bool))
    found = frequency.metrics(curve, loop=True)
    assert found.phase_margin_deg is not None
    assert found.gain_margin_db is not None
    assert found.phase_margin_hz == pytest.approx(unity, rel=0.01)
    assert found.phase_margin_deg.value == pytest.approx(180 + lag(unity), abs=0.5)
    assert found.gain_margin_hz == pytest.approx(turned, rel=0.01)
    assert found.gain_margin_db.value == pytest.approx(-20 * math.log10(abs(opened(turned))), abs=0.1)
    assert found.phase_margin_deg.low <= found.phase_margin_deg.value <= found.phase_margin_deg.high
    without = frequency.metrics(curve, loop=False)
    assert (without.phase_margin_deg, without.gain_margin_db) == (None, None), "smoothing is outside of the loop"
    assert without.bandwidth_3db_hz == found.bandwidth_3db_hz


def test_the_delay_is_that_between_command_and_angle() -> None:
    found = frequency.metrics(measured(second_order(15.0, 0.8), delay_s=0.02), loop=True)
    assert found.delay_s is not None
    assert found.delay_s.value == pytest.approx(0.02 + 2 * 0.8 / (2 * math.pi * 15), abs=0.001)


def test_motion_that_the_command_does_not_explain_is_not_reliable() -> None:
    commands, _ = respond(second_order(8.0, 0.7))
    chance = np.random.default_rng(3)
    t = np.arange(0, 21, 0.003)
    for samples in (chance.standard_normal(len(t)), np.zeros(len(t)), np.sin(2 * np.pi * 7.3 * t)):
        found = frequency.estimate(commands, list(zip(t, samples, strict=True)), 0.5, 20.0)
        assert not found.reliable.any()
        assert all(value is None for value in dict(frequency.metrics(found, loop=True)).values())


def test_a_swing_near_the_resolution_of_the_angle_is_not_reliable() -> None:
    """Rounding of a swing of one step is the same at each turn, so that coherence does not show it."""
    system = second_order(3.0, 0.7)
    found = measured(system, ExcitationPlan("chirp", 4.0, 0.5, 20.0, 20.0))
    swing = 4.0 * np.abs(exact(system, found.hz))
    assert not found.reliable[swing < 0.18].any()
    assert found.reliable[swing > 0.3].all()
    assert (found.coherence[swing < 0.18] > 0.9).any()


def test_gaps_between_samples_are_corrected_or_make_high_frequencies_unreliable() -> None:
    system = second_order(15.0, 0.7)
    sparse = measured(system, every_s=0.02, step_deg=0.0)
    highest = sparse.hz[sparse.reliable][-1]
    assert 7 < highest < 12, "a tenth of the gain is lost between samples 20 ms apart from about 9 Hz on"
    true = exact(system, sparse.hz)
    assert np.abs(sparse.gain_db - 20 * np.log10(np.abs(true)))[sparse.reliable].max() < 0.3


def test_an_unknown_metric_has_no_interval() -> None:
    flat = frequency.metrics(measured(second_order(80.0, 0.7)), loop=True)
    assert flat.bandwidth_3db_hz is None
    assert isinstance(flat.delay_s, Estimate)


def test_the_dependence_on_the_amplitude_is_named() -> None:
    system = second_order(8.0, 0.8)
    amplitudes = (1.0, 2.0, 4.0)

    def ladder(bend: Callable[[np.ndarray], np.ndarray]) -> list[Curve]:
        return [
            measured(system, ExcitationPlan("chirp", one, 0.5, 15.0, 20.0), bend=bend, step_deg=0.0)
            for one in amplitudes
        ]

    def deadband(command: np.ndarray) -> np.ndarray:
        return np.sign(command) * np.maximum(np.abs(command) - 0.5, 0.0)

    def saturation(command: np.ndarray) -> np.ndarray:
        return np.clip(command, -2.0, 2.0)

    assert frequency.dependence(ladder(lambda command: command), amplitudes) is None
    for bend, code, amplitude in ((deadband, "deadband_dependence", 1.0), (saturation, "saturation_dependence", 4.0)):
        found = frequency.dependence(ladder(bend), amplitudes)
        assert found is not None
        assert found.code == code
        assert found.params["amplitude_deg"] == amplitude
        assert found.params["drop_db"] > frequency.DEPENDS_DB  # pyright: ignore[reportOperatorIssue]


def test_a_response_needs_two_commands_and_two_samples() -> None:
    two = [(0.0, 0.0), (1.0, 0.0)]
    for commands, samples in (([], two), (two, []), (two[:1], two), (two, two[:1])):
        with pytest.raises(ValueError, match="at least two"):
            frequency.estimate(commands, samples, 0.5, 20.0)


@settings(max_examples=30)
@given(
    commands=some.lists(some.tuples(some.floats(0.001, 0.1), some.floats(-20, 20)), min_size=2, max_size=40),
    samples=some.lists(some.tuples(some.floats(0.001, 0.1), some.floats(-3600, 3600)), min_size=2, max_size=40),
)
def test_any_finite_record_has_a_response(
    commands: list[tuple[float, float]], samples: list[tuple[float, float]]
) -> None:
    def in_order(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
        return list(zip(np.cumsum([gap for gap, _ in points]).tolist(), [value for _, value in points], strict=True))

    found = frequency.estimate(in_order(commands), in_order(samples), 0.5, 20.0)
    assert np.isfinite(found.response).all()
    frequency.metrics(found, loop=True)
