"""An event loop on the real clock for tests."""

import asyncio
import gc
from collections.abc import Coroutine
from typing import Any, TypeVar

_T = TypeVar("_T")


def run(main: Coroutine[Any, Any, _T]) -> _T:
    """Run `main` as `asyncio.run` does, without garbage collection.

    In a process with all tests a collection can stop the loop, with hornbill and its simulated servos, for a second.
    A server avoids this by `gc.freeze`.
    """
    gc.disable()
    try:
        return asyncio.run(main)
    finally:
        gc.enable()
