"""Compression of JSON responses. Streams and files are sent as they are."""

from typing import Final

from fastapi.datastructures import DefaultPlaceholder
from fastapi.routing import APIRoute
from starlette.middleware.gzip import GZipMiddleware
from starlette.types import ASGIApp, Receive, Scope, Send

from hornbill.api.security.roles import ROW, RouteRole

SMALLEST: Final = 1500
"""Size from which a response is compressed, bytes: smaller ones fit in one packet, among them those of Stop."""
_LEVEL: Final = 4
"""Takes about a quarter of the time of the default of 9, for 13 to 22 % more bytes."""


class JsonGzip:
    """ASGI middleware behind the guard: gzip for routes of the API whose response is JSON."""

    def __init__(self, app: ASGIApp) -> None:
        self._plain = app
        self._gzip = GZipMiddleware(app, minimum_size=SMALLEST, compresslevel=_LEVEL)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward the request."""
        fits = scope["type"] == "http" and _accepts_gzip(scope) and _is_json(scope.get(ROW))
        await (self._gzip if fits else self._plain)(scope, receive, send)


def _accepts_gzip(scope: Scope) -> bool:
    return any(name == b"accept-encoding" and b"gzip" in value for name, value in scope["headers"])


def _is_json(row: RouteRole | None) -> bool:
    """Routes of files and streams declare the class of their response."""
    route = None if row is None else row.route
    return (
        isinstance(route, APIRoute)
        and route.path.startswith("/api/")
        and isinstance(route.response_class, DefaultPlaceholder)
    )
