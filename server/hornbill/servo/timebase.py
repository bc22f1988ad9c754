"""Owns TimeBase: the event loop's monotonic clock, and its offset to UTC."""

import time
from collections.abc import Callable

from hornbill import clocks
from hornbill.units import Instant


class TimeBase:
    """One clock for everything the host stamps. The offset is fixed at start: a step of the wall clock never
    reorders samples.
    """

    def __init__(self, now: Callable[[], Instant], wall: Callable[[], float] = time.time) -> None:
        self.now = now
        self.utc_offset = clocks.ahead(now, wall)

    def utc(self, at: Instant) -> float:
        """An instant as seconds since 1970 UTC."""
        return at + self.utc_offset

    def utc_now(self) -> float:
        """Now, as seconds since 1970 UTC."""
        return self.utc(self.now())
