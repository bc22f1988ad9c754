"""Guard: checks every request and WebSocket before routing."""

import asyncio
from ipaddress import ip_address
from typing import Any, Final
from urllib.parse import parse_qsl, urlencode

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from hornbill.api.problems import problem_response
from hornbill.api.security.access import WHO, Access, Identity, forbidden
from hornbill.api.security.bodies import ready
from hornbill.api.security.origin import LOCAL_NAMES, Policy
from hornbill.api.security.proxied import apply_forwarded
from hornbill.api.security.queries import check_query
from hornbill.api.security.roles import LOCAL, PUBLIC, ROW, Role, RouteTable, needed
from hornbill.errors import HornbillError, Unauthorized
from hornbill.servo.runtime.actor import act_as

_ENDED: Final = 4401
"""Close code of a socket whose token was revoked or whose session ended."""

SAFE: Final = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"content-security-policy", b"default-src 'none'; frame-ancestors 'none'"),
    (b"cache-control", b"no-store"),
)
"""Default headers of every response."""


class Guard:
    """ASGI middleware that checks host and origin, then identity and role, then query and body."""

    def __init__(
        self, app: ASGIApp, table: RouteTable, policy: Policy | None, access: Access, *, behind_proxy: bool = False,
        root_path: str = "",
    ) -> None:  # fmt: skip
        """Without a `policy` any host and origin is accepted, for tests."""
        self._app = app
        self._table = table
        self._policy = policy
        self._access = access
        self._behind_proxy = behind_proxy
        self._root_path = root_path

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse the request or forward it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        if self._root_path:
            scope["root_path"] = self._root_path
        if self._behind_proxy:
            apply_forwarded(scope)
        scope[ROW] = self._table.find(scope.get("method", "GET"), route_path(scope))
        ended = self._access.ended
        try:
            who = self._admit(scope)
            check_query(scope[ROW], scope)
            if scope["type"] == "http":
                body = await ready(scope, route_path(scope), receive)
                if self._access.ended != ended:  # check again: the token may have been revoked while the body arrived
                    who = self._admit(scope)
                receive = body
        except HornbillError as error:
            await _refuse(error, scope, receive, send)
            return
        scope[WHO] = who
        act_as(None if who is None else who.name)
        if scope["type"] == "http":
            await self._app(scope, receive, _safely(send))
        else:
            await self._socket(self._access, who, scope, receive, send)

    def _admit(self, scope: Scope) -> Identity | None:
        """Identity of the client. Raises ForbiddenOrigin, Unauthorized, TooManyAttempts or ForbiddenRole."""
        connection = HTTPConnection(scope)
        refusal = None if self._policy is None else self._policy(connection)
        if refusal is not None:
            raise refusal
        method, path = scope.get("method", "GET"), route_path(scope)
        role, stopping = needed(scope[ROW]), (method, path) == ("POST", "/api/v1/stop")
        who = self._access.who(connection, _ticket(scope), stopping=stopping)
        if role == PUBLIC or not self._access.required:
            return who
        if role == LOCAL and not self._behind_proxy and _is_local(scope):
            return who
        if who is None and stopping:
            who = self._access.stopper(connection)
        if who is None:
            raise Unauthorized(
                "This request requires a valid token. Send 'Authorization: Bearer TOKEN', or log in on the page. "
                "Create a token with 'hornbill tokens create NAME --role ROLE'.",
                cause="token_required",
            )
        if who.role < role:
            raise forbidden(who, Role(role))
        return who

    async def _socket(self, access: Access, who: Identity | None, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a socket until its credential ends."""
        ended = access.watch(who)
        serving = asyncio.ensure_future(self._app(scope, receive, send))
        try:
            await asyncio.wait({ended, serving}, return_when=asyncio.FIRST_COMPLETED)
            if not serving.done():
                serving.cancel()
                await asyncio.gather(serving, return_exceptions=True)
                await send({"type": "websocket.close", "code": _ENDED, "reason": "The token or login has ended."})
                return
            serving.result()
        finally:
            access.unwatch(who, ended)
            if not serving.done():  # the server shuts down
                serving.cancel()
                await asyncio.gather(serving, return_exceptions=True)


def route_path(scope: Scope) -> str:
    """Path below the configured sub-path, whether or not the proxy strips it."""
    path, root = str(scope["path"]), str(scope.get("root_path", ""))
    return path[len(root) :] if root and (path == root or path.startswith(root + "/")) else path


def _is_local(scope: Scope) -> bool:
    """Whether the client is on this machine. A local proxy is recognised by its forwarding headers."""
    client = scope.get("client")
    forwarded = any(name.startswith(b"x-forwarded-") or name == b"forwarded" for name, _ in scope["headers"])
    return client is not None and not forwarded and _is_loopback(client[0])


def _is_loopback(address: str) -> bool:
    """Includes ::ffff:127.0.0.1, the form of 127.0.0.1 on a dual-stack socket."""
    try:
        known = ip_address(address)
    except ValueError:  # a name
        return address in LOCAL_NAMES
    return (getattr(known, "ipv4_mapped", None) or known).is_loopback


def _ticket(scope: Scope) -> str | None:
    """Ticket in the query of a socket. It is removed from the query so that it appears in no log."""
    if scope["type"] != "websocket" or b"ticket=" not in scope["query_string"]:
        return None
    pairs = parse_qsl(scope["query_string"].decode("latin-1"), keep_blank_values=True)
    scope["query_string"] = urlencode([pair for pair in pairs if pair[0] != "ticket"]).encode("latin-1")
    return next((value for name, value in pairs if name == "ticket"), None)


def _safely(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers: list[Any] = list(message.get("headers", ()))
            present = {bytes(name).lower() for name, _ in headers}
            message = {**message, "headers": headers + [pair for pair in SAFE if pair[0] not in present]}
        await send(message)

    return sending


async def _refuse(error: HornbillError, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await _refuse_socket(error, scope, send)
        return
    response = problem_response(error)
    if isinstance(error, Unauthorized):
        response.headers["WWW-Authenticate"] = "Bearer"
    await response(scope, receive, _safely(send))


async def _refuse_socket(error: HornbillError, scope: Scope, send: Send) -> None:
    """Refuse a socket before it is accepted: with an HTTP response if the server supports it, else with 403."""
    if "websocket.http.response" not in scope.get("extensions", {}):
        await send({"type": "websocket.close", "code": 1008, "reason": error.detail[:120]})
        return
    response = problem_response(error)
    await send(
        {"type": "websocket.http.response.start", "status": response.status_code, "headers": response.raw_headers}
    )
    await send({"type": "websocket.http.response.body", "body": response.body})
