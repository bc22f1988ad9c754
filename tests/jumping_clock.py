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
"""What the clock of a new JumpingLoop shows, in seconds: not zero, so that a forgotten clock is noticed."""


class Deadlock(RuntimeError):
    """Every task waits for something that can no longer happen."""


class _JumpingSelector(selectors.DefaultSelector):
    """Polls file descriptors, and moves the clock where a real selector would sleep."""

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
            # A descriptor or another thread is all that could wake us now, and neither knows our clock.
            ready = super().select(self.stuck_after_s)
            if not ready:
                raise Deadlock(
                    f"nothing is ready, no timer is set, no file descriptor stirred for {self.stuck_after_s} s: "
                    f"{self.waiting()} would wait for ever"
                )
        elif timeout > 0:
            # The loop asks for `when - now`; within a factor of two that difference is exact in
            # binary floating point, so the sum is `when` to the last bit.
            self.now += timeout
        return ready


class JumpingLoop(asyncio.SelectorEventLoop):
    """An event loop for tests and protocol benchmarks: an hour on the bus takes as long as its events cost.

    `time()` starts at 1000.0 s and moves only when nothing is ready, straight to the next timer. File
    descriptors are polled, never waited for while a timer is set. `run_in_executor` runs its function
    at once, in this thread, so that results come in the same order every time; a thread started in any
    other way (anyio's, say) takes an unknown time here, as timers do not wait for it. When neither a task nor
    a timer nor, for `stuck_after_s` real seconds, a file descriptor or another thread has anything to do,
    the loop raises Deadlock and names the tasks that wait.
    """

    jumps = True
    """Tells the embedded bus to deliver at exact instants."""

    def __init__(self) -> None:
        self._jumping = _JumpingSelector()
        super().__init__(self._jumping)
        self._jumping.waiting = self._who_waits

    @property
    def stuck_after_s(self) -> float:
        """Real seconds given to file descriptors and threads before a standstill is a Deadlock."""
        return self._jumping.stuck_after_s

    @stuck_after_s.setter
    def stuck_after_s(self, seconds: float) -> None:
        self._jumping.stuck_after_s = seconds

    def time(self) -> Instant:
        """The virtual instant, in seconds."""
        return self._jumping.now

    def stall(self, seconds: float) -> None:
        """Let the clock run on as if this turn of the loop had taken so long: timers that fall due ring late."""
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
