"""Write-behind: one thread uses the database while a server runs, so that the event loop never waits for it."""

import asyncio
import contextlib
import logging
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor, Future, InvalidStateError
from contextvars import ContextVar
from dataclasses import dataclass
from functools import partial
from queue import SimpleQueue
from threading import Thread
from typing import Any, Final, Generic, TypeVar

from hornbill.errors import StoreFailed
from hornbill.store.database import ABANDONED

log = logging.getLogger(__name__)

T = TypeVar("T")
U = TypeVar("U")

MAX_PENDING: Final = 20_000
"""Maximum number of changes that wait while the database fails, of about 1 kB each. Then the oldest are given up."""
RETRY_S: Final = 1.0
"""Interval of attempts while the database fails, s."""

CLOSE_S: Final = 5.0
"""Time to write the last changes when the server ends, s."""

RESPONSE_S: Final = 2.0
"""Time that the thread may spend on one change or call, s. Then callers get StoreFailed; the thread continues."""

_INSTANT: Final[ContextVar[float | None]] = ContextVar("instant", default=None)


@dataclass(frozen=True, slots=True)
class Pending:
    """A change that is not in the database yet, and when it was made (seconds since 1970 UTC)."""

    at: float
    change: Callable[[], object]
    first_try: "Future[object]"


class Call(Generic[T]):
    """A call with a waiter. Once `abandoned`, it is not made, or its transaction is not committed."""

    def __init__(self, make: Callable[[], T], at: float) -> None:
        """`at`: when it was submitted, seconds since 1970 UTC."""
        self.make = make
        self.at = at
        self.abandoned = False


class DatabaseThread(Executor):
    """One daemon thread: the process can end while a call hangs, unlike with ThreadPoolExecutor."""

    def __init__(self) -> None:
        self._calls: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._thread = Thread(target=self._run, name="store", daemon=True)
        self._thread.start()

    def submit(self, fn: Callable[..., T], /, *args: Any, **options: Any) -> "Future[T]":
        """Make a call after all earlier ones."""
        future: Future[T] = Future()
        self._calls.put(partial(_into, future, partial(fn, *args, **options)))
        return future

    def end(self, timeout_s: float) -> bool:
        """End after the calls submitted. False if they take longer than `timeout_s`. Idempotent."""
        self._calls.put(None)
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (call := self._calls.get()) is not None:
            call()


class Writer:
    """The thread. Changes are written in the order submitted; while the database fails, they wait in memory."""

    def __init__(self, wall: Callable[[], float], on_done: Callable[[Exception | None], None]) -> None:
        """`wall` returns seconds since 1970 UTC. `on_done` is called on the event loop after each attempt to write a
        change, with its exception or None."""
        self._wall = wall
        self._thread = DatabaseThread()
        self._on_done = on_done
        self._pending: deque[Pending] = deque()
        self._retry: asyncio.TimerHandle | None = None
        self.failing_since: float | None = None
        """Since when the database has failed, seconds since 1970 UTC. None if the last attempt succeeded."""
        self._failed = False
        self._logged = False
        self._busy_since: float | None = None
        self.lost = 0
        """Changes given up: the database rejected them, or more than `MAX_PENDING` waited."""

    @property
    def pending(self) -> int:
        """Number of changes that wait to be written."""
        return len(self._pending)

    def now(self) -> float:
        """In the thread: the time at which the running call was submitted. Elsewhere: the present time."""
        return self._wall() if (at := _INSTANT.get()) is None else at

    async def run(self, call: Callable[[], T], then: Callable[[T], U]) -> U:
        """Make a call in the thread, `then` process its result on the event loop. Earlier changes are written first.

        Raises StoreFailed if they cannot be, or if the database does not respond for `RESPONSE_S`; then the call has
        changed nothing. Only if the database stops responding during a commit, the outcome is known later; then `then`
        is called once it was committed.
        """
        one = Call(call, self._wall())
        made = asyncio.get_running_loop().run_in_executor(self._thread, self._make, one)

        async def whole() -> U:
            return then(await made)

        task = asyncio.create_task(whole())  # of its own: a cancelled caller must not leave half a change
        while not task.done():
            left_s = RESPONSE_S - self._stuck_s()
            if left_s <= 0:
                one.abandoned = True
                task.add_done_callback(lambda ended: None if ended.cancelled() else ended.exception())
                raise StoreFailed(
                    f"The database has not responded for {RESPONSE_S:.0f} s. Check it, then try again.",
                    cause="store_timeout", retry=True,
                )  # fmt: skip
            await asyncio.wait([task], timeout=left_s)
        return task.result()

    def post(self, change: Callable[[], object]) -> "asyncio.Future[object]":
        """Submit a change without a waiter. If the database fails, it is tried again until it succeeds.

        The future ends with the first attempt, as does `on_done`. A change that the database rejects is given up.
        """
        if len(self._pending) >= MAX_PENDING:
            oldest = self._pending.popleft()
            self.lost += 1
            text = f"More than {MAX_PENDING} changes wait for the database. The oldest is lost."
            _end(oldest.first_try, StoreFailed(text, cause="store_timeout", retry=False))
        loop = asyncio.get_running_loop()
        first: Future[object] = Future()
        self._pending.append(Pending(self._wall(), change, first))
        posted = asyncio.wrap_future(first)
        posted.add_done_callback(self._done)
        self._submit(loop)
        return posted

    def close(self, last: Callable[[], object]) -> None:
        """Write all changes if possible, make the call `last`, then end the thread. Takes at most `CLOSE_S`."""
        if self._retry is not None:
            self._retry.cancel()
        self._thread.submit(self._attempt)
        self._thread.submit(last)
        ended = self._thread.end(CLOSE_S)
        self.lost += len(self._pending)
        if self._pending:
            why = "" if ended else f", because the database has not responded for {CLOSE_S:.0f} s"
            log.error("%d changes could not be stored and are lost%s", len(self._pending), why)
        self._pending.clear()

    def _stuck_s(self) -> float:
        """Time that the thread has worked on the present change or call, s. 0 if idle."""
        since = self._busy_since
        return 0.0 if since is None else time.monotonic() - since

    def _make(self, one: Call[T]) -> T:
        """In the thread: make a call after all earlier changes."""
        if not one.abandoned:
            self._write()
        if one.abandoned:
            raise StoreFailed("The caller has stopped waiting for this call.", cause="store_timeout", retry=True)
        before = ABANDONED.set(lambda: one.abandoned)
        try:
            return self._timed(one.make, one.at)
        finally:
            ABANDONED.reset(before)

    def _timed(self, change: Callable[[], T], at: float) -> T:
        _INSTANT.set(at)
        self._busy_since = time.monotonic()
        try:
            return change()
        finally:
            self._busy_since = None

    def _submit(self, loop: asyncio.AbstractEventLoop) -> None:
        if self._retry is not None:
            self._retry.cancel()
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
            try:
                result = self._timed(one.change, one.at)
            except StoreFailed as error:
                if error.facts.get("cause") != "store_rejected":
                    self.failing_since = self.failing_since or self._wall()
                    for waiting in reversed(tuple(self._pending)):
                        if waiting.first_try.done():
                            break
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
        if error is not None and not (self._logged and self.failing_since is not None):  # once while it fails
            log.error("Store failed", exc_info=error)
        self._logged = error is not None
        if error is None or isinstance(error, Exception):
            self._on_done(error)


def _into(future: "Future[T]", call: Callable[[], T]) -> None:
    """Make a call, and give its result or exception to a future unless that was cancelled."""
    if not future.set_running_or_notify_cancel():
        return
    try:
        result = call()
    except BaseException as error:
        future.set_exception(error)
    else:
        future.set_result(result)


def _end(future: "Future[object]", error: Exception | None, result: object = None) -> None:
    with contextlib.suppress(InvalidStateError):  # it has ended
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

    async def run(self, change: Callable[[], T], then: Callable[[T], U]) -> U:
        """Make a change in the database, `then` in memory. See `Writer.run`."""
        self.submitted += 1

        def both(result: T) -> U:
            self.submitted += 1
            return then(result)

        return await self._writer.run(change, both)


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

        def in_memory(result: Any) -> Any:
            return result if self._memory is None else self._memory(*args, **options)

        return await self._subject.run(lambda: self._database(*args, **options), in_memory)
