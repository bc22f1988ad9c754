"""An event loop whose clock jumps to the next timer instead of waiting for it."""

import asyncio
import selectors
from collections.abc import Callable, Coroutine
from concurrent.futures import Executor
from typing import Any, TypeVar, TypeVarTuple

from hornbill.units import Instant

_T = TypeVar("_T")
_Ts = TypeVarTuple("_Ts")

START: Instant = 1000.0
"""Time of a new JumpingLoop, s. Not zero, so that a clock that was not passed in is noticed."""


class Deadlock(RuntimeError):
    """All tasks wait for events that can no longer occur."""


class _JumpingSelector(selectors.DefaultSelector):
    """Polls file descriptors, and advances the clock instead of sleeping."""

    def __init__(self) -> None:
        super().__init__()
        self.now: Instant = START
        self.stuck_after_s = 1.0
        self.waiting: Callable[[], str] = str

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        ready = super().select(0)
        if ready:
            return ready
        if timeout is None:
            # Only a file descriptor or another thread can wake the loop now; neither uses this clock.
            ready = super().select(self.stuck_after_s)
            if not ready:
                raise Deadlock(
                    f"nothing is ready, no timer is set, no file descriptor was ready for {self.stuck_after_s} s: "
                    f"{self.waiting()} would wait forever"
                )
        elif timeout > 0:
            # The timeout is `when - now`. Within a factor of two that difference is exact in
            # binary floating point, so the sum is exactly `when`.
            self.now += timeout
        return ready


class JumpingLoop(asyncio.SelectorEventLoop):
    """An event loop for tests and protocol benchmarks: an hour on the bus takes the processing time of its events.

    `time()` starts at 1000.0 s and advances only when nothing is ready, to the next timer. File descriptors are
    polled, never waited for while a timer is set. `run_in_executor` runs its function immediately, in this thread,
    so that the order of results is always the same; another thread (such as anyio's) takes an unknown virtual time,
    because timers do not wait for it. When no task or timer is pending, and no file descriptor or thread has become
    ready for `stuck_after_s` real seconds, the loop raises Deadlock with the names of the waiting tasks.
    """

    jumps = True
    """The embedded bus delivers at exact times."""

    def __init__(self) -> None:
        self._jumping = _JumpingSelector()
        super().__init__(self._jumping)
        self._jumping.waiting = self._who_waits

    @property
    def stuck_after_s(self) -> float:
        """Time without a ready file descriptor or thread that is a Deadlock, in real seconds."""
        return self._jumping.stuck_after_s

    @stuck_after_s.setter
    def stuck_after_s(self, seconds: float) -> None:
        self._jumping.stuck_after_s = seconds

    def time(self) -> Instant:
        """Virtual time, s."""
        return self._jumping.now

    def stall(self, seconds: float) -> None:
        """Advance the clock as if this iteration of the loop had taken this time: timers due meanwhile fire late."""
        self._jumping.now += seconds

    def run_in_executor(
        self, executor: Executor | None, func: Callable[[*_Ts], _T], *args: *_Ts
    ) -> "asyncio.Future[_T]":
        """Call `func(*args)` here and now; the future returned is already done."""
        future: asyncio.Future[_T] = self.create_future()
        try:
            future.set_result(func(*args))
        except Exception as error:
            future.set_exception(error)
        return future

    def _who_waits(self) -> str:
        names = sorted(getattr(task.get_coro(), "__qualname__", "?") for task in asyncio.all_tasks(self))
        return ", ".join(names) or "the loop"


def run(coro: Coroutine[Any, Any, _T]) -> _T:
    """Run `coro` on a JumpingLoop of its own and return its result, as asyncio.run does on a real one.

    Tasks still there at the end are cancelled and awaited. Raises Deadlock, and whatever `coro` raises.
    """
    with asyncio.Runner(loop_factory=JumpingLoop) as runner:
        return runner.run(coro)
