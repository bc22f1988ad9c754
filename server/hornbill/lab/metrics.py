"""The numbers of a step response: delay, rise, overshoot, settling, hunting. Pure; the definitions never change.

Angles in degrees, times in seconds from the command. Every time is true to within one sample of the trace: a crossing
is placed on the straight line between the two samples around it, and the true one may be anywhere between them.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Final, Literal

import numpy as np

from hornbill.domain.step_test import StepMetrics

DELAY_AT: Final = 0.05
RISE_FROM, RISE_TO = 0.10, 0.90
"""Shares of the step: the delay ends at the first, the rise goes from the second to the third."""

DWELL_S: Final = 0.2
"""How long the angle has to stay within the band before it counts as settled."""

HUNTING_HZ: Final = 1.0
"""Full swings a second, outside a quarter of the band, from which a horn is said to hunt."""

CYCLE: Final = 3
"""Changes of sign that a horn which never settled needs to hunt: a full swing, so that a single one proves nothing."""

LASTING: Final = 0.7
"""Share of a swing that must be left in the second half of the time looked at, or it dies away."""

FASTEST_HZ: Final = 50.0
"""No horn is taken to swing faster. With fewer than two samples in such a swing a faster one would look like a slower
one, so no frequency is told."""

Hunting = Literal["none", "slight", "hunting"]


def of_step(
    t: Sequence[float], angle_deg: Sequence[float], from_deg: float, to_deg: float, *, band_deg: float
) -> StepMetrics:
    """The numbers of one step from `from_deg` to `to_deg`, of samples in order from the command (t = 0) on.

    Raises ValueError without a step, with fewer than two samples, or when the times do not increase.
    """
    step = to_deg - from_deg
    times, angles = np.asarray(t, dtype=float), np.asarray(angle_deg, dtype=float)
    if step == 0 or len(times) < 2 or len(times) != len(angles):
        raise ValueError("a step response needs a step and at least two samples of it")
    gaps = np.diff(times)
    if not (gaps > 0).all():
        raise ValueError("the times of a step response must increase")
    share = (angles - from_deg) / step  # 0 at the start, 1 at the target, whichever way it goes
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
    """When the share first reaches a level, on the line between the samples around it."""
    reached = np.flatnonzero(share >= level)
    if not len(reached):
        return None
    at = int(reached[0])
    if at == 0:
        return float(times[0])
    below, above = share[at - 1], share[at]
    return float(times[at - 1] + (level - below) / (above - below) * (times[at] - times[at - 1]))


def _settled(times: np.ndarray, error: np.ndarray, band_deg: float) -> int | None:
    """The first sample from which the angle stays within the band to the end, which must be a dwell away."""
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
    """The last half of the time from an instant on."""
    middle = (since + float(times[-1])) / 2
    return slice(int((times < middle).sum()), None)


def _hunting(
    times: np.ndarray, error: np.ndarray, band_deg: float, *, settled: bool
) -> tuple[Hunting, float | None, float | None]:
    """Whether a horn still goes to and fro: RMS about its mean, and full swings a second."""
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
    if len(turns) >= CYCLE:  # from turn to turn, so that it does not matter where the samples begin and end
        hertz = (len(turns) - 1) / 2 / float(times[turns[-1]] - times[turns[0]])
    if float(np.median(np.diff(times))) > 1 / (2 * FASTEST_HZ):
        hertz = None
    return ("hunting" if rms > band_deg / 2 else "slight"), rms, hertz


def _lasts(swing: np.ndarray) -> bool:
    """Whether the second half swings about as far as the first."""
    half = len(swing) // 2
    return float(np.ptp(swing[half:])) >= LASTING * float(np.ptp(swing[:half]))
