"""Frames queued in the port that have not been sent yet."""

from typing import Final

from hornbill.units import Instant
from hornbill.wire.port import PortStatistics

_TIMEOUT_S: Final = 0.005


class Backlog:
    """Compares the frames queued in a port with those it reports as sent.

    A dropped frame is never counted as sent. Therefore all frames count as gone 5 ms after the last was queued.
    """

    def __init__(self, statistics: PortStatistics) -> None:
        self._statistics = statistics
        self._expected = statistics.tx_frames
        self._last: Instant = float("-inf")

    def queue(self, frames: int, now: Instant) -> None:
        """Count frames about to be queued in the port."""
        self._expected = max(self._expected, self._statistics.tx_frames) + frames
        self._last = now

    def is_empty(self, now: Instant) -> bool:
        """Whether all frames were sent or lost."""
        return self._statistics.tx_frames >= self._expected or now - self._last >= _TIMEOUT_S
