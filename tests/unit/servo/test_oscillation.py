"""Oscillation of a horn at rest: found at any frequency that Status can show, and nothing else is taken for one."""

import math
import struct
from collections.abc import Callable
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from hornbill.servo.monitoring.oscillation import QUIET_S, Oscillation

Where = Callable[[float], float]
STATUS_HZ = 10.0


def read(degrees: float) -> float:
    """As in Status: tenths of a degree in hundreds of degrees as a float16."""
    return struct.unpack("<e", struct.pack("<e", round(degrees * 10) / 1000))[0] * 100


def watch(
    found: Oscillation, where: Where, seconds: float, *, hz: float = STATUS_HZ, start: float = 0.0, loss: float = 0.0
) -> float | None:
    """The time at which it is first proved; None if never."""
    random, first = Random(1), None
    for tick in range(int(seconds * hz)):
        at = start + tick / hz
        if random.random() < loss:
            continue
        found.add(at, read(where(at)))
        if first is None and found.proved(at):
            first = at
    return first


def swing(hz: float, peak_deg: float, *, middle: float = 0.0, phase: float = 0.3) -> Where:
    return lambda at: middle + peak_deg * math.sin(2 * math.pi * hz * at + phase)


def still(degrees: float) -> Where:
    return lambda _at: degrees


@pytest.mark.parametrize("hz", [1.0, 2.5, 4.6, 5.4, 8.7, 16.0, 23.4, 61.3])
@pytest.mark.parametrize("peak_deg", [0.4, 1.0, 6.0])
@pytest.mark.parametrize("loss", [0.0, 0.2])
def test_an_oscillation_is_found_from_status_alone_at_any_frequency(hz: float, peak_deg: float, loss: float) -> None:
    found = Oscillation()
    first = watch(found, swing(hz, peak_deg, middle=-40.0), 5.0, loss=loss)
    assert first is not None
    assert first < (2.5 if hz >= 2 else 4.0)
    assert found.peak_to_peak_deg() == pytest.approx(2 * peak_deg, rel=0.3, abs=0.2)


@settings(max_examples=100)
@given(hz=some.floats(1.2, 80), phase=some.floats(0, 6.28), peak_deg=some.floats(0.5, 10))
def test_an_oscillation_is_found_at_any_phase_unless_it_aliases(hz: float, phase: float, peak_deg: float) -> None:
    off = abs(hz / STATUS_HZ * 2 - round(hz / STATUS_HZ * 2)) * STATUS_HZ / 2
    first = watch(Oscillation(), swing(hz, peak_deg, phase=phase), 12.0)
    assert first is not None or off < 0.9


@pytest.mark.parametrize("hz", [10.0, 20.0, 200.0])
def test_faster_samples_show_it_too(hz: float) -> None:
    found = Oscillation()
    assert watch(found, swing(63.0, 1.0), 3.0, hz=hz) is not None
    assert found.peak_to_peak_deg() == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize("hz", [10.0, 20.0, 200.0])
@pytest.mark.parametrize("degrees", [0.0, 0.05, 179.95, 900.3, 3600.0])
def test_noise_and_rounding_are_no_oscillation(hz: float, degrees: float) -> None:
    random = Random(2)
    assert watch(Oscillation(), lambda _at: degrees + random.uniform(-0.12, 0.12), 120.0, hz=hz) is None


@pytest.mark.parametrize("hz", [10.0, 20.0])
def test_a_noisy_sensor_is_no_oscillation(hz: float) -> None:
    random = Random(3)
    assert watch(Oscillation(), lambda _at: random.gauss(12.0, 0.08), 600.0, hz=hz) is None


def ring(hz: float, decay_s: float, size: float) -> Where:
    return lambda at: size * math.exp(-at / decay_s) * math.cos(2 * math.pi * hz * at)


@pytest.mark.parametrize("hz", [2.0, 5.0, 8.0, 16.0])
@pytest.mark.parametrize(("decay_s", "size"), [(0.1, 30.0), (0.3, 10.0), (0.5, 5.0)])
def test_decaying_ringing_is_no_oscillation(hz: float, decay_s: float, size: float) -> None:
    assert watch(Oscillation(), ring(hz, decay_s, size), 10.0) is None


MOVES: dict[str, Where] = {
    "fast ramp": lambda at: 30.0 * at,
    "slow ramp": lambda at: 0.5 * at,
    "slow sweep": lambda at: 20.0 * math.sin(2 * math.pi * 0.2 * at),
    "back and forth once a second": lambda at: 0.0 if at % 2 < 1 else 40.0,
    "round and round": lambda at: (at * 360.0 + 180.0) % 360.0 - 180.0,
}


@pytest.mark.parametrize("where", MOVES.values(), ids=MOVES)
def test_moves_are_no_oscillation(where: Where) -> None:
    assert watch(Oscillation(), where, 60.0) is None


def test_it_ends_with_the_oscillation() -> None:
    found = Oscillation()
    assert watch(found, swing(16.0, 1.0), 10.0) is not None
    assert found.since_turn(10.0) < 0.4
    watch(found, still(0.3), 2.0, start=10.0)
    assert found.since_turn(12.0) > QUIET_S
    assert not found.proved(12.0)


def test_a_reset_forgets_everything() -> None:
    found = Oscillation()
    watch(found, swing(16.0, 1.0), 5.0)
    found.reset()
    assert (found.proved(5.0), found.peak_to_peak_deg(), found.since_turn(5.0)) == (False, 0.0, math.inf)


@pytest.mark.parametrize("hz", [2.5, 8.0, 16.0, 30.0])
def test_the_frequency_is_measured_from_samples_close_together_only(hz: float) -> None:
    found = Oscillation()
    watch(found, swing(hz, 1.0), 5.0)
    assert found.rate_hz() is None, "ten samples a second do not show it"
    watch(found, swing(hz, 1.0), 1.0, hz=120.0, start=5.0)
    rate = found.rate_hz()
    assert rate is not None
    assert rate == pytest.approx(hz, rel=0.05)
    watch(found, still(0.0), 1.0, hz=120.0, start=6.0)
    assert found.rate_hz() is None, "it has ended"
