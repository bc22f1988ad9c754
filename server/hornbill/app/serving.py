"""Run the server: the listening socket, the address it prints, and a shutdown that lets torque go first."""

import asyncio
import gc
import logging
import signal
import socket
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final, cast

import uvicorn
from fastapi import FastAPI
from starlette.types import ASGIApp
from uvicorn.protocols.http.auto import AutoHTTPProtocol

from hornbill.api.live.event_stream import end_streams
from hornbill.app.request_timeouts import RequestLimits, RequestTimeouts, TimedConnection
from hornbill.errors import HornbillError

SWITCH_S = 0.0005
"""How long a thread may keep the interpreter while the loop waits for it. Python's own 5 ms would be added to whatever
the loop does next, a stop too, as often as the thread of an adapter has a burst of frames in hand."""

SPARING_S = 10.0
"""How often at most the log says that a request was no HTTP."""

LIMITS: Final = RequestLimits()

ADDRESS_USE: int = getattr(socket, "SO_EXCLUSIVEADDRUSE", socket.SO_REUSEADDR)
"""SO_REUSEADDR lets a port be listened on again at once. On Windows it would let another program listen on it, too."""


class CannotListen(HornbillError):
    """The address cannot be listened on."""

    code = "internal"
    title = "Cannot listen"


def listen(host: str, port: int) -> socket.socket:
    """A socket that listens on `host` and `port` (0: any free one). Raises CannotListen with the remedy."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # Named as TCP: of any other asyncio would not switch Nagle's delay off, and many an answer would be 40 ms late.
    made = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    made.setsockopt(socket.SOL_SOCKET, ADDRESS_USE, 1)
    try:
        made.bind((host, port))
        made.listen(128)
    except OSError as error:
        made.close()
        raise CannotListen(
            f"Port {port} on {host} cannot be used: {error.strerror}. Choose another with --port.", cause=None
        ) from None
    return made


async def serve(app: FastAPI, listening: socket.socket, announce: str, tls: tuple[Path, Path] | None = None) -> None:
    """Serve until interrupted; `announce` is printed once requests are answered, with the address in place of {url}.

    `tls`: certificate chain and key, PEM. Raises CannotListen when they cannot be used.
    """
    config = configured(app, tls)
    try:
        config.load()
    except OSError as error:  # of ssl, too
        listening.close()
        raise CannotListen(
            f"The certificate and its key cannot be used: {error}. Give a matching pair.", cause=None
        ) from None
    logging.getLogger("uvicorn.error").addFilter(Sparing())
    sys.setswitchinterval(SWITCH_S)
    server = _Server(config, app)
    _stop_on_signal(app)
    running = asyncio.create_task(server.serve(sockets=[listening]))
    while not server.started and not running.done():  # noqa: ASYNC110 - uvicorn has no event to wait for
        await asyncio.sleep(0.01)
    if server.started:
        # Looking through all that was imported would now and then hold up frames for a tenth of a second, and now the
        # first request: hardly any of it is garbage.
        gc.freeze()
        gc.enable()
        host, port = listening.getsockname()[:2]
        shown = f"[{host}]" if ":" in host else host
        print(announce.format(url=f"{'https' if tls else 'http'}://{shown}:{port}/"), flush=True)  # noqa: T201 - the one line a user waits for
    await running


def configured(
    app: ASGIApp,
    tls: tuple[Path, Path] | None = None,
    limits: RequestLimits = LIMITS,
    http: Callable[..., Any] = AutoHTTPProtocol,
) -> uvicorn.Config:
    """How uvicorn serves `app`. `http`: its HTTP protocol; by default httptools where it is installed, else h11."""
    timed = cast("type[asyncio.Protocol]", partial(TimedConnection, http, limits))
    return uvicorn.Config(
        RequestTimeouts(app, limits), log_level="warning", access_log=False, http=timed, ws="websockets-sansio",
        timeout_graceful_shutdown=2, ws_max_size=1 << 20, ws_per_message_deflate=False, lifespan="on",
        server_header=False, proxy_headers=False,  # the guard reads them, where there is a proxy to believe
        ssl_certfile=tls and str(tls[0]), ssl_keyfile=tls and str(tls[1]),
    )  # fmt: skip


class _Server(uvicorn.Server):
    """Ends the event streams when it ends, as it does sockets: else it would wait for them, with torque on."""

    def __init__(self, config: uvicorn.Config, app: FastAPI) -> None:
        """`app`: the application with the event streams."""
        super().__init__(config)
        self._app = app

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Let go of everybody, then of the application."""
        end_streams(self._app.state)
        await super().shutdown(sockets)


class Sparing:
    """A filter of uvicorn's log: whoever sends it garbage must not fill the disk with what is said of it."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        """`now` gives seconds."""
        self._now = now
        self._next = float("-inf")
        self._left_out = 0

    def __call__(self, record: logging.LogRecord) -> bool:
        """Whether a line is written. Of malformed requests one is in `SPARING_S`, with the number of the others."""
        text = record.getMessage()
        if text != "Invalid HTTP request received.":
            # It calls it an error when a socket is refused by an answer with a status, though it sends that answer.
            return text != "ASGI callable returned without completing handshake."
        if self._now() < self._next:
            self._left_out += 1
            return False
        if self._left_out:
            record.msg = f"{text} {self._left_out} more were since this was last said."
        self._next, self._left_out = self._now() + SPARING_S, 0
        return True


def _stop_on_signal(app: FastAPI) -> None:
    """SIGUSR1 stops every servo, where there are such signals: `kill -USR1 PID` works when no page does."""
    if sys.platform == "win32":
        return
    loop = asyncio.get_running_loop()

    def press() -> None:
        if not hasattr(app.state, "host"):  # it is being put together
            loop.call_later(0.01, press)
            return
        app.state.host.stop.now("off", "signal SIGUSR1", "")

    loop.add_signal_handler(signal.SIGUSR1, press)
