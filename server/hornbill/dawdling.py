"""Owns how long a connection may take to say what it wants: a request that is never finished is not waited for.

uvicorn times connections that are idle between two requests, and nothing else: one that sends a byte of its head now
and then is kept for ever, and so are thousands. What is answered already (a socket, an event stream, a job that is
waited for) is not touched here.
"""

import asyncio
from dataclasses import dataclass
from typing import Any, Final, Literal

import h11
from uvicorn.protocols.http.flow_control import FlowControl
from uvicorn.protocols.http.h11_impl import H11Protocol

try:
    from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol
except ImportError:  # it is an extra
    HttpToolsProtocol = None

LARGEST_HEAD: Final = 1 << 16
"""Bytes of the largest request line with its headers; h11 has this limit itself, httptools none."""

Part = Literal["head", "body"] | None
"""What of a request is being waited for; None: it is whole, or the connection is nobody's business here any more."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Seconds until the head is whole, from the first byte or the connection on; until the body is, from the head on.

    A body has a second more for every `bytes_per_s` of it that came: a file of 100 MB may take its time, a byte now
    and then may not.
    """

    head_s: float = 20.0
    body_s: float = 20.0
    bytes_per_s: float = 16_384.0


class Watch:
    """Times one connection; it is told what came, and closes it when it is late."""

    def __init__(self, limits: Limits, transport: asyncio.Transport, flow: FlowControl) -> None:
        """From now on it waits for the head of the first request."""
        self._limits = limits
        self._transport = transport
        self._flow = flow
        self._loop = asyncio.get_running_loop()
        self._part: Part = None
        self._until = 0.0
        self._timer: asyncio.TimerHandle | None = None
        self._head = 0
        self._begin("head")

    def came(self, part: Part, size: int) -> bool:
        """`size` bytes came, and now `part` is waited for. Whether the head is no larger than it may be."""
        if part != self._part:
            self.over()
            if part is not None:
                self._begin(part)
            self._head = 0
        if part == "body":
            self._until += size / self._limits.bytes_per_s
        elif part == "head":
            self._head += size
        return self._head <= LARGEST_HEAD

    def answered(self, part: Part) -> None:
        """An answer is over. A body is waited for all the same; between two requests uvicorn has its own time."""
        self.came(part if part == "body" else None, 0)

    def over(self) -> None:
        """Nothing is waited for any more."""
        if self._timer is not None:
            self._timer.cancel()
        self._timer, self._part = None, None

    def _begin(self, part: Part) -> None:
        self._part = part
        self._until = self._loop.time() + (self._limits.head_s if part == "head" else self._limits.body_s)
        self._timer = self._loop.call_at(self._until, self._look)

    def _look(self) -> None:
        now = self._loop.time()
        if self._flow.read_paused:  # it is us who let it wait
            self._until = max(self._until, now + self._limits.body_s)
        if now < self._until:
            self._timer = self._loop.call_at(self._until, self._look)
            return
        self.over()
        self._transport.close()


def protocol(limits: Limits | None = None, *, pure: bool = False) -> type[asyncio.Protocol]:
    """What uvicorn speaks HTTP with: its own choice (httptools, where that is installed), with `limits`.

    `pure`: h11 in any case.
    """
    kept = limits or Limits()
    if HttpToolsProtocol is None or pure:
        return type("Punctual", (_H11,), {"limits": kept})
    return type("Punctual", (_httptools(HttpToolsProtocol),), {"limits": kept})


class _H11(H11Protocol):
    limits: Limits
    _watch: Watch

    def connection_made(self, transport: asyncio.Transport) -> None:  # pyright: ignore[reportIncompatibleMethodOverride] - as uvicorn's own
        super().connection_made(transport)
        self._watch = Watch(self.limits, transport, self.flow)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._watch.came(self._part(), len(data))

    def on_response_complete(self) -> None:
        super().on_response_complete()
        self._watch.answered(self._part())

    def connection_lost(self, exc: Exception | None) -> None:
        self._watch.over()
        super().connection_lost(exc)

    def _part(self) -> Part:
        if self.transport.is_closing() or self.transport.get_protocol() is not self:
            return None
        state = self.conn.their_state
        return "head" if state is h11.IDLE else "body" if state is h11.SEND_BODY else None


def _httptools(base: Any) -> Any:
    """The same for httptools, which tells by callbacks how far it has read."""

    class _HttpTools(base):
        limits: Limits
        _watch: Watch
        _reads: Part = "head"

        def connection_made(self, transport: asyncio.Transport) -> None:
            super().connection_made(transport)
            self._watch = Watch(self.limits, transport, self.flow)

        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            if not self._watch.came(self._part(), len(data)):
                self.send_400_response("The head of the request is too large.")

        def on_headers_complete(self) -> None:
            self._reads = "body"
            super().on_headers_complete()

        def on_message_complete(self) -> None:
            self._reads = "head"
            super().on_message_complete()

        def on_response_complete(self) -> None:
            super().on_response_complete()
            self._watch.answered(self._part())

        def connection_lost(self, exc: Exception | None) -> None:
            self._watch.over()
            super().connection_lost(exc)

        def _part(self) -> Part:
            if self.transport.is_closing() or self.transport.get_protocol() is not self:
                return None
            answering = self.cycle is not None and not self.cycle.response_complete
            return None if self._reads == "head" and answering else self._reads

    return _HttpTools
