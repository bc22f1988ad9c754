"""Long computations outside the event loop, so that Stop keeps its 10 ms."""

import asyncio
import os
import sys
from collections.abc import Awaitable, Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import cache
from multiprocessing import get_context
from typing import Any, TypeAlias

Compute: TypeAlias = Callable[..., Awaitable[Any]]
"""Calls a function of a module with arguments and returns its result. Both must be picklable."""


async def inline(function: Callable[..., Any], *arguments: object) -> Any:
    """Call it at once. The event loop waits, so this is for tests and benchmarks."""
    return function(*arguments)


@cache
def _worker() -> ProcessPoolExecutor:
    """One process, started by the first computation: its imports take a second."""
    return ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_yield_priority)


def _yield_priority() -> None:
    """Let the server, from which this process has its priority, go first."""
    if sys.platform != "win32":
        os.nice(10)


async def in_a_process(function: Callable[..., Any], *arguments: object) -> Any:
    """Call it in another process. A cancelled caller does not wait for the computation, which takes a few seconds."""
    try:
        return await asyncio.get_running_loop().run_in_executor(_worker(), function, *arguments)
    except BrokenProcessPool:
        _worker.cache_clear()  # for example killed for lack of memory
        raise
