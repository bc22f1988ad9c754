"""Async tests run in virtual time, or in real time if marked `real_time`."""

import inspect
from contextlib import AbstractAsyncContextManager, AsyncExitStack
from typing import Any, cast

import pytest

import jumping_clock
import real_clock


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Run a coroutine function on an event loop. Arguments that are async context managers are entered first."""
    test = pyfuncitem.obj
    if not inspect.iscoroutinefunction(test):
        return None
    arguments = {name: pyfuncitem.funcargs[name] for name in inspect.signature(test).parameters}

    async def main() -> None:
        async with AsyncExitStack() as stack:
            for name, value in arguments.items():
                if isinstance(value, AbstractAsyncContextManager):
                    arguments[name] = await stack.enter_async_context(cast(AbstractAsyncContextManager[Any], value))
            await test(**arguments)

    run = real_clock.run if pyfuncitem.get_closest_marker("real_time") else jumping_clock.run
    run(main())
    return True
