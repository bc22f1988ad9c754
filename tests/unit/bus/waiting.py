"""Waiting and leak checks shared by the tests of ports."""

import asyncio
import os
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager

from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort
from unit.bus.adapter import wait_until

LIMIT_S = 30.0
"""Limit of every wait, so generous that a busy machine does not fail a test."""


async def until(condition: Callable[[], object]) -> None:
    """Return as soon as `condition` is true. Raises TimeoutError after LIMIT_S."""
    async with asyncio.timeout(LIMIT_S):
        while not condition():
            await asyncio.sleep(0.002)


def received_by(port: CanPort) -> list[Frame]:
    """All frames received by `port` from now on."""
    received: list[Frame] = []
    port.listen(received.extend)
    return received


def in_use() -> tuple[int, int]:
    """Number of threads and of open file descriptors."""
    return threading.active_count(), len(os.listdir("/dev/fd"))  # noqa: PTH208


@contextmanager
def no_leaks() -> Generator[None]:
    """Check that afterwards no more threads run and no more file descriptors are open than before."""
    threads, descriptors = in_use()
    yield
    wait_until(lambda: in_use()[0] <= threads and in_use()[1] <= descriptors)
