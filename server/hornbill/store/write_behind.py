"""Write-behind: one thread uses the database while a server runs, so that the event loop never waits for it."""

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import ContextVar
from typing import Any, Final, TypeVar

log = logging.getLogger(__name__)

T = TypeVar("T")

_INSTANT: Final[ContextVar[float | None]] = ContextVar("instant", default=None)


class Writer:
    """The thread. Calls are executed one after the other, in the order submitted."""

    def __init__(self, wall: Callable[[], float], on_done: Callable[[Exception | None], None]) -> None:
        """`wall` returns seconds since 1970 UTC. `on_done` is called on the event loop after each call of `post`, with
        its exception or None."""
        self._wall = wall
        self._thread = ThreadPoolExecutor(1, "store")
        self._on_done = on_done
        self.pending = 0
        """Number of calls of `post` that have not ended."""

    def now(self) -> float:
        """In the thread: the time at which the running call was submitted. Elsewhere: the present time."""
        return self._wall() if (at := _INSTANT.get()) is None else at

    def run(self, call: Callable[[], T]) -> "asyncio.Future[T]":
        """Submit a call and return a future of its result."""
        at = self._wall()

        def dated() -> T:
            _INSTANT.set(at)
            return call()

        return asyncio.get_running_loop().run_in_executor(self._thread, dated)

    def post(self, call: Callable[[], object]) -> "asyncio.Future[object]":
        """Submit a call without a waiter. Its exception is logged and reported to `on_done`."""
        posted = self.run(call)
        self.pending += 1
        posted.add_done_callback(self._done)
        return posted

    def close(self) -> None:
        """Execute all pending calls, then end the thread."""
        self._thread.shutdown(wait=True)

    def _done(self, posted: "asyncio.Future[object]") -> None:
        self.pending -= 1
        error = None if posted.cancelled() else posted.exception()
        if error is not None:
            log.error("Store failed", exc_info=error)
        if error is None or isinstance(error, Exception):
            self._on_done(error)


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

    def __getattr__(self, name: str) -> Any:
        database = getattr(self._database, name)
        memory = None if self._memory is None else getattr(self._memory, name)
        if name in self._changes:
            return ChangeMethod(self, database, memory)
        return database if memory is None else memory

    def post(self, change: Callable[[], object]) -> None:
        """Submit a change without waiting for it."""
        self.posted = self._writer.post(change)

    def run(self, change: Callable[[], T]) -> "asyncio.Future[T]":
        """Submit a change and return a future of its result."""
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
            return result if self._memory is None else self._memory(*args, **options)

        return await asyncio.shield(asyncio.create_task(both()))  # a cancelled caller must not leave half a change
