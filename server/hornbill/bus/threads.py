"""Calls into drivers that may hang, each in a thread of its own that nobody has to wait for."""

import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import ParamSpec, TypeVar

_P = ParamSpec("_P")
_T = TypeVar("_T")


class OwnThread(Executor):
    """Runs each call in a thread of its own that nobody joins: a driver that hangs must not keep us from ending."""

    def __init__(self, name: str) -> None:
        """`name` is what its threads are called."""
        self._name = name

    def submit(self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        """Call `fn` in a new thread."""
        future: Future[_T] = Future()
        future.set_running_or_notify_cancel()

        def work() -> None:
            try:
                future.set_result(fn(*args, **kwargs))
            except Exception as error:
                future.set_exception(error)

        threading.Thread(target=work, name=self._name, daemon=True).start()
        return future
