"""Heartbeat: renewal of a lease in the background.

The only thread of the client. A program that waits for a power supply or an operator cannot renew a lease itself.
With `heartbeat=False` it must, so that the lease ends if the program hangs.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Awaitable, Callable


class AsyncHeartbeat:
    """Calls `renew` every `every_s` in a task, until it returns False or is stopped."""

    def __init__(self, renew: Callable[[], Awaitable[bool]], every_s: float) -> None:
        self._renew = renew
        self.every_s = every_s
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Start."""
        import asyncio  # here, because the synchronous client does not need it

        self._task = asyncio.create_task(self._run())

    async def stop(self) -> None:
        """Stop, and wait for a renewal in progress."""
        import asyncio

        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])

    async def _run(self) -> None:
        import asyncio

        while True:
            await asyncio.sleep(self.every_s)
            if not await self._renew():
                return


class Heartbeat:
    """The same in a daemon thread, which ends with the program."""

    def __init__(self, renew: Callable[[], bool], every_s: float) -> None:
        self._renew = renew
        self.every_s = every_s
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Start."""
        self._thread = threading.Thread(target=self._run, name="hornbill lease", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop, and wait for a renewal in progress."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(self.every_s):
            if not self._renew():
                return
