"""A lease's signs of life while a program does something else.

The one thread of the client is here. A program that waits for a power supply, or for a person, cannot renew a lease
between two of its own lines; whoever would rather have the lease end when the program hangs takes it with
`beat=False` and renews it by hand.
"""

import asyncio
import threading
from collections.abc import Awaitable, Callable


class AsyncBeat:
    """Calls `renew` every so many seconds in a task, until it answers False or is stopped."""

    def __init__(self, renew: Callable[[], Awaitable[bool]], every_s: float) -> None:
        self._renew = renew
        self._every_s = every_s
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin."""
        self._task = asyncio.create_task(self._run())

    async def stop(self) -> None:
        """End, and wait for a renewal that is under way."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])

    async def _run(self) -> None:
        while True:
            await asyncio.sleep(self._every_s)
            if not await self._renew():
                return


class Beat:
    """The same in a thread; it dies with the program, and with it the lease."""

    def __init__(self, renew: Callable[[], bool], every_s: float) -> None:
        self._renew = renew
        self._every_s = every_s
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin."""
        self._thread = threading.Thread(target=self._run, name="hornbill lease", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End, and wait for a renewal that is under way."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(self._every_s):
            if not self._renew():
                return
