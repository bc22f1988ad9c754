"""Whether the port still holds frames of ours that have not been on the bus."""

from typing import Final

from hornbill.units import Instant
from hornbill.wire.port import PortStatistics

_PATIENCE_S: Final = 0.005


class Backlog:
    """Frames handed to a port against frames it says it has sent.

    A frame that was dropped is never counted as sent, so 5 ms after the last hand-over whatever is left is
    taken for gone.
    """

    def __init__(self, statistics: PortStatistics) -> None:
        self._statistics = statistics
        self._expected = statistics.tx_frames
        self._last: Instant = float("-inf")

    def handing(self, frames: int, now: Instant) -> None:
        """So many frames are about to be given to the port."""
        self._expected = max(self._expected, self._statistics.tx_frames) + frames
        self._last = now

    def is_empty(self, now: Instant) -> bool:
        """Whether everything is out, or lost."""
        return self._statistics.tx_frames >= self._expected or now - self._last >= _PATIENCE_S
