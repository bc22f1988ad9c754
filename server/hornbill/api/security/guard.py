"""The guard: every request and every socket passes it before any route is looked at."""

import asyncio
from ipaddress import ip_address
from typing import Any, Final
from urllib.parse import parse_qsl, urlencode

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from hornbill.api.problems import answer
from hornbill.api.security.access import WHO, Access, Identity, forbidden
from hornbill.api.security.bodies import ready
from hornbill.api.security.origin import LOCAL_NAMES, Policy
from hornbill.api.security.proxied import as_the_proxy_saw_it
from hornbill.api.security.roles import ANYBODY, HERE, ROW, Role, RouteTable, needed
from hornbill.errors import HornbillError, Unauthorized
from hornbill.servo.runtime.actor import act_as

_GONE: Final = 4401
"""How a socket is closed whose token was revoked, or whose session was ended."""

SAFE: Final = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"content-security-policy", b"default-src 'none'; frame-ancestors 'none'"),
    (b"cache-control", b"no-store"),
)
"""What every answer carries that says nothing else itself."""


class Guard:
    """ASGI middleware: host and origin, then who it is and whether they may, then what they bring."""

    def __init__(
        self, app: ASGIApp, table: RouteTable, policy: Policy | None, access: Access, *, behind_proxy: bool = False,
        root_path: str = "",
    ) -> None:  # fmt: skip
        """Without a `policy` any host and origin will do: that is for tests of routes."""
        self._app = app
        self._table = table
        self._policy = policy
        self._access = access
        self._behind_proxy = behind_proxy
        self._root_path = root_path

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse or pass on."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        if self._root_path:
            scope["root_path"] = self._root_path
        if self._behind_proxy:
            as_the_proxy_saw_it(scope)
        scope[ROW] = self._table.find(scope.get("method", "GET"), route_path(scope))
        try:
            who = self._admit(scope)
            if scope["type"] == "http":
                brought = await ready(scope, route_path(scope), receive)
                if brought is not receive:  # a body can take for ever to come, and a token be revoked meanwhile
                    who, receive = self._admit(scope), brought
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
        """Who it is. Raises ForbiddenOrigin, Unauthorized, TooManyAttempts or ForbiddenRole."""
        connection = HTTPConnection(scope)
        refusal = None if self._policy is None else self._policy(connection)
        if refusal is not None:
            raise refusal
        method, path = scope.get("method", "GET"), route_path(scope)
        role, stopping = needed(scope[ROW]), (method, path) == ("POST", "/api/v1/stop")
        who = self._access.who(connection, _ticket(scope), stopping=stopping)
        if role == ANYBODY or not self._access.required:
            return who
        if role == HERE and not self._behind_proxy and _is_here(scope):
            return who
        if who is None and stopping:
            who = self._access.stopper(connection)
        if who is None:
            raise Unauthorized(
                "This needs a token that is known. Send 'Authorization: Bearer TOKEN', or log in on the page. "
                "'hornbill token add NAME --role ROLE' makes one.",
                cause="token_required",
            )
        if who.role < role:
            raise forbidden(who, Role(role))
        return who

    async def _socket(self, access: Access, who: Identity | None, scope: Scope, receive: Receive, send: Send) -> None:
        """A socket for as long as what it came with is good."""
        ended = access.watch(who)
        serving = asyncio.ensure_future(self._app(scope, receive, send))
        try:
            await asyncio.wait({ended, serving}, return_when=asyncio.FIRST_COMPLETED)
            if not serving.done():
                serving.cancel()
                await asyncio.gather(serving, return_exceptions=True)
                await send({"type": "websocket.close", "code": _GONE, "reason": "The token or login has ended."})
                return
            serving.result()
        finally:
            access.unwatch(who, ended)
            if not serving.done():  # the server itself ends
                serving.cancel()
                await asyncio.gather(serving, return_exceptions=True)


def route_path(scope: Scope) -> str:
    """The path below the sub-path the server was told of, whether or not a proxy has left it there."""
    path, root = str(scope["path"]), str(scope.get("root_path", ""))
    return path[len(root) :] if root and (path == root or path.startswith(root + "/")) else path


def _is_here(scope: Scope) -> bool:
    """Whether the other end is on this machine. A proxy would be, too: it says so by its headers."""
    client = scope.get("client")
    forwarded = any(name.startswith(b"x-forwarded-") or name == b"forwarded" for name, _ in scope["headers"])
    return client is not None and not forwarded and _is_loopback(client[0])


def _is_loopback(address: str) -> bool:
    """Also 127.0.0.1 as it comes to a server that listens on every address of both kinds: ::ffff:127.0.0.1."""
    try:
        known = ip_address(address)
    except ValueError:  # a name
        return address in LOCAL_NAMES
    return (getattr(known, "ipv4_mapped", None) or known).is_loopback


def _ticket(scope: Scope) -> str | None:
    """The ticket of a socket's address, which is taken out of it: nothing behind us can write it into a log."""
    if scope["type"] != "websocket" or b"ticket=" not in scope["query_string"]:
        return None
    pairs = parse_qsl(scope["query_string"].decode("latin-1"), keep_blank_values=True)
    scope["query_string"] = urlencode([pair for pair in pairs if pair[0] != "ticket"]).encode("latin-1")
    return next((value for name, value in pairs if name == "ticket"), None)


def _safely(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers: list[Any] = list(message.get("headers", ()))
            there = {bytes(name).lower() for name, _ in headers}
            message = {**message, "headers": headers + [pair for pair in SAFE if pair[0] not in there]}
        await send(message)

    return sending


async def _refuse(error: HornbillError, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await _refuse_socket(error, scope, send)
        return
    response = answer(error)
    if isinstance(error, Unauthorized):
        response.headers["WWW-Authenticate"] = "Bearer"
    await response(scope, receive, _safely(send))


async def _refuse_socket(error: HornbillError, scope: Scope, send: Send) -> None:
    """Before it is accepted: as the answer to its request where the server can say so, else as 403."""
    if "websocket.http.response" not in scope.get("extensions", {}):
        await send({"type": "websocket.close", "code": 1008, "reason": error.detail[:120]})
        return
    response = answer(error)
    await send(
        {"type": "websocket.http.response.start", "status": response.status_code, "headers": response.raw_headers}
    )
    await send({"type": "websocket.http.response.body", "body": response.body})
