"""Request timeouts: a connection that does not finish its request is closed.

uvicorn limits only the time between two requests. Responses, event streams and WebSockets are not limited here.
"""

import asyncio
from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, Final

from starlette.types import ASGIApp, Message, Receive, Scope, Send

LARGEST_HEAD: Final = 1 << 16
"""Limit of the request line with its headers, bytes. h11 has the same limit, httptools none."""


@dataclass(frozen=True, slots=True)
class RequestLimits:
    """`head_s`: until the head is complete, s. `body_s`: for the body, s, and 1 s for every `bytes_per_s` received."""

    head_s: float = 20.0
    body_s: float = 20.0
    bytes_per_s: float = 16_384.0


class TimedConnection(asyncio.Protocol):
    """An HTTP protocol of uvicorn with a timeout for heads. `RequestTimeouts` reports when a head is complete."""

    def __init__(self, http: Callable[..., Any], limits: RequestLimits, **given: Any) -> None:
        """`http`: factory of the protocol; `given`: its arguments from uvicorn."""
        self._http = http(**given)
        self._limits = limits
        self._running = 0
        self._head = 0
        self._timer: asyncio.TimerHandle | None = None
        self.pause_writing = self._http.pause_writing
        self.resume_writing = self._http.resume_writing
        self.eof_received = self._http.eof_received

    def connection_made(self, transport: asyncio.Transport) -> None:  # pyright: ignore[reportIncompatibleMethodOverride] - as uvicorn's own
        """Start the timeout of the first head."""
        self._transport = transport
        self._wait()
        self._http.connection_made(transport)

    def data_received(self, data: bytes) -> None:
        """Forward received data. The application runs in this context once the head is complete."""
        if not self._running:
            if self._head > LARGEST_HEAD:
                self._transport.write(b"HTTP/1.1 400 Bad Request\r\ncontent-length: 0\r\nconnection: close\r\n\r\n")
                self.close()
                return
            self._head += len(data)
            self._wait()
        _connection.set(self)
        self._http.data_received(data)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the timeout."""
        self._stop()
        self._http.connection_lost(exc)

    def request_begun(self) -> None:
        """The head is complete."""
        self._running += 1
        self._head = 0
        self._stop()

    def request_ended(self) -> None:
        """The response is complete; the rest of the body or the next head follows."""
        self._running -= 1

    def close(self) -> None:
        """Close the connection."""
        self._stop()
        self._transport.close()

    def _wait(self) -> None:
        if self._timer is None:
            self._timer = asyncio.get_running_loop().call_later(self._limits.head_s, self.close)

    def _stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = None


_connection: ContextVar[TimedConnection] = ContextVar("connection")


class RequestTimeouts:
    """ASGI middleware: closes the connection of a request whose body does not arrive in time."""

    def __init__(self, app: ASGIApp, limits: RequestLimits) -> None:
        """Must be outermost, so that no other middleware waits for a body."""
        self._app = app
        self._limits = limits

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run the application."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        connection = _connection.get()
        connection.request_begun()
        try:
            await self._app(scope, self._timed(receive, connection) if scope["type"] == "http" else receive, send)
        finally:
            connection.request_ended()

    def _timed(self, receive: Receive, connection: TimedConnection) -> Receive:
        now, left, more = asyncio.get_running_loop().time, self._limits.body_s, True

        async def timed() -> Message:
            nonlocal left, more
            if not more:
                return await receive()
            began = now()
            try:
                async with asyncio.timeout(left):
                    message = await receive()
            except TimeoutError:
                connection.close()
                return {"type": "http.disconnect"}
            left += len(message.get("body", b"")) / self._limits.bytes_per_s - (now() - began)
            more = message.get("more_body", False)
            return message

        return timed
