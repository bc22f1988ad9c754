"""Time base: the event loop's monotonic clock and its offset to UTC."""

import time
from bisect import bisect_right
from collections.abc import Callable
from typing import Final

from hornbill import clocks
from hornbill.units import Instant

STEP_S: Final = 0.25
"""A larger difference of the clocks is a step: the wall clock was set, or the computer was suspended."""

MAX_STEPS: Final = 100


class TimeBase:
    """The clock for all timestamps of the host. A step of the wall clock reorders no instants: each one keeps the
    offset that was valid when it was taken.
    """

    def __init__(self, now: Callable[[], Instant], wall: Callable[[], float] = time.time) -> None:
        """`wall` returns seconds since 1970 UTC."""
        self.now = now
        self._wall = wall
        self.utc_offset = clocks.ahead(now, wall)
        """Add this to a current instant to get seconds since 1970 UTC."""
        self._since: list[Instant] = []
        self._offsets = [self.utc_offset]

    def follow(self) -> float:
        """Update the offset after a step and return the step, s; 0 if there was none. Call every second."""
        offset = clocks.ahead(self.now, self._wall)
        step = offset - self.utc_offset
        if abs(step) <= STEP_S:
            return 0.0
        self.utc_offset = offset
        self._since = [*self._since, self.now()][-MAX_STEPS:]
        self._offsets = [*self._offsets, offset][-MAX_STEPS - 1 :]
        return step

    def utc(self, at: Instant) -> float:
        """An instant as seconds since 1970 UTC."""
        return at + self._offsets[bisect_right(self._since, at)]

    def utc_now(self) -> float:
        """Now, as seconds since 1970 UTC."""
        return self.utc(self.now())
