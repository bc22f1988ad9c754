"""Frequency response from commands and samples of the angle: gain, phase, coherence, bandwidth and margins. Pure.

The command is held between its slots (a staircase), and the angle is interpolated linearly between its samples. The
Fourier integrals of both are exact at any times, so that neither needs a grid. At each frequency the response is the
least-squares fit of the angle to the command over the neighbouring lines of the spectrum (H1), linear in frequency, so
that a delay within the band costs no coherence. Excitation and motion begin and end at rest: nothing leaks.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, log2
from typing import Final

import numpy as np

from hornbill.domain.frequency_response import Estimate, FrequencyMetrics
from hornbill.domain.note import Note

RELIABLE: Final = 0.9
"""Coherence above which gain and phase are shown, if the gain is also known to PRECISE_DB."""

PRECISE_DB: Final = 1.0
"""Largest half of the 95 % interval of a gain that is shown. Few lines of the spectrum need more coherence."""

PER_OCTAVE: Final = 8
"""Frequencies per octave."""

BAND: Final = 0.04
"""Half of the band around a frequency, as a share of it."""

LEAST_LINES: Final = 4
"""Lines on either side of a frequency, at least."""

LEAST_DEFINED: Final = 0.9
"""The interpolation between samples may reduce the gain to this share, which is corrected. With longer gaps between
samples a frequency is not reliable."""

LEAST_SWING_DEG: Final = 0.2
"""Least amplitude of the angle at one frequency of a chirp: two steps of its resolution. Rounding distorts less."""

DRAWS: Final = 300
"""Random curves within the errors, from which the intervals of the metrics are computed."""

DEPENDS_DB: Final = 1.5
"""A gain that differs by more than this between two amplitudes depends on the amplitude."""

PART: Final = 1000
"""Points of a record that are transformed at once."""

Points = Sequence[tuple[float, float]]
"""Times, s, and angles, °."""


@dataclass(frozen=True, slots=True)
class Curve:
    """Response by frequency: complex from command to angle, with the radius of its 95 % region and its coherence."""

    hz: np.ndarray
    response: np.ndarray
    radius: np.ndarray
    coherence: np.ndarray
    reliable: np.ndarray

    @property
    def gain_db(self) -> np.ndarray:
        """Gain, dB."""
        return _db(np.abs(self.response))

    @property
    def gain_error_db(self) -> np.ndarray:
        """Half of the 95 % interval of the gain, dB."""
        return _db(1.0 + np.minimum(self.radius / np.maximum(np.abs(self.response), 1e-9), 1e3))

    @property
    def phase_deg(self) -> np.ndarray:
        """Phase, not wrapped, °."""
        return unwrapped(self.response)

    @property
    def phase_error_deg(self) -> np.ndarray:
        """Half of the 95 % interval of the phase, °."""
        share = np.minimum(self.radius / np.maximum(np.abs(self.response), 1e-9), 1.0)
        return np.degrees(np.arcsin(share))


def estimate(
    commands: Points, samples: Points, from_hz: float, to_hz: float, *, chirp_deg: float | None = None
) -> Curve:
    """Response from the commands that were in effect, and samples of the angle, both in order of time.

    `chirp_deg` is the amplitude of a chirp; None for a multisine, whose other sines reveal what rounding hides. Raises
    ValueError with fewer than two of either.
    """
    if len(commands) < 2 or len(samples) < 2:
        raise ValueError("a frequency response needs at least two commands and two samples")
    steps, points = np.asarray(commands, dtype=float), np.asarray(samples, dtype=float)
    begin, end = max(steps[0, 0], points[0, 0]), min(steps[-1, 0], points[-1, 0])
    length = max(end - begin, 1e-3)
    lines = np.arange(1, max(int(to_hz * (1 + 2 * BAND) * length), LEAST_LINES) + LEAST_LINES + 1)
    omega = 2 * np.pi * lines / length
    x = _held(steps[:, 0] - begin, steps[:, 1] - steps[0, 1], omega, length)
    y = _interpolated(points[:, 0] - begin, points[:, 1], omega)
    gaps = np.diff(points[:, 0])
    defined: np.ndarray = (gaps * np.sinc(np.outer(lines / length, gaps)) ** 2).sum(axis=1) / gaps.sum()
    y /= np.maximum(defined, 1e-3)
    octaves = log2(to_hz / from_hz)
    hz: np.ndarray = np.geomspace(from_hz, to_hz, round(octaves * PER_OCTAVE) + 1)
    found = [_fit(each, lines / length, x, y) for each in hz.tolist()]
    response, radius, coherence = (np.array(column) for column in zip(*found, strict=True))
    precise = radius <= np.abs(response) * (10 ** (PRECISE_DB / 20) - 1)
    there = np.interp(hz, lines / length, defined) >= LEAST_DEFINED
    reliable: np.ndarray = (coherence > RELIABLE) & precise & there
    if chirp_deg is not None:
        reliable &= np.abs(response) * chirp_deg >= LEAST_SWING_DEG
    return Curve(hz, response, radius, coherence, reliable)


def _held(t: np.ndarray, value: np.ndarray, omega: np.ndarray, length: float) -> np.ndarray:
    """Fourier integral of a staircase from its steps."""
    return _constant_between(np.append(t, max(length, t[-1])), value, omega)


def _interpolated(t: np.ndarray, value: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Fourier integral of a line through points, less the straight line from the first to the last."""
    value = value - np.interp(t, [t[0], t[-1]], [value[0], value[-1]])
    slopes = np.diff(value) / np.maximum(np.diff(t), 1e-9)
    return _constant_between(t, slopes, omega) / (1j * omega)


def _constant_between(edges: np.ndarray, value: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Fourier integral of a function with a constant value between edges. In parts, to limit memory."""
    total = np.zeros(len(omega), dtype=complex)
    for first in range(0, len(value), PART):
        part = slice(first, first + PART)
        waves = np.exp(-1j * np.outer(omega, edges[first : first + PART + 1]))
        total += (waves[:, :-1] - waves[:, 1:]) @ value[part]
    return total / (1j * omega)


def _fit(hz: float, lines: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[complex, float, float]:
    """Response at one frequency, the radius of its 95 % region, and its coherence."""
    nearest = int(np.argmin(np.abs(lines - hz)))
    half = max(LEAST_LINES, round(BAND * hz / float(lines[0])))
    band = slice(max(0, nearest - half), nearest + half + 1)
    a, b = x[band], y[band]
    matrix = np.stack([a, a * (lines[band] - hz)], axis=1)
    power = float((np.abs(b) ** 2).sum())
    gram = matrix.conj().T @ matrix
    if power <= 0.0 or abs(np.linalg.det(gram)) < 1e-30:
        return 0j, float("inf"), 0.0
    covariance = np.linalg.inv(gram)
    fitted = covariance @ (matrix.conj().T @ b)
    free = len(b) - 2
    left = float((np.abs(b - matrix @ fitted) ** 2).sum()) / free
    coherence = min(max(1.0 - left / (power / len(b)), 0.0), 1.0)
    radius = float(np.sqrt(left * covariance[0, 0].real * _quantile(2 * free)))
    return complex(fitted[0]), radius, coherence


def _quantile(free: int, beyond: float = 0.05) -> float:
    """Quantile of the F distribution with 2 and `free` degrees of freedom."""
    return free / 2 * (beyond ** (-2 / free) - 1)


def metrics(curve: Curve, *, loop: bool) -> FrequencyMetrics:
    """Metrics with 95 % intervals, from the reliable frequencies. Without `loop` (smoothing is on) no margins."""
    good = curve.reliable
    hz, response = curve.hz[good], curve.response[good]
    chance = np.random.default_rng(22)
    # the radius of a 95 % region is 2.45 standard deviations of each of both parts
    scale = np.nan_to_num(curve.radius[good] / 2.448)
    noise = chance.standard_normal((DRAWS, len(hz))) + 1j * chance.standard_normal((DRAWS, len(hz)))
    best = _values(hz, response, loop=loop)
    drawn = np.array([_values(hz, response + scale * each, loop=loop) for each in noise])
    found = [_interval(value, column) for value, column in zip(best, drawn.T, strict=True)]
    fall, lag, delay, peak, peak_hz, factor, factor_hz, phase, phase_hz = found
    return FrequencyMetrics(
        bandwidth_3db_hz=fall, bandwidth_90deg_hz=lag, delay_s=delay, peak_db=peak,
        peak_hz=None if peak_hz is None else peak_hz.value, gain_margin_db=factor,
        gain_margin_hz=None if factor_hz is None else factor_hz.value, phase_margin_deg=phase,
        phase_margin_hz=None if phase_hz is None else phase_hz.value,
    )  # fmt: skip


def _values(hz: np.ndarray, response: np.ndarray, *, loop: bool) -> tuple[float, ...]:
    """Metrics in the order of `metrics`. NaN: not within these frequencies."""
    nothing = float("nan")
    if len(hz) < 3:
        return (nothing,) * 9
    gain, phase = _db(np.abs(response)), unwrapped(response)
    highest = int(gain.argmax())
    low = phase > -60.0
    low &= np.cumsum(~low) == 0
    slope = float((hz[low] * phase[low]).sum() / (hz[low] ** 2).sum()) if low.sum() >= 3 else nothing
    closed = (
        crossing(hz, gain, -3.0), crossing(hz, phase, -90.0), -slope / 360.0, float(gain[highest]), float(hz[highest]),
    )  # fmt: skip
    if not loop:
        return *closed, nothing, nothing, nothing, nothing
    opened = response / (1.0 - response)
    size, angle = _db(np.abs(opened)), unwrapped(opened)
    turned, unity = crossing(hz, angle, -180.0), crossing(hz, size, 0.0)
    return (
        *closed, -float(np.interp(turned, hz, size)), turned, 180.0 + float(np.interp(unity, hz, angle)), unity,
    )  # fmt: skip


def crossing(hz: np.ndarray, value: np.ndarray, level: float) -> float:
    """Frequency at which a curve first falls below a level, interpolated. NaN if it does not or begins below."""
    below = np.flatnonzero(value < level)
    if not len(below) or below[0] == 0:
        return float("nan")
    after = int(below[0])
    share = (value[after - 1] - level) / (value[after - 1] - value[after])
    return float(hz[after - 1] + share * (hz[after] - hz[after - 1]))


def unwrapped(response: np.ndarray) -> np.ndarray:
    """Phase, °, continuous from the lowest frequency, where it is between −270° and 90°."""
    phase = np.degrees(np.unwrap(np.angle(response)))
    return phase - 360.0 if len(phase) and phase[0] > 90.0 else phase


def _interval(value: float, drawn: np.ndarray) -> Estimate | None:
    """A metric with its interval. None if unknown, or in more than a tenth of the curves within the errors."""
    there = drawn[np.isfinite(drawn)]
    if not isfinite(value) or len(there) < 0.9 * len(drawn):
        return None
    low, high = np.percentile(there, [2.5, 97.5])
    return Estimate(value, min(float(low), value), max(float(high), value))


def _db(gain: np.ndarray) -> np.ndarray:
    return 20 * np.log10(np.maximum(gain, 1e-9))


def dependence(curves: Sequence[Curve], amplitudes: Sequence[float]) -> Note | None:
    """How the gain depends on the amplitude: curves at half, one and two times the amplitude."""
    small, middle, large = curves
    for curve, amplitude, code, what in (
        (small, amplitudes[0], "deadband_dependence", "At the small amplitude of {:g}° the gain is {:.1f} dB lower: "
         "the deadband or friction."),
        (large, amplitudes[2], "saturation_dependence", "At the large amplitude of {:g}° the gain is {:.1f} dB lower: "
         "speed or torque saturates."),
    ):  # fmt: skip
        both = curve.reliable & middle.reliable
        if not both.any():
            continue
        drop = middle.gain_db[both] - curve.gain_db[both]
        drop -= curve.gain_error_db[both] + middle.gain_error_db[both]
        worst = float(np.percentile(drop, 90))
        if worst > DEPENDS_DB:
            return Note(what.format(amplitude, worst), code, {"amplitude_deg": amplitude, "drop_db": round(worst, 1)})  # pyright: ignore[reportArgumentType] - one of both
    return None
