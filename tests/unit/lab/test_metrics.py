"""Metrics of a step response, against second-order systems with closed-form solutions."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from hornbill.domain.step_test import StepMetrics
from hornbill.lab.metrics import of_step

SAMPLE_S = 0.002


def second_order(
    zeta: float, omega: float, *, dead_s: float = 0.0, seconds: float = 4.0
) -> tuple[list[float], list[float]]:
    """The unit step response of a damped oscillator, sampled."""
    t = np.arange(0, seconds, SAMPLE_S)
    late = np.maximum(t - dead_s, 0.0)
    wd = omega * math.sqrt(1 - zeta**2)
    y = 1 - np.exp(-zeta * omega * late) * (np.cos(wd * late) + zeta / math.sqrt(1 - zeta**2) * np.sin(wd * late))
    return t.tolist(), y.tolist()


def measured(zeta: float, omega: float, *, size: float = 10.0, start: float = 0.0, dead_s: float = 0.0) -> StepMetrics:
    t, y = second_order(zeta, omega, dead_s=dead_s)
    return of_step(t, [start + size * one for one in y], start, start + size, band_deg=abs(size) * 0.02)


@given(zeta=some.floats(0.2, 0.9), omega=some.floats(10, 60), size=some.floats(1, 45), back=some.booleans())
def test_overshoot_follows_the_damping(zeta: float, omega: float, size: float, back: bool) -> None:
    found = measured(zeta, omega, size=-size if back else size, start=7.0)
    expected = math.exp(-math.pi * zeta / math.sqrt(1 - zeta**2)) * 100
    assert found.overshoot_pct == pytest.approx(expected, abs=0.5)


def test_rise_delay_and_first_crossing_are_within_one_sample() -> None:
    zeta, omega = 0.5, 20.0
    found = measured(zeta, omega, dead_s=0.05)
    wd = omega * math.sqrt(1 - zeta**2)
    assert found.crossing_s == pytest.approx(0.05 + (math.pi - math.acos(zeta)) / wd, abs=SAMPLE_S)
    fine = np.linspace(0, 1, 200_001)
    y = 1 - np.exp(-zeta * omega * fine) * (np.cos(wd * fine) + zeta / math.sqrt(1 - zeta**2) * np.sin(wd * fine))
    first = [float(fine[np.argmax(y >= level)]) for level in (0.05, 0.1, 0.9)]
    assert found.delay_s == pytest.approx(0.05 + first[0], abs=SAMPLE_S)
    assert found.rise_s == pytest.approx(first[2] - first[1], abs=SAMPLE_S)


def test_settling_is_the_last_entry_into_the_band() -> None:
    t = [i * 0.01 for i in range(200)]
    y = [10.0 if time >= 0.5 else 10.4 if 0.3 <= time < 0.31 else 0.0 if time < 0.2 else 12.0 for time in t]
    found = of_step(t, y, 0.0, 10.0, band_deg=0.5)
    assert found.settling_s == pytest.approx(0.5)
    assert found.steady_state_error_deg == pytest.approx(0.0)


def test_a_horn_that_never_arrives_has_no_rise_settling_or_overshoot() -> None:
    t = [i * 0.01 for i in range(100)]
    found = of_step(t, [min(5.0, one * 10) for one in t], 0.0, 10.0, band_deg=0.5)
    assert (found.rise_s, found.settling_s, found.overshoot_pct, found.crossing_s) == (None, None, None, None)
    assert found.peak_deg == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("swing_deg", "hertz", "word"),
    [(0.0, 5.0, "none"), (0.2, 5.0, "slight"), (0.45, 5.0, "hunting"), (0.45, 0.2, "none")],
)
def test_hunting_is_an_oscillation_after_settling(swing_deg: float, hertz: float, word: str) -> None:
    t = [i * 0.005 for i in range(600)]
    y = [10.0 + swing_deg * math.sin(2 * math.pi * hertz * one) for one in t]
    found = of_step(t, y, 0.0, 10.0, band_deg=0.5)
    assert found.hunting == word
    if word != "none":
        assert found.hunting_hz == pytest.approx(hertz, rel=0.15)
        assert found.hunting_rms_deg == pytest.approx(swing_deg / math.sqrt(2), rel=0.05)


def limit_cycle(hertz: float, peak_deg: float, sample_s: float, seconds: float, off_deg: float) -> StepMetrics:
    """A step of 5° that overshoots and ends in a swing that never stops."""
    t = [i * sample_s for i in range(int(seconds / sample_s))]
    rise = [5.0 * (1 - math.exp(-one / 0.03)) + 3.0 * math.exp(-one / 0.08) * math.sin(40 * one) for one in t]
    y = [at + off_deg + peak_deg * math.sin(2 * math.pi * hertz * one) for at, one in zip(rise, t, strict=True)]
    return of_step(t, [round(one, 1) for one in y], 0.0, 5.0, band_deg=0.5)


@pytest.mark.parametrize("hertz", [4.0, 9.0, 16.0, 30.0])
@pytest.mark.parametrize(("peak_deg", "off_deg"), [(0.8, 0.0), (1.0, 0.0), (1.0, -1.5), (4.0, 0.0)])
def test_a_horn_that_oscillates_without_settling_hunts(hertz: float, peak_deg: float, off_deg: float) -> None:
    found = limit_cycle(hertz, peak_deg, 0.002, 1.0, off_deg)
    assert found.settling_s is None
    assert found.hunting == "hunting"
    assert found.hunting_hz == pytest.approx(hertz, rel=0.05)
    assert found.hunting_rms_deg == pytest.approx(peak_deg / math.sqrt(2), rel=0.1)


@pytest.mark.parametrize("sample_s", [0.02, 0.035, 0.05])
def test_an_undersampled_oscillation_hunts_at_an_unknown_frequency(sample_s: float) -> None:
    found = limit_cycle(16.0, 1.0, sample_s, 1.5, 0.0)
    assert found.hunting == "hunting"
    assert found.hunting_hz is None
    assert found.hunting_rms_deg == pytest.approx(0.7, abs=0.15)


UNSETTLED: dict[str, Callable[[float], float]] = {
    "short of it": lambda _t: 3.0,
    "creeps": lambda t: 5.0 * t,
    "rings and calms down": lambda t: 5.0 + 6.0 * math.exp(-t / 0.45) * math.cos(40 * t),
    "pushed at the end": lambda t: 5.0 if t < 0.9 else 7.0,
    "trembles by a digit": lambda t: 4.0 + 0.1 * (int(t * 50) % 2),
}


@pytest.mark.parametrize("angle", UNSETTLED.values(), ids=UNSETTLED)
def test_an_unsettled_response_without_oscillation_does_not_hunt(angle: Callable[[float], float]) -> None:
    t = [i * 0.002 for i in range(500)]
    found = of_step(t, [angle(one) for one in t], 0.0, 5.0, band_deg=0.5)
    assert (found.settling_s, found.hunting, found.hunting_hz) == (None, "none", None)


def test_a_steady_state_error_has_a_sign_and_too_short_a_dwell_is_not_settled() -> None:
    t = [i * 0.01 for i in range(100)]
    found = of_step(t, [-10.3] * 100, 0.0, -10.0, band_deg=0.5)
    assert found.steady_state_error_deg == pytest.approx(-0.3)
    assert of_step(t, [0.0 if one < 0.85 else 10.0 for one in t], 0.0, 10.0, band_deg=0.5).settling_s is None


@pytest.mark.parametrize(
    ("t", "y", "to"),
    [([0.0], [0.0], 1.0), ([0.0, 0.1], [0.0, 0.0], 0.0), ([0.0, 0.0], [0.0, 1.0], 1.0), ([0.0], [], 1.0)],
)
def test_an_invalid_step_response_is_refused(t: list[float], y: list[float], to: float) -> None:
    with pytest.raises(ValueError, match="step response"):
        of_step(t, y, 0.0, to, band_deg=0.5)
