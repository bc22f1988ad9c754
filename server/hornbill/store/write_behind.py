"""Write-behind: one thread uses the database while a server runs, so that the event loop never waits for it."""

import asyncio
import contextlib
import logging
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, Final, TypeVar

from hornbill.errors import StoreFailed

log = logging.getLogger(__name__)

T = TypeVar("T")

MAX_PENDING: Final = 20_000
"""Maximum number of changes that wait while the database fails, of about 1 kB each. Then the oldest are given up."""
RETRY_S: Final = 1.0
"""Interval of attempts while the database fails, s."""

_INSTANT: Final[ContextVar[float | None]] = ContextVar("instant", default=None)


@dataclass(frozen=True, slots=True)
class Pending:
    """A change that is not in the database yet, and when it was made (seconds since 1970 UTC)."""

    at: float
    change: Callable[[], object]
    first_try: "Future[object]"


class Writer:
    """The thread. Changes are written in the order submitted; while the database fails, they wait in memory."""

    def __init__(self, wall: Callable[[], float], on_done: Callable[[Exception | None], None]) -> None:
        """`wall` returns seconds since 1970 UTC. `on_done` is called on the event loop after each attempt to write a
        change, with its exception or None."""
        self._wall = wall
        self._thread = ThreadPoolExecutor(1, "store")
        self._on_done = on_done
        self._pending: deque[Pending] = deque()
        self._retry: asyncio.TimerHandle | None = None
        self.failing_since: float | None = None
        """Since when the database has failed, seconds since 1970 UTC. None if the last attempt succeeded."""
        self._failed = False
        self.lost = 0
        """Changes given up: the database rejected them, or more than `MAX_PENDING` waited."""

    @property
    def pending(self) -> int:
        """Number of changes that wait to be written."""
        return len(self._pending)

    def now(self) -> float:
        """In the thread: the time at which the running call was submitted. Elsewhere: the present time."""
        return self._wall() if (at := _INSTANT.get()) is None else at

    def run(self, call: Callable[[], T]) -> "asyncio.Future[T]":
        """Submit a call and return a future of its result. Earlier changes are written first; StoreFailed if they
        cannot be."""
        at = self._wall()

        def dated() -> T:
            self._write()
            _INSTANT.set(at)
            return call()

        return asyncio.get_running_loop().run_in_executor(self._thread, dated)

    def post(self, change: Callable[[], object]) -> "asyncio.Future[object]":
        """Submit a change without a waiter. If the database fails, it is tried again until it succeeds.

        The future ends with the first attempt, as does `on_done`. A change that the database rejects is given up.
        """
        if len(self._pending) >= MAX_PENDING:
            self._pending.popleft()
            self.lost += 1
        loop = asyncio.get_running_loop()
        first: Future[object] = Future()
        self._pending.append(Pending(self._wall(), change, first))
        posted = asyncio.wrap_future(first)
        posted.add_done_callback(self._done)
        self._submit(loop)
        return posted

    def close(self) -> None:
        """Write all changes if possible, then end the thread."""
        if self._retry is not None:
            self._retry.cancel()
        with contextlib.suppress(RuntimeError):  # closed before
            self._thread.submit(self._attempt)
        self._thread.shutdown(wait=True)
        self.lost += len(self._pending)
        if self._pending:
            log.error("%d changes could not be stored and are lost", len(self._pending))
        self._pending.clear()

    def _submit(self, loop: asyncio.AbstractEventLoop) -> None:
        self._retry = None
        loop.run_in_executor(self._thread, self._attempt).add_done_callback(lambda _: self._again(loop))

    def _again(self, loop: asyncio.AbstractEventLoop) -> None:
        if self._failed and self.failing_since is None:
            self._on_done(None)
        self._failed = self.failing_since is not None
        if self._pending and self._failed and self._retry is None and not loop.is_closed():
            self._retry = loop.call_later(RETRY_S, self._submit, loop)

    def _attempt(self) -> None:
        with contextlib.suppress(StoreFailed):
            self._write()

    def _write(self) -> None:
        """In the thread: write the pending changes. Raises StoreFailed if the database fails."""
        while self._pending:
            one = self._pending[0]
            _INSTANT.set(one.at)
            try:
                result = one.change()
            except StoreFailed as error:
                if error.facts.get("cause") != "store_rejected":
                    self.failing_since = self.failing_since or self._wall()
                    for waiting in tuple(self._pending):
                        _end(waiting.first_try, error)
                    raise
                self._give_up(one, error)
            except Exception as error:
                self._give_up(one, error)
            else:
                self._remove(one)
                self.failing_since = None
                _end(one.first_try, None, result)

    def _give_up(self, one: Pending, error: Exception) -> None:
        """Drop a change that would fail forever and delay all others."""
        self._remove(one)
        self.lost += 1
        _end(one.first_try, error)

    def _remove(self, one: Pending) -> None:
        if self._pending and self._pending[0] is one:  # it may have been dropped for newer ones
            self._pending.popleft()

    def _done(self, posted: "asyncio.Future[object]") -> None:
        error = None if posted.cancelled() else posted.exception()
        if error is not None:
            log.error("Store failed", exc_info=error)
        if error is None or isinstance(error, Exception):
            self._on_done(error)


def _end(future: "Future[object]", error: Exception | None, result: object = None) -> None:
    if future.done():
        return
    if error is not None:
        future.set_exception(error)
    else:
        future.set_result(result)


class WriteBehind:
    """A subject of the store while a server runs. Same interface as `database`, but its methods `changes` do not block.

    With `memory`, the same subject in an in-memory database: reads use it, changes apply to it immediately and are
    written behind to `database`. Without it, reads use `database` and block: see `Store.run`.
    """

    def __init__(self, database: object, memory: object | None, changes: frozenset[str], writer: Writer) -> None:
        self._memory = memory
        self._database = database
        self._changes = changes
        self._writer = writer
        self.posted: asyncio.Future[object] | None = None
        """The last change submitted."""
        self.submitted = 0
        """Number of changes begun and ended, to notice those during a re-read."""

    def __getattr__(self, name: str) -> Any:
        database = getattr(self._database, name)
        memory = None if self._memory is None else getattr(self._memory, name)
        if name in self._changes:
            return ChangeMethod(self, database, memory)
        return database if memory is None else memory

    def post(self, change: Callable[[], object]) -> None:
        """Submit a change without waiting for it."""
        self.submitted += 1
        self.posted = self._writer.post(change)

    def run(self, change: Callable[[], T]) -> "asyncio.Future[T]":
        """Submit a change and return a future of its result."""
        self.submitted += 1
        return self._writer.run(change)


class ChangeMethod:
    """A method that changes data."""

    def __init__(self, subject: WriteBehind, database: Callable[..., Any], memory: Callable[..., Any] | None) -> None:
        self._subject = subject
        self._database = database
        self._memory = memory

    def __call__(self, *args: Any, **options: Any) -> Any:
        """Change memory now and submit the change to the database."""
        result = None if self._memory is None else self._memory(*args, **options)
        self._subject.post(lambda: self._database(*args, **options))
        return result

    async def durable(self, *args: Any, **options: Any) -> Any:
        """Change the database first, then memory. If the database raises, nothing has changed."""

        async def both() -> Any:
            result = await self._subject.run(lambda: self._database(*args, **options))
            self._subject.submitted += 1
            return result if self._memory is None else self._memory(*args, **options)

        return await asyncio.shield(asyncio.create_task(both()))  # a cancelled caller must not leave half a change
