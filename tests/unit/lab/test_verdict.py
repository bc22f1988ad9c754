"""Verdicts on runs: a table of curves with what a technician would say of each, and any finite curve."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from hornbill.domain.frequency_response import Estimate, FrequencyCurve, FrequencyMetrics
from hornbill.domain.note import Note
from hornbill.domain.step_test import StepTrace
from hornbill.domain.verdict import Verdict
from hornbill.lab import verdict
from hornbill.lab.metrics import of_step
from hornbill.lab.verdict import THRESHOLDS, RunFacts, of_frequency_response, of_steps, threshold
from unit.lab.test_metrics import second_order

BAND_DEG = 0.5
PLAIN = RunFacts(
    {"angle_p_gain": 50, "angle_dead_band": 0.3, "speed_torque_control": False}, nominal_v=7.4, voltage_v=7.4
)
CASCADE = replace(PLAIN, parameters={
    **PLAIN.parameters, "speed_torque_control": True, "speed_limit_cw": 300, "speed_limit_ccw": -300,
    "torque_limit_cw": 100, "torque_limit_ccw": -100,
})  # fmt: skip

T = np.arange(0, 1.0, 0.002)


def trace(angle: np.ndarray, *, to: float = 10.0, t: np.ndarray = T) -> StepTrace:
    """A step from 0 to `to`, with these angles."""
    times, angles = t.tolist(), angle.tolist()
    metrics = of_step(times, angles, 0.0, to, band_deg=BAND_DEG)
    return StepTrace(direction="there", from_deg=0.0, to_deg=to, t=times, angle_deg=angles, metrics=metrics)


def lag(tau: float, final: float = 10.0) -> np.ndarray:
    """A first-order response."""
    return final * (1 - np.exp(-T / tau))


def ring(zeta: float, omega: float) -> np.ndarray:
    """A second-order response to 10°."""
    t, y = second_order(zeta, omega)
    return 10 * np.interp(T, t, y)


def hunt(swing: float, hz: float) -> np.ndarray:
    """A response that ends in a steady oscillation."""
    return lag(0.02) + swing * np.sin(2 * np.pi * hz * T) * (T > 0.1)


CASES: dict[str, tuple[np.ndarray, RunFacts, str, str, str]] = {
    "a quick lag": (lag(0.025), PLAIN, "ok", "settles", "Good: settles in 76 ms, no hunting."),
    "hunting": (hunt(1.0, 16), PLAIN, "warning", "hunts", "Hunts at 16 Hz, ±1.0°: P gain 50 is too high"),
    "hunting with smoothing": (hunt(1.0, 16), replace(PLAIN, smoothing=True), "warning", "hunts", "Hunts at 16 Hz"),
    "boost": (
        hunt(0.45, 20), replace(PLAIN, parameters={**PLAIN.parameters, "angle_boost": 4.0}), "warning", "hunts",
        "Hunts at 20 Hz, ±0.4°, with a boost of 4 %.",
    ),
    "ringing": (ring(0.2, 60), PLAIN, "warning", "rings", "Rings at 9 Hz: swings 5 times"),
    "one overshoot": (ring(0.5, 60), PLAIN, "notice", "overshoots", "Overshoots by 16 % and settles in"),
    "an overshoot within the band": (lag(0.02) + 0.4 * np.exp(-(((T - 0.15) / 0.03) ** 2)), PLAIN, "ok", "settles", ""),
    "slow": (lag(0.15), PLAIN, "notice", "slow", "Slow: settles in 450 ms, no hunting."),
    "still moving": (10 * T / 1.2, PLAIN, "warning", "not_settled", "Does not settle to ±0.5° within 1.0 s."),
    "blocked": (lag(0.02, 0.4), PLAIN, "failure", "did_not_move", "Did not move: 0.4° of 10.0°."),
    "stands before its target": (
        lag(0.02, 8.8), PLAIN, "warning", "off_target", "Stops 1.2° before its target: load or friction.",
    ),
    "within its deadband": (
        lag(0.02, 8.8), replace(PLAIN, parameters={**PLAIN.parameters, "angle_dead_band": 1.1}), "warning",
        "off_target", "Stops 1.2° before its target, within its deadband of 1.1°.",
    ),
    "held by its torque limit": (
        lag(0.02, 8.8), replace(CASCADE, parameters={**CASCADE.parameters, "torque_limit_cw": 20}), "warning",
        "off_target", "Stops 1.2° before its target: load or friction needs more than the torque limit of 20 %",
    ),
    "smoothing": (lag(0.025), replace(PLAIN, smoothing=True), "notice", "smoothing_measured", "Smoothing is on"),
    "limit bit": (
        lag(0.025), replace(PLAIN, limits=("torque_limit_ccw",)), "notice", "limit_reached",
        "A limit was reached (torque limit CCW)",
    ),
    "at its speed limit": (
        np.minimum(T * 60, 10), replace(CASCADE, parameters={**CASCADE.parameters, "speed_limit_cw": 10}), "notice",
        "limit_reached", "A limit was reached (speed limit CW)",
    ),
    "low supply": (
        lag(0.025), replace(PLAIN, voltage_v=6.0), "notice", "supply_limited", "Limited by the supply: 6.0 V is 81 %",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_curve_gets_the_verdict_of_a_technician(case: str) -> None:
    angle, facts, level, code, text = CASES[case]
    for sign in (1, -1):  # the same in the other direction, limits aside
        if sign < 0 and "speed limit" in text:
            continue
        found = of_steps([trace(sign * angle, to=sign * 10.0)], BAND_DEG, facts)
        assert (found.level, found.code) == (level, code)
        assert found.text.startswith(text)
        assert (found.advice is None) == (level == "ok"), "a peculiarity comes with what to try"


def test_a_run_has_the_verdict_of_its_worst_step() -> None:
    steps = [trace(lag(0.025)), trace(hunt(1.0, 16)), trace(lag(0.15))]
    assert of_steps(steps, BAND_DEG, PLAIN).code == "hunts"


@pytest.mark.parametrize(
    ("angle", "facts", "advised"),
    [
        (hunt(1.0, 16), PLAIN, 40),
        (hunt(1.0, 16), replace(PLAIN, parameters={"angle_p_gain": 55}), 44),
        (ring(0.35, 60), PLAIN, 25),  # (0.35 / 0.6)² of it is below half
        (ring(0.5, 60), PLAIN, 34),  # (0.5 / 0.6)² × 50
        (lag(0.15), PLAIN, 62),
    ],
)
def test_the_advised_p_gain_follows_from_the_curve(angle: np.ndarray, facts: RunFacts, advised: int) -> None:
    advice = of_steps([trace(angle)], BAND_DEG, facts).advice
    assert advice is not None
    assert advice.params["p_gain"] == pytest.approx(advised, abs=1)
    assert f"P gain {advice.params['p_gain']}" in advice.text


def test_the_d_gain_is_advised_only_where_it_acts() -> None:
    for facts, named in ((PLAIN, False), (CASCADE, True)):
        advice = of_steps([trace(ring(0.2, 60))], BAND_DEG, facts).advice
        assert advice is not None
        assert ("D gain" in advice.text) is named
    for d_gain in (0, 40):
        facts = replace(CASCADE, parameters={**CASCADE.parameters, "angle_d_gain": d_gain})
        advice = of_steps([trace(hunt(1.0, 16))], BAND_DEG, facts).advice
        assert advice is not None
        assert ("D gain" in advice.text) is (d_gain == 0), "a horn that hunts without any damping"


def test_an_unknown_p_gain_is_not_named() -> None:
    found = of_steps([trace(hunt(1.0, 16))], BAND_DEG, RunFacts({}))
    assert found.text == "Hunts at 16 Hz, ±1.0°: P gain is too high for this load."
    assert found.advice is not None
    assert "p_gain" not in found.advice.params


@given(
    angles=some.lists(some.floats(-3600, 3600), min_size=2, max_size=60),
    to=some.floats(0.1, 45) | some.floats(-45, -0.1),
    parameters=some.dictionaries(
        some.sampled_from(
            ["angle_p_gain", "angle_dead_band", "angle_boost", "speed_torque_control", "torque_limit_cw"]
        ),
        some.none() | some.booleans() | some.integers(-5000, 5000) | some.floats(-5000, 5000) | some.text(max_size=3),
    ),
    voltage=some.none() | some.floats(0, 60),
)
def test_any_finite_curve_has_a_verdict_of_finite_figures(
    angles: list[float], to: float, parameters: dict[str, Any], voltage: float | None
) -> None:
    t = np.arange(len(angles)) * 0.01
    facts = RunFacts(parameters, voltage_v=voltage, nominal_v=7.4)
    found = of_steps([trace(np.array(angles), to=to, t=t)], BAND_DEG, facts)
    assert found.text
    for value in (*found.params.values(), *(found.advice.params.values() if found.advice else ())):
        assert not isinstance(value, float) or math.isfinite(value)


# frequency responses


def estimate(value: float) -> Estimate:
    return Estimate(value, value, value)


def curve(*, reliable: bool = True, missed: int = 0, **metrics: Any) -> FrequencyCurve:
    """A curve with these metrics."""
    fields = dict.fromkeys(FrequencyMetrics.model_fields) | metrics
    return FrequencyCurve(
        amplitude_deg=2.0, peak_deg=2.0, frequency_hz=[1.0, 10.0], gain_db=[0.0, -5.0], gain_error_db=[0.1, 0.1],
        phase_deg=[-5.0, -100.0], phase_error_deg=[1.0, 1.0], coherence=[1.0, 0.95], reliable=[reliable, reliable],
        samples=100, achieved_hz=400, slots=100, missed_slots=missed, metrics=FrequencyMetrics(**fields),
    )  # fmt: skip


GOOD: dict[str, Any] = {"bandwidth_3db_hz": estimate(6.2), "phase_margin_deg": estimate(71)}

RESPONSES: dict[str, tuple[Callable[[], Verdict], str, str, str]] = {
    "follows": (
        lambda: of_frequency_response([curve(**GOOD)], None, PLAIN), "ok", "follows",
        "Follows to 6.2 Hz (−3 dB), phase margin 71°.",
    ),
    "follows beyond its range": (
        lambda: of_frequency_response([curve()], None, PLAIN), "ok", "follows", "Follows from 1.0 to 10.0 Hz",
    ),
    "resonant": (
        lambda: of_frequency_response(
            [curve(peak_db=estimate(15), peak_hz=16.0, phase_margin_deg=estimate(9), gain_margin_db=estimate(4))],
            None, PLAIN,
        ),
        "warning", "resonant", "Resonant: +15 dB at 16 Hz, phase margin 9°. P gain 50 is high for this load.",
    ),
    "little phase margin": (
        lambda: of_frequency_response([curve(phase_margin_deg=estimate(30))], None, PLAIN), "warning", "low_margin",
        "Close to hunting, phase margin 30°.",
    ),
    "little gain margin": (
        lambda: of_frequency_response([curve(gain_margin_db=estimate(3))], None, PLAIN), "warning", "low_margin",
        "Close to hunting, gain margin 3 dB.",
    ),
    "depends on the amplitude": (
        lambda: of_frequency_response([curve(**GOOD)] * 3, Note("Deadband.", "deadband_dependence"), PLAIN), "notice",
        "amplitude_dependent", "Follows to 6.2 Hz (−3 dB), phase margin 71°. Deadband.",
    ),
    "smoothing": (
        lambda: of_frequency_response([curve(**GOOD)], None, replace(PLAIN, smoothing=True)), "notice",
        "smoothing_measured", "Smoothing is on",
    ),
    "nothing reliable": (
        lambda: of_frequency_response([curve(reliable=False)], None, PLAIN), "failure", "not_reliable", "Not reliable",
    ),
    "nothing measured": (lambda: of_frequency_response([], None, PLAIN), "failure", "not_reliable", "Not reliable"),
}  # fmt: skip


@pytest.mark.parametrize("case", RESPONSES)
def test_a_frequency_response_has_a_verdict(case: str) -> None:
    judge, level, code, text = RESPONSES[case]
    found = judge()
    assert (found.level, found.code) == (level, code)
    assert found.text.startswith(text)


def test_the_advised_p_gain_leaves_the_wanted_gain_margin() -> None:
    found = of_frequency_response([curve(gain_margin_db=estimate(3.0))], None, PLAIN)
    assert found.advice is not None
    assert found.advice.params["p_gain"] == int(50 * 10 ** ((3.0 - threshold("gain_margin")) / 20))


def test_missed_commands_are_blamed_on_the_bus_and_others_on_the_amplitude() -> None:
    for missed, code in ((6, "try_check_bus"), (5, "try_larger_amplitude")):
        found = of_frequency_response([curve(reliable=False, missed=missed)], None, PLAIN)
        assert found.advice is not None
        assert found.advice.code == code


def test_every_threshold_decides_something() -> None:
    source = Path(verdict.__file__).read_text(encoding="utf-8")
    for name in THRESHOLDS:
        assert f'threshold("{name}")' in source, name


def test_the_documentation_lists_every_threshold() -> None:
    page = (Path(__file__).parents[3] / "docs/explanation/tuning.md").read_text(encoding="utf-8")
    listed = page.split("### Thresholds")[1].split("## ")[0]
    for name, one in THRESHOLDS.items():
        gap = "" if one.unit == "°" else " "
        assert f"| {name} | {one.value:g}{gap}{one.unit} | {one.decides} |" in listed
    assert listed.count("\n| ") == len(THRESHOLDS) + 2
