"""Serves the routes of a view on a free port, in a thread."""

import contextlib
import socket
import threading
from collections.abc import Generator

import uvicorn
from starlette.applications import Starlette
from starlette.routing import BaseRoute


class _Server(uvicorn.Server):
    """uvicorn without its signal handlers, which belong to the main thread."""

    @contextlib.contextmanager
    def capture_signals(self) -> Generator[None]:
        yield


@contextlib.contextmanager
def serving(*routes: BaseRoute) -> Generator[int]:
    """The loopback port these routes are served on, while the block runs."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        app = Starlette(routes=routes)
        server = _Server(uvicorn.Config(app, log_level="error", lifespan="off", ws="websockets-sansio"))
        thread = threading.Thread(target=server.run, args=([listening],))
        thread.start()
        try:
            yield int(listening.getsockname()[1])
        finally:
            server.should_exit = True
            thread.join(10)
    assert not thread.is_alive()
