"""Lag of the event loop: how late this process was, which looks like a servo that responds late."""

from collections import deque
from typing import Final

from hornbill.servo.runtime.histogram import Histogram
from hornbill.units import Instant

LAG_S: Final = 0.05
"""A lag from here on can make a request time out: a motion command has one try of 0.12 s."""

WINDOW_S: Final = 10.0
"""Time for which a lag counts as recent."""

BOUNDS_S: Final = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5)


class LoopLag:
    """Lags of the last seconds, from a task that wakes at fixed intervals."""

    def __init__(self) -> None:
        self.lags = Histogram(BOUNDS_S)
        """All lags since the start."""
        self.last_s = 0.0
        """Lag of the last wake-up, s."""
        self._recent: deque[tuple[Instant, float]] = deque()
        """Lags of at least LAG_S."""

    def add(self, now: Instant, late_s: float) -> None:
        """Record that the task woke up `late_s` too late."""
        self.last_s = max(0.0, late_s)
        self.lags.add(self.last_s)
        if self.last_s >= LAG_S:
            self._recent.append((now, self.last_s))
        while self._recent and now - self._recent[0][0] > WINDOW_S:
            self._recent.popleft()

    def worst_s(self, since: Instant) -> float:
        """Longest lag of at least LAG_S that ended after `since`, at most WINDOW_S ago, s; 0 if there was none."""
        return max((late for at, late in self._recent if at >= since), default=0.0)
