"""Writing behind: one thread uses the database while a server runs, and the event loop waits for none of it."""

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
    """The thread. Calls are made one after the other, in the order in which they were handed over."""

    def __init__(self, wall: Callable[[], float], on_done: Callable[[Exception | None], None]) -> None:
        """`wall` gives seconds since 1970 (UTC); `on_done` is called on the event loop after each call of `post`, with
        what it raised."""
        self._wall = wall
        self._thread = ThreadPoolExecutor(1, "store")
        self._on_done = on_done

    def now(self) -> float:
        """The instant of the call under way in the thread: when it was handed over. Elsewhere, now."""
        return self._wall() if (at := _INSTANT.get()) is None else at

    def run(self, call: Callable[[], T]) -> "asyncio.Future[T]":
        """Hand a call over; the answer has its result."""
        at = self._wall()

        def dated() -> T:
            _INSTANT.set(at)
            return call()

        return asyncio.get_running_loop().run_in_executor(self._thread, dated)

    def post(self, call: Callable[[], object]) -> "asyncio.Future[object]":
        """Hand a call over that nobody waits for. What it raises is logged, and reported to `on_done`."""
        posted = self.run(call)
        posted.add_done_callback(self._done)
        return posted

    def close(self) -> None:
        """Make every call that waits, and end."""
        self._thread.shutdown(wait=True)

    def _done(self, posted: "asyncio.Future[object]") -> None:
        error = None if posted.cancelled() else posted.exception()
        if error is not None:
            log.error("the store failed", exc_info=error)
        if error is None or isinstance(error, Exception):
            self._on_done(error)


class Behind:
    """A subject of the store while a server runs: used as `far` is, whose methods `changes` do not wait for it.

    With `near`, the same subject in a database in memory: that is read, and changed at once, and `far` follows.
    Without, `far` is read, which blocks: see `Store.run`.
    """

    def __init__(self, far: object, near: object | None, changes: frozenset[str], writer: Writer) -> None:
        self._near = near
        self._far = far
        self._changes = changes
        self._writer = writer
        self.posted: asyncio.Future[object] | None = None
        """The last change that follows."""

    def __getattr__(self, name: str) -> Any:
        far, near = getattr(self._far, name), None if self._near is None else getattr(self._near, name)
        if name in self._changes:
            return ChangeMethod(self, far, near)
        return far if near is None else near

    def follow(self, far: Callable[[], object]) -> None:
        """Hand a change over."""
        self.posted = self._writer.post(far)

    def run(self, far: Callable[[], T]) -> "asyncio.Future[T]":
        """Hand a change over that is waited for."""
        return self._writer.run(far)


class ChangeMethod:
    """One method that changes something."""

    def __init__(self, subject: Behind, far: Callable[..., Any], near: Callable[..., Any] | None) -> None:
        self._subject = subject
        self._far = far
        self._near = near

    def __call__(self, *args: Any, **options: Any) -> Any:
        """Change it now; what the database says to it is not waited for."""
        result = None if self._near is None else self._near(*args, **options)
        self._subject.follow(lambda: self._far(*args, **options))
        return result

    async def lasting(self, *args: Any, **options: Any) -> Any:
        """Change it in the database first: what that raises is raised, and nothing has changed then."""

        async def both() -> Any:
            result = await self._subject.run(lambda: self._far(*args, **options))
            return result if self._near is None else self._near(*args, **options)

        return await asyncio.shield(asyncio.create_task(both()))  # who waits no more must not leave half a change
