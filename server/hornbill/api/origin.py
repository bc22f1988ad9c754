"""Owns the check of where a request comes from: a foreign page in the same browser must not move a servo."""

from collections.abc import Callable
from urllib.parse import urlsplit

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Scope, Send

from hornbill.api.problems import answer
from hornbill.errors import ForbiddenOrigin

Policy = Callable[[HTTPConnection], str | None]
"""Why a request is refused, or None."""

_SAFE = frozenset(("GET", "HEAD", "OPTIONS"))


def local_policy(hosts: frozenset[str]) -> Policy:
    """Host must be one of `hosts` (stops DNS rebinding); a browser's Origin must be this very server.

    Programs send no Origin and pass; browsers send one with every request that changes something and every socket.
    """

    def check(connection: HTTPConnection) -> str | None:
        host = connection.headers.get("host", "")
        if urlsplit(f"//{host}").hostname not in hosts:
            return f"Host {host!r} is not this server. Use one of: {', '.join(sorted(hosts))}."
        origin = connection.headers.get("origin")
        changes = connection.scope["type"] == "websocket" or connection.scope["method"] not in _SAFE
        if origin is not None and changes and origin not in (f"http://{host}", f"https://{host}"):
            return f"Origin {origin!r} is another site. Open hornbill's own page at http://{host}/."
        return None

    return check


class OriginGuard:
    """ASGI middleware that answers forbidden_origin (403) before any route is looked at."""

    def __init__(self, app: ASGIApp, policy: Policy) -> None:
        self._app = app
        self._policy = policy

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse or pass on."""
        if scope["type"] in ("http", "websocket"):
            why = self._policy(HTTPConnection(scope))
            if why is not None:
                await self._refuse(scope, receive, send, why)
                return
        await self._app(scope, receive, send)

    async def _refuse(self, scope: Scope, receive: Receive, send: Send, why: str) -> None:
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008, "reason": why[:120]})
            return
        await answer(ForbiddenOrigin(why))(scope, receive, send)
