"""Oscillation of a horn that should be at rest, detected from samples of its angle. Pure."""

import math
from collections import deque
from itertools import pairwise
from typing import Final, NamedTuple

from hornbill.servo.device.position_estimate import HALF_TURN_DEG
from hornbill.units import Instant

MIN_SWING_DEG: Final = 0.5
"""Minimum peak to peak. Quantisation of 0.1°, gear play and jitter at rest cause less."""

MIN_SWING_STEPS: Final = 2.5
"""The same in steps of the float16 in Status, which are 0.4° from 410° and 3° from 3,300°."""

TURNS: Final = 5
"""Consecutive turning points that prove oscillation: a horn that arrives, overshoots and returns has three."""

SPAN_S: Final = 2.5
"""Time window, so that slow back-and-forth moves do not count. The lowest detectable frequency is 0.8 Hz."""

SUSTAINED_S: Final = 1.0
"""Minimum time from the first to the last of them: ringing after a disturbance has decayed by then."""

SUSTAINED: Final = 0.5
"""Minimum ratio of the larger of the last two swings to the largest; a smaller ratio is a decaying swing. Not stricter,
because samples every 0.1 s hit a fast swing at any phase."""

WIDTH_S: Final = 1.0
"""Window for the peak-to-peak value, which includes at least the last swing."""

QUIET_S: Final = 1.0
"""Time without a turning point after which it may have ended."""

MAX_TURNS: Final = 400
"""Stored turning points: SPAN_S of the fastest swing detectable at 200 samples per second."""


RATE_SAMPLES: Final = 60
RATE_GAP_S: Final = 0.02
"""The frequency is measured from at least RATE_SAMPLES samples, each at most RATE_GAP_S after the one before."""

RATE_TURNS: Final = 4
"""Minimum turning points for a frequency."""


class _Turn(NamedTuple):
    t: Instant
    degrees: float


class Oscillation:
    """Turning points of an angle: extremes at least MIN_SWING_DEG apart.

    Samples every 0.1 s cannot show the frequency of a faster swing, but they hit it at varying phases, so they show its
    presence and amplitude. Within 0.8 Hz of a multiple of the sample rate, a swing appears slow or not at all.
    """

    __slots__ = ("_high", "_low", "_times", "_turns", "_up")

    def __init__(self) -> None:
        self._turns: deque[_Turn] = deque(maxlen=MAX_TURNS)
        self._times: deque[Instant] = deque(maxlen=2 * RATE_SAMPLES)
        self.reset()

    def reset(self) -> None:
        """Discard all samples, after a new command or a gap."""
        self._turns.clear()
        self._times.clear()
        self._low: _Turn | None = None
        self._high: _Turn | None = None
        self._up: bool | None = None

    def add(self, t: Instant, degrees: float) -> None:
        """Add the next sample."""
        if self._times and t - self._times[-1] > RATE_GAP_S:
            self._times.clear()
        self._times.append(t)
        here, low, high = _Turn(t, degrees), self._low, self._high
        if low is None or high is None:
            self._low = self._high = here
            return
        if degrees - high.degrees > HALF_TURN_DEG or low.degrees - degrees > HALF_TURN_DEG:
            self.reset()  # wrapped at ±180°, or turned manually
            self._low = self._high = here
            return
        least = _min_swing(degrees)
        if degrees > high.degrees:
            high = here
        if degrees < low.degrees:
            low = here
        if self._up is not True and degrees - low.degrees >= least:
            self._turn(low, up=True)
            high = here
        elif self._up is not False and high.degrees - degrees >= least:
            self._turn(high, up=False)
            low = here
        # while it rises only the highest point matters, and vice versa
        self._low, self._high = (here, high) if self._up is True else (low, here) if self._up is False else (low, high)

    def since_turn(self, now: Instant) -> float:
        """Time since the last turning point, s; infinite if there is none."""
        return now - self._turns[-1].t if self._turns else math.inf

    @property
    def suspected(self) -> bool:
        """Whether it has recently swung: it may be settling, or oscillate in a way that Status does not show."""
        return len(self._recent()) > 1

    def proved(self, now: Instant) -> bool:
        """Whether it is oscillating steadily."""
        if self.since_turn(now) > QUIET_S:
            return False
        turns = self._recent()
        if len(turns) < TURNS or turns[-1].t - turns[0].t < SUSTAINED_S:
            return False
        ways = [abs(after.degrees - before.degrees) for before, after in pairwise(turns)]
        return max(ways[-2:]) >= SUSTAINED * max(ways)

    def peak_to_peak_deg(self) -> float:
        """Recent peak-to-peak amplitude, degrees; 0 without oscillation."""
        turns = self._recent()
        angles = [
            turn.degrees for at, turn in enumerate(turns, 2) if turns[-1].t - turn.t <= WIDTH_S or at > len(turns)
        ]
        return max(angles) - min(angles) if angles else 0.0

    def rate_hz(self) -> float | None:
        """Frequency, Hz. None if the last samples are too few or too far apart to show it."""
        times = self._times
        if len(times) < RATE_SAMPLES:
            return None
        turns = [turn.t for turn in self._turns if turn.t >= times[0]]
        if len(turns) < RATE_TURNS:
            return None
        return (len(turns) - 1) / 2 / (turns[-1] - turns[0])

    def _recent(self) -> list[_Turn]:
        return [turn for turn in self._turns if self._turns[-1].t - turn.t <= SPAN_S]

    def _turn(self, at: _Turn, *, up: bool) -> None:
        self._up = up
        self._turns.append(at)


def _min_swing(degrees: float) -> float:
    """Minimum distance between two turning points at this angle, degrees."""
    step = 2.0 ** (math.frexp(degrees / 100.0)[1] - 11) * 100.0
    return max(MIN_SWING_DEG, MIN_SWING_STEPS * step)
