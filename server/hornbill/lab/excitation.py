"""Excitation of a frequency response: offsets from the start angle on a fixed grid. Pure functions."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from hornbill.domain.frequency_response import Excitation

SLOT_S: Final = 0.01
"""Interval of the commands, s."""

STEP_DEG: Final = 0.1
"""Resolution of an angle command (0x00), °."""

REST_S: Final = 0.5
"""Time without excitation before and after, s, so that no motion is cut off."""

FADE_OUT_S: Final = 0.25

_WIDER: Final = 1.25
"""A chirp begins and ends this factor outside of the range, so that its ends are well within the excitation."""

_TRIALS: Final = 40
"""Sets of random phases of a multisine. The one with the lowest peak is used."""


@dataclass(frozen=True, slots=True)
class ExcitationPlan:
    """One excitation: peak `amplitude_deg` about the start angle, from `from_hz` to `to_hz`, for `duration_s`."""

    kind: Excitation
    amplitude_deg: float
    from_hz: float
    to_hz: float
    duration_s: float


def offsets(plan: ExcitationPlan) -> list[float]:
    """Offset from the start angle in each slot, °. It begins and ends softly at 0, and never exceeds the amplitude.

    Multiples of STEP_DEG, rounded towards 0.
    """
    t = np.arange(round(plan.duration_s / SLOT_S) + 1) * SLOT_S
    shape = _chirp(plan, t) if plan.kind == "chirp" else _multisine(plan, t)
    fade_in_s = min(0.5 / plan.from_hz, plan.duration_s / 4)
    rise, fall = t / fade_in_s, (plan.duration_s - t) / FADE_OUT_S
    soft = np.sin(np.pi / 2 * np.clip(np.minimum(rise, fall), 0.0, 1.0)) ** 2
    whole = np.trunc(plan.amplitude_deg * shape * soft / STEP_DEG + np.copysign(1e-9, shape))
    rest = [0.0] * round(REST_S / SLOT_S)
    return [*rest, *(round(one * STEP_DEG, 1) for one in whole.tolist()), *rest]


def _chirp(plan: ExcitationPlan, t: np.ndarray) -> np.ndarray:
    """A sine whose frequency rises by the same factor in each interval of time."""
    low, high = plan.from_hz / _WIDER, plan.to_hz * _WIDER
    hz = low * (high / low) ** (t / plan.duration_s)
    cycles = (hz - low) * plan.duration_s / np.log(high / low)
    return np.sin(2 * np.pi * cycles)


def _multisine(plan: ExcitationPlan, t: np.ndarray) -> np.ndarray:
    """Sines of all multiples of 1/duration in the range, with random phases and the power of a chirp in each octave."""
    lines = np.arange(np.ceil(plan.from_hz / _WIDER * plan.duration_s), plan.to_hz * _WIDER * plan.duration_s)
    size = len(t) * 4
    best: np.ndarray | None = None
    chance = np.random.default_rng(22)
    for _ in range(_TRIALS):
        spectrum = np.zeros(size // 2 + 1, dtype=complex)
        phases = chance.uniform(0, 2 * np.pi, len(lines))
        spectrum[lines.astype(int)] = np.exp(1j * phases) / np.sqrt(lines)
        fine = np.fft.irfft(spectrum, size)
        fine /= np.abs(fine).max()
        if best is None or np.mean(fine**2) > np.mean(best**2):
            best = fine
    assert best is not None
    return np.interp(t, np.arange(size) / size * plan.duration_s, best)
