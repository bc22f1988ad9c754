"""TimeBase: the event loop's monotonic clock, and its offset to UTC."""

import time
from bisect import bisect_right
from collections.abc import Callable
from typing import Final

from hornbill import clocks
from hornbill.units import Instant

STEP_S: Final = 0.25
"""A difference of the clocks above this is a step: the wall clock was set, or the computer was suspended."""

STEPS_KEPT: Final = 100


class TimeBase:
    """One clock for everything the host stamps. A step of the wall clock reorders no instants: each keeps the offset
    that was right when it was stamped.
    """

    def __init__(self, now: Callable[[], Instant], wall: Callable[[], float] = time.time) -> None:
        """`wall` gives seconds since 1970 UTC."""
        self.now = now
        self._wall = wall
        self.utc_offset = clocks.ahead(now, wall)
        """What to add to an instant of now for seconds since 1970 UTC."""
        self._since: list[Instant] = []
        self._offsets = [self.utc_offset]

    def follow(self) -> float:
        """Take the offset again after a step, and return the step in seconds, else 0. Call it every second."""
        offset = clocks.ahead(self.now, self._wall)
        step = offset - self.utc_offset
        if abs(step) <= STEP_S:
            return 0.0
        self.utc_offset = offset
        self._since = [*self._since, self.now()][-STEPS_KEPT:]
        self._offsets = [*self._offsets, offset][-STEPS_KEPT - 1 :]
        return step

    def utc(self, at: Instant) -> float:
        """An instant as seconds since 1970 UTC."""
        return at + self._offsets[bisect_right(self._since, at)]

    def utc_now(self) -> float:
        """Now, as seconds since 1970 UTC."""
        return self.utc(self.now())
