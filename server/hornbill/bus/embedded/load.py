"""Bus load over the last second."""

from collections import deque

from hornbill.units import Instant

WINDOW_S = 1.0


class LoadMeter:
    """Sums the bus time of frames that ended within the last WINDOW_S seconds."""

    def __init__(self) -> None:
        self._spans: deque[tuple[Instant, float]] = deque()
        self._sum = 0.0

    def add(self, end: Instant, seconds: float) -> None:
        """Record that the bus was busy for `seconds` until `end`. `end` must not decrease."""
        self._spans.append((end, seconds))
        self._sum += seconds
        self._forget(end)

    def share(self, now: Instant) -> float:
        """Load over the window ending `now`, 0..1."""
        self._forget(now)
        return min(1.0, max(0.0, self._sum / WINDOW_S))

    def _forget(self, now: Instant) -> None:
        spans = self._spans
        while spans and spans[0][0] <= now - WINDOW_S:
            self._sum -= spans.popleft()[1]
        if not spans:
            self._sum = 0.0  # rounding errors must not accumulate over days
