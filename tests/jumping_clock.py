"""A virtual loop for tests: as fast as possible, without threads, and with detection of deadlocks."""

import asyncio
import math
import selectors
from collections.abc import Callable, Coroutine
from concurrent.futures import Executor
from typing import Any, TypeVar, TypeVarTuple

from hornbill.virtual_time import START, VirtualLoop, VirtualSelector

__all__ = ["START", "Deadlock", "JumpingLoop", "run", "stall"]

_T = TypeVar("_T")
_Ts = TypeVarTuple("_Ts")


class Deadlock(RuntimeError):
    """All tasks wait for events that can no longer occur."""


class _JumpingSelector(VirtualSelector):
    """Raises Deadlock instead of waiting forever."""

    def __init__(self) -> None:
        super().__init__(math.inf)
        self.stuck_after_s = 1.0
        self.waiting: Callable[[], str] = str

    def idle(self) -> list[tuple[selectors.SelectorKey, int]]:
        """Only a file descriptor or another thread can wake the loop now; neither uses this clock."""
        ready = selectors.DefaultSelector.select(self, self.stuck_after_s)
        if not ready:
            raise Deadlock(
                f"nothing is ready, no timer is set, no file descriptor was ready for {self.stuck_after_s} s: "
                f"{self.waiting()} would wait forever"
            )
        return ready


class JumpingLoop(VirtualLoop):
    """An event loop for tests and protocol benchmarks: an hour on the bus takes the processing time of its events.

    `run_in_executor` runs its function immediately, in this thread, so that the order of results is always the same;
    another thread (such as anyio's) takes an unknown virtual time, because timers do not wait for it. When no task or
    timer is pending, and no file descriptor or thread has become ready for `stuck_after_s` real seconds, the loop
    raises Deadlock with the names of the waiting tasks.
    """

    def __init__(self) -> None:
        self._jumping = _JumpingSelector()
        super().__init__(selector=self._jumping)
        self._jumping.waiting = self._who_waits

    @property
    def stuck_after_s(self) -> float:
        """Time without a ready file descriptor or thread that is a Deadlock, in real seconds."""
        return self._jumping.stuck_after_s

    @stuck_after_s.setter
    def stuck_after_s(self, seconds: float) -> None:
        self._jumping.stuck_after_s = seconds

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


def stall(seconds: float) -> None:
    """Stall the running JumpingLoop."""
    loop = asyncio.get_running_loop()
    assert isinstance(loop, JumpingLoop)
    loop.stall(seconds)


def run(coro: Coroutine[Any, Any, _T]) -> _T:
    """Run `coro` on a JumpingLoop of its own and return its result, as asyncio.run does on a real one.

    Tasks still there at the end are cancelled and awaited. Raises Deadlock, and whatever `coro` raises.
    """
    with asyncio.Runner(loop_factory=JumpingLoop) as runner:
        return runner.run(coro)
