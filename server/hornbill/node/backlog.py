"""Frames queued in the port that have not been sent yet."""

from collections.abc import Callable
from typing import Final

from hornbill.units import Instant
from hornbill.wire.port import PortStatistics

_TIMEOUT_S: Final = 0.005


class Backlog:
    """Compares the frames queued in a port with those it reports as sent.

    A dropped frame is never counted as sent. Therefore all frames count as gone 5 ms after the last was queued.
    """

    def __init__(self, statistics: PortStatistics, clock: Callable[[], Instant]) -> None:
        self._clock = clock
        self._statistics = statistics
        self._expected = statistics.tx_frames
        self._last: Instant = float("-inf")

    def queue(self, frames: int, now: Instant) -> None:
        """Count frames about to be queued in the port."""
        sent = self._statistics.tx_frames
        self._expected = (sent if sent > self._expected else self._expected) + frames
        self._last = now

    def is_empty(self) -> bool:
        """Whether all frames were sent or lost."""
        return self._statistics.tx_frames >= self._expected or self._clock() - self._last >= _TIMEOUT_S
