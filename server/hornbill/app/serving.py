"""Serving: the listening socket, the announced address, and a shutdown that turns torque off first."""

import asyncio
import contextlib
import errno
import gc
import logging
import math
import os
import signal
import socket
import sys
import time
from collections.abc import Callable
from contextlib import AsyncExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal, cast

import uvicorn
from fastapi import FastAPI
from starlette.types import ASGIApp
from uvicorn.protocols.http.auto import AutoHTTPProtocol

from hornbill.api.live.event_stream import end_streams
from hornbill.app.request_timeouts import RequestLimits, RequestTimeouts, TimedConnection
from hornbill.errors import CannotStart
from hornbill.virtual_time import MAX_SPEED, VirtualLoop

SWITCH_S = 0.0005
"""Thread switch interval. Python's default of 5 ms would delay the event loop, including a stop, whenever the thread of
an adapter processes a burst of frames."""

NICENESS: Final = -10
"""Scheduling priority if the system allows it, as usual for programs that control machines: with other programs on all
cores, a stop would otherwise wait for them."""

REPEAT_S = 10.0
"""Minimum interval between log lines about malformed requests."""

LIMITS: Final = RequestLimits()

KEEP_ALIVE_S: Final = 75.0
"""Idle time after which a connection is closed. Clients (httpx: 5 s) and proxies (nginx: 60 s) close earlier, so none
sends a request on a connection that is being closed."""
PING_S: Final = 20.0
"""Interval between pings of a WebSocket, and their timeout."""

ADDRESS_USE: int = getattr(socket, "SO_EXCLUSIVEADDRUSE", socket.SO_REUSEADDR)
"""SO_REUSEADDR allows the port to be reused immediately. On Windows it would let another program listen on it, too."""


_LISTENING: Final = {
    errno.EADDRINUSE: ("Another program, or another hornbill, uses it. Choose another port with --port.", True),
    errno.EACCES: ("Ports below 1024 need administrator rights. Choose another port with --port.", False),
    errno.EADDRNOTAVAIL: ("This computer does not have the address. Choose another with --host.", True),
}
"""Remedy by error, and whether a later attempt may succeed: the network may not be up yet."""


def listen(host: str, port: int) -> socket.socket:
    """Socket that listens on `host` and `port` (0: any free one). Raises CannotStart with the remedy."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # With IPPROTO_TCP asyncio disables Nagle's algorithm, which would delay many responses by 40 ms.
    made = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    made.setsockopt(socket.SOL_SOCKET, ADDRESS_USE, 1)
    try:
        made.bind((host, port))
        made.listen(128)
    except OSError as error:
        made.close()
        remedy, retry = _LISTENING.get(
            error.errno or 0, ("Choose another address with --host, or port with --port.", False)
        )
        raise CannotStart(
            f"Cannot listen on port {port} of {host}: {error.strerror}. {remedy}", cause=None, part="port", retry=retry
        ) from None
    return made


def url_of(listening: socket.socket, scheme: str, everywhere: str | None = None) -> str:
    """Address of the page. `everywhere`: host to show if the socket listens on all addresses."""
    host, port = listening.getsockname()[:2]
    if everywhere is not None and host in ("0.0.0.0", "::"):
        host = everywhere
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}/"


async def serve(app: FastAPI, listening: socket.socket, announce: str, tls: tuple[Path, Path] | None = None) -> None:
    """Serve until interrupted. `announce` is printed once the server is ready, with the address in place of {url}.

    `tls`: certificate chain and key, PEM. Raises CannotStart if they are invalid, and the errors of the application's
    start.
    """
    config = configured(app, tls, scale=_scale())
    check_certificate(config)
    logging.getLogger("uvicorn.error").addFilter(RateLimit())
    sys.setswitchinterval(SWITCH_S)
    raise_priority()
    server = _Server(config, app)
    _stop_on_signal(app)
    running = asyncio.create_task(server.serve(sockets=[listening]))
    while not server.started and not running.done():  # noqa: ASYNC110 - uvicorn has no event to wait for
        await asyncio.sleep(0.01)
    if server.started:
        # Exclude imported objects from garbage collection: scanning them would delay frames by up to 0.1 s.
        gc.freeze()
        gc.enable()
        url = url_of(listening, "https" if tls else "http")
        print(announce.format(url=url), flush=True)  # noqa: T201 - the one line a user waits for
    await running


def raise_priority() -> None:
    """Give this thread, and those it will start, the priority NICENESS; no effect without the right to do so."""
    if sys.platform != "win32":
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, 0, min(NICENESS, os.getpriority(os.PRIO_PROCESS, 0)))


def check_certificate(config: uvicorn.Config) -> None:
    """Load the configuration with its certificate and key. Raises CannotStart if they are invalid."""
    try:
        config.load()
    except OSError as error:  # of ssl, too
        raise CannotStart(
            f"Invalid TLS certificate or key: {error}. Use a matching pair of PEM files.", cause=None,
            part="certificate", retry=False,
        ) from None  # fmt: skip


def configured(
    app: ASGIApp,
    tls: tuple[Path, Path] | None = None,
    limits: RequestLimits = LIMITS,
    http: Callable[..., Any] = AutoHTTPProtocol,
    scale: float = 1.0,
) -> uvicorn.Config:
    """Configuration of uvicorn for `app`. `http`: HTTP protocol; default httptools if installed, else h11.

    `scale`: factor for all times that a client must keep. Clients run in real time, also if the loop does not.
    """
    limits = replace(limits, head_s=limits.head_s * scale, body_s=limits.body_s * scale)
    timed = cast("type[asyncio.Protocol]", partial(TimedConnection, http, limits))
    return uvicorn.Config(
        RequestTimeouts(app, limits), log_level="warning", access_log=False, http=timed, ws="websockets-sansio",
        timeout_graceful_shutdown=2, ws_max_size=1 << 20, ws_per_message_deflate=False, lifespan="off",
        server_header=False, proxy_headers=False,  # evaluated by the guard
        timeout_keep_alive=round(KEEP_ALIVE_S * scale), ws_ping_interval=PING_S * scale, ws_ping_timeout=PING_S * scale,
        ssl_certfile=tls and str(tls[0]), ssl_keyfile=tls and str(tls[1]),
    )  # fmt: skip


def loop_of(speed: float | Literal["max"] | None) -> asyncio.AbstractEventLoop:
    """New event loop: in virtual time with a `speed`, otherwise in real time."""
    if speed is None:
        return asyncio.new_event_loop()
    return VirtualLoop(math.inf if speed == "max" else speed)


def _scale() -> float:
    """Factor of the times of clients on this loop. The speed of a virtual loop can be changed while it runs."""
    return MAX_SPEED if isinstance(asyncio.get_running_loop(), VirtualLoop) else 1.0


class _Server(uvicorn.Server):
    """uvicorn server that runs the lifespan of the application itself, and ends event streams at shutdown.

    With uvicorn's lifespan, an error at start would be a traceback and the exit code 3; here it is raised. Without the
    end of event streams, the shutdown would wait for them, with torque on.
    """

    def __init__(self, config: uvicorn.Config, app: FastAPI) -> None:
        """`app`: the application."""
        super().__init__(config)
        self._app = app
        self._lifespan = AsyncExitStack()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start the application, then listen. Raises the errors of the application's start."""
        async with AsyncExitStack() as stack:
            await stack.enter_async_context(self._app.router.lifespan_context(self._app))
            await super().startup(sockets)
            self._lifespan = stack.pop_all()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End event streams, connections and the application."""
        end_streams(self._app.state)
        async with self._lifespan:
            await super().shutdown(sockets)


class RateLimit:
    """Filter of uvicorn's log: malformed requests must not fill the disk."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        """`now`: clock, s."""
        self._now = now
        self._next = float("-inf")
        self._omitted = 0

    def __call__(self, record: logging.LogRecord) -> bool:
        """Whether to write a line: for malformed requests one per `REPEAT_S`, with the number of omitted ones."""
        text = record.getMessage()
        if text != "Invalid HTTP request received.":
            # uvicorn logs an error if a socket is refused with an HTTP response, although it sends the response.
            return text != "ASGI callable returned without completing handshake."
        if self._now() < self._next:
            self._omitted += 1
            return False
        if self._omitted:
            record.msg = f"{text} {self._omitted} more since the last message."
        self._next, self._omitted = self._now() + REPEAT_S, 0
        return True


def _stop_on_signal(app: FastAPI) -> None:
    """Stop all servos on SIGUSR1 (`kill -USR1 PID`), where signals are available."""
    if sys.platform == "win32":
        return
    loop = asyncio.get_running_loop()

    def press() -> None:
        if not hasattr(app.state, "host"):  # still starting
            loop.call_later(0.01, press)
            return
        app.state.host.stop.now("off", "signal SIGUSR1", "")

    loop.add_signal_handler(signal.SIGUSR1, press)
