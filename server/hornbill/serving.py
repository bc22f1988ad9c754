"""Owns running the server: the listening socket, the address it prints, and a shutdown that lets torque go first."""

import asyncio
import gc
import signal
import socket
import sys

import uvicorn
from fastapi import FastAPI

from hornbill.errors import HornbillError


class CannotListen(HornbillError):
    """The address cannot be listened on."""

    code = "internal"
    title = "Cannot listen"


def listen(host: str, port: int) -> socket.socket:
    """A socket that listens on `host` and `port` (0: any free one). Raises CannotListen with the remedy."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    made = socket.socket(family)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        made.bind((host, port))
        made.listen(128)
    except OSError as error:
        made.close()
        raise CannotListen(
            f"Port {port} on {host} cannot be used: {error.strerror}. Choose another with --port."
        ) from None
    return made


async def serve(app: FastAPI, listening: socket.socket, announce: str) -> None:
    """Serve until interrupted; `announce` is printed once requests are answered, with the address in place of {url}."""
    config = uvicorn.Config(
        app, log_level="warning", access_log=False, ws="websockets-sansio", timeout_graceful_shutdown=2,
        ws_max_size=1 << 20, ws_per_message_deflate=False, lifespan="on",
    )  # fmt: skip
    server = uvicorn.Server(config)
    _stop_on_signal(app)
    running = asyncio.create_task(server.serve(sockets=[listening]))
    while not server.started and not running.done():  # noqa: ASYNC110 - uvicorn has no event to wait for
        await asyncio.sleep(0.01)
    if server.started:
        gc.collect()
        gc.freeze()  # looking through all that was imported would now and then hold up frames for a tenth of a second
        host, port = listening.getsockname()[:2]
        shown = f"[{host}]" if ":" in host else host
        print(announce.format(url=f"http://{shown}:{port}/"), flush=True)  # noqa: T201 - the one line a user waits for
    await running


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
