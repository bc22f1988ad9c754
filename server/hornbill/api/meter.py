"""Request durations and open sockets by route. Outside the guard, so that refused requests count."""

from collections import Counter
from time import perf_counter
from typing import Final

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from hornbill.api.security.roles import ROW, RouteRole
from hornbill.servo.runtime.histogram import Histogram

BOUNDS_S: Final = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0, 60.0)

_METHODS: Final = frozenset(("GET", "HEAD", "OPTIONS", "POST", "PUT", "PATCH", "DELETE"))
_GONE: Final = 499
"""Status counted if the client disconnected before the response."""


class Measures:
    """Counters of one application. Bounded: keys are path templates, not request paths."""

    def __init__(self) -> None:
        self.requests: dict[tuple[str, str, int], Histogram] = {}
        """By method, route and status."""
        self.in_progress = 0
        self.sockets: Counter[str] = Counter()
        """Open WebSockets by route."""

    def took(self, method: str, route: str, status: int, took_s: float) -> None:
        """Count a completed request."""
        spread = self.requests.get((method, route, status))
        if spread is None:
            spread = self.requests[method, route, status] = Histogram(BOUNDS_S)
        spread.add(took_s)


class Meter:
    """Outermost ASGI middleware: counts requests, including those that the guard refuses."""

    def __init__(self, app: ASGIApp, measures: Measures) -> None:
        self._app = app
        self._measures = measures

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward the request and record its outcome."""
        if scope["type"] != "http":
            await (self._socket if scope["type"] == "websocket" else self._app)(scope, receive, send)
            return
        measures, began, status = self._measures, perf_counter(), _GONE

        async def sending(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        measures.in_progress += 1
        try:
            await self._app(scope, receive, sending)
        finally:
            measures.in_progress -= 1
            method = scope["method"] if scope["method"] in _METHODS else "other"
            measures.took(method, _route(scope), status, perf_counter() - began)

    async def _socket(self, scope: Scope, receive: Receive, send: Send) -> None:
        open_now = False

        async def sending(message: Message) -> None:
            nonlocal open_now
            if message["type"] == "websocket.accept":
                open_now = True
                self._measures.sockets[_route(scope)] += 1
            await send(message)

        try:
            await self._app(scope, receive, sending)
        finally:
            if open_now:
                self._measures.sockets[_route(scope)] -= 1


def _route(scope: Scope) -> str:
    """Path template of the matched route, or "other"."""
    row: RouteRole | None = scope.get(ROW)
    return "other" if row is None else row.route.path
