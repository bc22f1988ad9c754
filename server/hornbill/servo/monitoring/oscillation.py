"""Oscillation: whether a horn that should rest swings to and fro, from samples of its angle as they come. Pure."""

import math
from collections import deque
from itertools import pairwise
from typing import Final, NamedTuple

from hornbill.servo.device.position_estimate import HALF_TURN_DEG
from hornbill.units import Instant

LEAST_DEG: Final = 0.5
"""Peak to peak. Less is what reading in steps of 0.1°, play of the gear and a trembling horn make of rest."""

LEAST_STEPS: Final = 2.5
"""The same in steps of the 16-bit float in Status, which counts in 0.4° from 410° on and in 3° from 3,300° on."""

TURNS: Final = 5
"""Turning points in a row that prove a swing: a horn that arrives, overshoots and is pulled back has three."""

SPAN_S: Final = 2.5
"""Within this time, so that slow moves to and fro prove nothing: 0.8 Hz is the slowest that is found."""

SUSTAINED_S: Final = 1.0
"""From the first to the last of them: what rings after a push has calmed down by then."""

SUSTAINED: Final = 0.5
"""The larger of the last two swings over the largest of all, or it dies away. No more than that, because samples every
0.1 s meet a fast swing at any phase."""

WIDTH_S: Final = 1.0
"""Its width is that of the swings within this time, and of the last one at least."""

QUIET_S: Final = 1.0
"""Without a turning point for so long it may have ended."""

KEPT: Final = 400
"""Turning points: SPAN_S of the fastest swing that can be followed at 200 samples a second."""


class _Turn(NamedTuple):
    t: Instant
    degrees: float


class Oscillation:
    """Turning points of an angle: extremes with at least LEAST_DEG of way between them.

    Samples every 0.1 s cannot tell the frequency of a faster swing, but they do meet it at one phase after another, so
    they tell that it is there and how wide. Within 0.8 Hz of a multiple of the rate of samples a swing looks slow, or
    like none.
    """

    __slots__ = ("_high", "_low", "_turns", "_up")

    def __init__(self) -> None:
        self._turns: deque[_Turn] = deque(maxlen=KEPT)
        self.reset()

    def reset(self) -> None:
        """Forget everything: the horn was told to go elsewhere, or was silent."""
        self._turns.clear()
        self._low: _Turn | None = None
        self._high: _Turn | None = None
        self._up: bool | None = None

    def add(self, t: Instant, degrees: float) -> None:
        """Take the next sample."""
        here, low, high = _Turn(t, degrees), self._low, self._high
        if low is None or high is None:
            self._low = self._high = here
            return
        if degrees - high.degrees > HALF_TURN_DEG or low.degrees - degrees > HALF_TURN_DEG:
            self.reset()  # wrapped at ±180°, or turned by hand
            self._low = self._high = here
            return
        least = _least(degrees)
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
        # while it goes up nothing but the highest point matters, and the other way round
        self._low, self._high = (here, high) if self._up is True else (low, here) if self._up is False else (low, high)

    def since_turn(self, now: Instant) -> float:
        """Seconds since it turned last; infinity if it did not."""
        return now - self._turns[-1].t if self._turns else math.inf

    @property
    def suspected(self) -> bool:
        """Whether it has gone to and fro lately: it may be on its way to rest, or swing as Status does not show it."""
        return len(self._recent()) > 1

    def proved(self, now: Instant) -> bool:
        """Whether it swings now and keeps swinging."""
        if self.since_turn(now) > QUIET_S:
            return False
        turns = self._recent()
        if len(turns) < TURNS or turns[-1].t - turns[0].t < SUSTAINED_S:
            return False
        ways = [abs(after.degrees - before.degrees) for before, after in pairwise(turns)]
        return max(ways[-2:]) >= SUSTAINED * max(ways)

    def peak_to_peak_deg(self) -> float:
        """How wide it swung last; 0 if it did not."""
        turns = self._recent()
        angles = [
            turn.degrees for at, turn in enumerate(turns, 2) if turns[-1].t - turn.t <= WIDTH_S or at > len(turns)
        ]
        return max(angles) - min(angles) if angles else 0.0

    def _recent(self) -> list[_Turn]:
        return [turn for turn in self._turns if self._turns[-1].t - turn.t <= SPAN_S]

    def _turn(self, at: _Turn, *, up: bool) -> None:
        self._up = up
        self._turns.append(at)


def _least(degrees: float) -> float:
    """The least way between two turning points there."""
    step = 2.0 ** (math.frexp(degrees / 100.0)[1] - 11) * 100.0
    return max(LEAST_DEG, LEAST_STEPS * step)
