"""Virtual time: an event loop whose clock runs faster than the computer's, and waits for all work that is due.

The clock stands still while the loop works and moves to the next timer when nothing is ready. A slow computer therefore
lowers the speed; it never makes a timer late or a response time out.
"""

import asyncio
import math
import selectors
import time
from collections.abc import Callable
from concurrent.futures import Executor
from typing import Final, TypeVar, TypeVarTuple

from hornbill.units import Instant

START: Final[Instant] = 1000.0
"""Time of a new loop, s. Not zero, so that a clock that was not passed in is noticed."""

MAX_SPEED: Final = 1000.0
"""Highest speed that can be requested. A computer reaches a fraction of it."""

BEHIND_S: Final = 5.0
"""A loop that is later than this (s, real) does not catch up. One that is less late does, by exceeding its speed for a
while: clients compare its time with their own clocks."""

_MEASURED_S: Final = 1.0
_STANDING_S: Final = 0.05
"""Longest single wait of the clock for calls in other threads, s (real)."""

_T = TypeVar("_T")
_Ts = TypeVarTuple("_Ts")


class VirtualSelector(selectors.DefaultSelector):
    """Polls file descriptors, and moves the clock to the next timer.

    On average at most `speed` times as fast as real time.
    """

    def __init__(self, speed: float, real: Callable[[], float] = time.monotonic) -> None:
        """`speed`: above 0; infinity for as fast as possible. `real` returns real time, s."""
        super().__init__()
        self.now: Instant = START
        self.standing = 0
        """Number of reasons for which the clock stands still."""
        self._real = real
        self._speed = speed
        self._anchor = (real(), START)
        self._measured = self._anchor
        self._actual = 0.0

    @property
    def speed(self) -> float:
        """Highest speed. Infinity: as fast as possible."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        self._speed = speed
        self._anchor = (self._real(), self.now)

    @property
    def actual_speed(self) -> float:
        """Virtual seconds per real second, measured over at least the last second."""
        began, since = self._measured
        real = self._real()
        if real - began >= _MEASURED_S or not self._actual:
            self._actual = (self.now - since) / max(real - began, 1e-6)
            self._measured = (real, self.now)
        return self._actual

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Descriptors that are ready. With none, the clock advances by `timeout`, or by the part waited for."""
        ready = super().select(0)
        if ready or (timeout is not None and timeout <= 0):
            return ready
        if timeout is None:
            return self.idle()
        if self.standing:
            return super().select(_STANDING_S)
        until = self.now + timeout
        pause_s = self._pause_s(until)
        if pause_s > 0:
            ready = super().select(pause_s)
            if ready:
                real, virtual = self._anchor
                self.now = max(self.now, min(until, virtual + (self._real() - real) * self._speed))
                return ready
        # The timeout is `when - now`. Within a factor of two that difference is exact in
        # binary floating point, so the sum is exactly `when`.
        self.now = until
        return []

    def idle(self) -> list[tuple[selectors.SelectorKey, int]]:
        """Wait without a timer: only a descriptor or another thread can wake the loop."""
        return super().select(None)

    def _pause_s(self, until: Instant) -> float:
        """Real time to wait before the clock may show `until`, s."""
        if math.isinf(self._speed):
            return 0.0
        real, virtual = self._anchor
        now = self._real()
        pause_s = real + (until - virtual) / self._speed - now
        if pause_s < -BEHIND_S:
            self._anchor = (now, until)
        return pause_s


class VirtualLoop(asyncio.SelectorEventLoop):
    """An event loop in virtual time. All timers of the process are on it: bus, servos, leases, timeouts.

    `time()` starts at 1000.0 s. The clock stands still while a call of `run_in_executor` is running, so that a disk or
    a computation takes no virtual time; timeouts do not end such a call. Threads started otherwise take the virtual
    time that passes meanwhile.
    """

    jumps = True
    """The embedded bus delivers at exact times."""

    def __init__(self, speed: float = math.inf, selector: VirtualSelector | None = None) -> None:
        """`speed`: virtual seconds per second, above 0; infinity for as fast as possible."""
        self._virtual = selector or VirtualSelector(speed)
        super().__init__(self._virtual)
        self._epoch = time.time() - START

    @property
    def speed(self) -> float:
        """Highest speed, virtual seconds per second. May be set at any time."""
        return self._virtual.speed

    @speed.setter
    def speed(self, speed: float) -> None:
        self._virtual.speed = speed

    @property
    def actual_speed(self) -> float:
        """Virtual seconds per real second, measured over at least the last second."""
        return self._virtual.actual_speed

    def time(self) -> Instant:
        """Virtual time, s."""
        return self._virtual.now

    def utc(self) -> float:
        """Seconds since 1970 UTC in virtual time: real at the start of the loop, then faster."""
        return self._epoch + self._virtual.now

    def run_in_executor(
        self, executor: Executor | None, func: Callable[[*_Ts], _T], *args: *_Ts
    ) -> "asyncio.Future[_T]":
        """Call `func(*args)` in a thread. The clock stands still until it returns."""
        future = super().run_in_executor(executor, func, *args)
        self._virtual.standing += 1
        future.add_done_callback(self._go_on)
        return future

    def _go_on(self, _future: object) -> None:
        self._virtual.standing -= 1


def speed_of(loop: asyncio.AbstractEventLoop) -> float:
    """Virtual seconds per real second on `loop`, as expected; at least 1, which it is in real time."""
    if not isinstance(loop, VirtualLoop):
        return 1.0
    return max(1.0, loop.actual_speed if math.isinf(loop.speed) else loop.speed)


def utc_of(loop: asyncio.AbstractEventLoop) -> Callable[[], float]:
    """The wall clock for programs on `loop`: seconds since 1970 UTC, virtual if its time is."""
    return loop.utc if isinstance(loop, VirtualLoop) else time.time
