"""Metrics of a step response: delay, rise, overshoot, settling, hunting. Pure functions; definitions never change.

Angles in degrees, times in seconds from the command. Times are accurate to one sample of the trace: a crossing is
interpolated linearly between the two samples around it, and the true one may be anywhere between them.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Final, Literal

import numpy as np

from hornbill.domain.step_test import StepMetrics

DELAY_AT: Final = 0.05
RISE_FROM, RISE_TO = 0.10, 0.90
"""Shares of the step: the delay ends at the first; the rise time is from the second to the third."""

DWELL_S: Final = 0.2
"""How long the angle must stay within the band to count as settled, s."""

HUNTING_HZ: Final = 1.0
"""Minimum frequency of hunting: full swings outside a quarter of the band."""

CYCLE: Final = 3
"""Sign changes required for hunting without settling: more than a single swing."""

LASTING: Final = 0.7
"""Share of the amplitude that must remain in the second half of the time. Otherwise the oscillation decays."""

FASTEST_HZ: Final = 50.0
"""Maximum frequency of a horn. With fewer than two samples per period of it, aliasing is possible and no frequency is
reported."""

Hunting = Literal["none", "slight", "hunting"]


def of_step(
    t: Sequence[float], angle_deg: Sequence[float], from_deg: float, to_deg: float, *, band_deg: float
) -> StepMetrics:
    """Metrics of one step from `from_deg` to `to_deg`, from samples in order, starting with the command (t = 0).

    Raises ValueError without a step, with fewer than two samples, or if the times do not increase.
    """
    step = to_deg - from_deg
    times, angles = np.asarray(t, dtype=float), np.asarray(angle_deg, dtype=float)
    if step == 0 or len(times) < 2 or len(times) != len(angles):
        raise ValueError("a step response needs a step and at least two samples")
    gaps = np.diff(times)
    if not (gaps > 0).all():
        raise ValueError("the times of a step response must increase")
    share = (angles - from_deg) / step  # 0 at the start, 1 at the target, in either direction
    farthest = float(share.max())
    settled = _settled(times, angles - to_deg, band_deg)
    crossing = _crossing(times, share, 1.0)
    after = _tail(times, crossing or 0.0) if settled is None else slice(settled, None)
    hunting, rms, hertz = _hunting(times[after], angles[after] - to_deg, band_deg, settled=settled is not None)
    begin, end = _crossing(times, share, RISE_FROM), _crossing(times, share, RISE_TO)
    return StepMetrics(
        sample_s=float(gaps.max()),
        delay_s=_crossing(times, share, DELAY_AT),
        rise_s=None if begin is None or end is None else end - begin,
        crossing_s=crossing,
        peak_deg=float(from_deg + farthest * step),
        overshoot_pct=None if farthest < RISE_TO else max(0.0, farthest - 1.0) * 100,
        settling_s=None if settled is None else float(times[settled]),
        steady_state_error_deg=_mean_over_dwell(times, angles - to_deg, settled),
        peak_speed_rpm=float(np.abs(np.diff(angles) / gaps).max()) / 6.0,
        hunting=hunting,
        hunting_rms_deg=rms,
        hunting_hz=hertz,
    )


def _crossing(times: np.ndarray, share: np.ndarray, level: float) -> float | None:
    """Time at which the share first reaches a level, interpolated linearly."""
    reached = np.flatnonzero(share >= level)
    if not len(reached):
        return None
    at = int(reached[0])
    if at == 0:
        return float(times[0])
    below, above = share[at - 1], share[at]
    return float(times[at - 1] + (level - below) / (above - below) * (times[at] - times[at - 1]))


def _settled(times: np.ndarray, error: np.ndarray, band_deg: float) -> int | None:
    """First sample from which the angle stays within the band to the end, for at least DWELL_S. None if not settled."""
    outside = np.flatnonzero(np.abs(error) > band_deg)
    first = int(outside[-1]) + 1 if len(outside) else 0
    if first >= len(times) or times[-1] - times[first] < DWELL_S:
        return None
    return first


def _mean_over_dwell(times: np.ndarray, error: np.ndarray, settled: int | None) -> float | None:
    if settled is None:
        return None
    within = (times >= times[settled]) & (times <= times[settled] + DWELL_S)
    return float(error[within].mean())


def _tail(times: np.ndarray, since: float) -> slice:
    """The last half of the time after `since`."""
    middle = (since + float(times[-1])) / 2
    return slice(int((times < middle).sum()), None)


def _hunting(
    times: np.ndarray, error: np.ndarray, band_deg: float, *, settled: bool
) -> tuple[Hunting, float | None, float | None]:
    """Hunting of a horn: verdict, RMS about its mean, and frequency."""
    if len(times) < 2:
        return "none", None, None
    swing = error - error.mean()
    rms = float(np.sqrt((swing**2).mean()))
    outside: list[int] = np.flatnonzero(np.abs(swing) > band_deg / 4).tolist()
    turns = [at for before, at in pairwise(outside) if swing[before] * swing[at] < 0]
    rate = len(turns) / 2 / float(times[-1] - times[0])
    if not settled and (len(turns) < CYCLE or not _lasts(swing)):
        return "none", None, None
    if rate < HUNTING_HZ:
        return "none", rms, rate
    hertz: float | None = rate
    if len(turns) >= CYCLE:  # between sign changes, independent of start and end of the samples
        hertz = (len(turns) - 1) / 2 / float(times[turns[-1]] - times[turns[0]])
    if float(np.median(np.diff(times))) > 1 / (2 * FASTEST_HZ):
        hertz = None
    return ("hunting" if rms > band_deg / 2 else "slight"), rms, hertz


def _lasts(swing: np.ndarray) -> bool:
    """Whether the amplitude in the second half is about that in the first."""
    half = len(swing) // 2
    return float(np.ptp(swing[half:])) >= LASTING * float(np.ptp(swing[:half]))
