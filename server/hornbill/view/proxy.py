"""Proxy that serves viser from our own origin: a frame's page at /viser/KEY/, its WebSocket at the same address.

viser does not check the origin of requests. Here a request must have a Host and an Origin that the policy allows, and
only a browser's messages about cameras and clicks are forwarded.
"""

import asyncio
import gzip
import hashlib
import logging
import secrets
from collections.abc import Callable, Collection
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias, get_args
from urllib.parse import urlencode, urlsplit

import msgspec
from starlette.requests import HTTPConnection, Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketState

from hornbill.view.page import UnknownClient, client
from hornbill.view.settings_socket import serve
from hornbill.view.view_settings import KEY, Quality
from hornbill.view.viewer import Viewer

if TYPE_CHECKING:
    from websockets.asyncio.client import ClientConnection

_log = logging.getLogger(__name__)

PASSED = frozenset({"ViewerCameraMessage", "ScenePointerMessage"})
"""Message types that a browser may send to viser: camera and click."""
_LARGEST = 8192
"""Maximum size of a message from a browser, bytes. A camera message has about 300."""
_STRIPPED = frozenset({"websocket", "playbackPath"})
"""Query parameters that would make viser's page connect elsewhere. The page adds the first one to its address itself,
so it reappears on a reload: therefore a redirect instead of an error."""
_START_TIMEOUT = 20.0


Policy: TypeAlias = Callable[[HTTPConnection], bool]
"""Whether a request's Host and Origin are allowed. Also called for a WebSocket without Origin."""


def same_origin(hosts: Collection[str]) -> Policy:
    """Policy of a server with these host names, on any port.

    Host must be one of them, which blocks foreign names that resolve to this server. Origin must have the same host and
    port. Only a WebSocket requires an Origin, because browsers omit it when they open a page.
    """
    known = frozenset(hosts)

    def allowed(request: HTTPConnection) -> bool:
        host = request.headers.get("host", "")
        origin = request.headers.get("origin")
        try:
            if urlsplit(f"//{host}").hostname not in known:
                return False
        except ValueError:  # not a host, for example "["
            return False
        if origin is None:
            return request.scope["type"] != "websocket"
        return origin in (f"http://{host}", f"https://{host}")

    return allowed


def routes(viewer: Viewer, *, allowed: Policy) -> list[Route | WebSocketRoute]:
    """The routes of the 3D view, for an application without other routes at /viser.

    The first request of the page starts the view. KEY: 16 to 64 random hex digits that connect a frame, its socket and
    its settings; /viser/ chooses one. Query parameters of the page: `darkMode` (present or not), `quality=high|low` and
    `select=UID` are the frame's initial settings; `fixedDpr` and `initialCamera…` belong to viser. Later settings are
    sent over the WebSocket at /viser/KEY/settings.
    """

    async def page(request: Request) -> Response:
        return await _page(request, viewer, allowed)

    async def socket(websocket: WebSocket) -> None:
        await _socket(websocket, viewer, allowed)

    async def settings(websocket: WebSocket) -> None:
        key = _key(websocket)
        if key is None or not allowed(websocket):
            await websocket.close(1008)  # before accept: the browser receives 403
            return
        await serve(websocket, viewer, key)

    return [
        Route("/viser", page, methods=["GET"], include_in_schema=False),
        Route("/viser/", page, methods=["GET"], include_in_schema=False),
        Route("/viser/{key}", page, methods=["GET"], include_in_schema=False),
        Route("/viser/{key}/", page, methods=["GET"], include_in_schema=False),
        WebSocketRoute("/viser/{key}", socket),
        WebSocketRoute("/viser/{key}/", socket),
        WebSocketRoute("/viser/{key}/settings", settings),
    ]


def _key(connection: HTTPConnection) -> str | None:
    key = connection.path_params.get("key", "")
    return key if KEY.fullmatch(key) else None


async def _page(request: Request, viewer: Viewer, allowed: Policy) -> Response:
    if not allowed(request):
        return PlainTextResponse("The 3D view is not allowed from this address.", 403)
    query = [(key, value) for key, value in request.query_params.multi_items() if key not in _STRIPPED]
    key = _key(request)
    if key is None and "key" in request.path_params:
        return PlainTextResponse("A frame's key is 16 to 64 hex digits.", 404)
    if key is None or not request.url.path.endswith("/") or len(query) != len(request.query_params.multi_items()):
        address = f"{request.scope.get('root_path', '')}/viser/{key or secrets.token_hex(16)}/"
        target = address + (f"?{urlencode(query)}" if query else "")
        return RedirectResponse(target, 307, {"Cache-Control": "no-store"})
    try:
        source = await asyncio.to_thread(client)
    except UnknownClient as error:
        return PlainTextResponse(f"The 3D view cannot be shown: {error}", 503)
    dark = "darkMode" in request.query_params
    settings = replace(viewer.settings(key), dark=dark, selected=request.query_params.get("select"))
    for known in get_args(Quality):
        if request.query_params.get("quality") == known:
            settings = replace(settings, quality=known)
    viewer.show(key, settings)
    viewer.start()
    body = source.page(dark=dark)
    tag = f'"{hashlib.sha256(body).hexdigest()[:32]}"'
    headers = {
        "Content-Security-Policy": source.policy,
        "Cache-Control": "no-cache",
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Cross-Origin-Resource-Policy": "same-origin",
        "ETag": tag,
        "Vary": "Accept-Encoding",
    }
    if request.headers.get("if-none-match") == tag:
        return Response(status_code=304, headers=headers)
    if "gzip" in request.headers.get("accept-encoding", ""):
        headers["Content-Encoding"] = "gzip"
        body = await asyncio.to_thread(gzip.compress, body, 3)
    return Response(body, media_type="text/html; charset=utf-8", headers=headers)


async def _socket(websocket: WebSocket, viewer: Viewer, allowed: Policy) -> None:
    offered: list[str] = websocket.scope.get("subprotocols") or []
    wanted = client().subprotocol
    key = _key(websocket)
    if key is None or not allowed(websocket) or wanted not in offered:
        await websocket.close(1008)  # before accept: the browser receives 403
        return
    viewer.start()
    try:
        port = await asyncio.wait_for(asyncio.shield(asyncio.wrap_future(viewer.ready)), _START_TIMEOUT)
        from websockets.asyncio.client import connect  # late, like viser
        from websockets.typing import Subprotocol

        upstream = await connect(
            f"ws://127.0.0.1:{port}/{key}",
            subprotocols=[Subprotocol(wanted)],
            compression=None,
            max_size=None,
            ping_interval=None,
            proxy=None,
        )
    except Exception as error:
        _log.warning("The 3D view does not respond: %s", error)
        await websocket.close(1013)
        return
    async with upstream:
        await websocket.accept(subprotocol=upstream.subprotocol)
        await _pump(websocket, upstream)


async def _pump(websocket: WebSocket, upstream: "ClientConnection") -> None:
    """Forward messages in both directions until one side closes, then close the other."""
    tasks = {asyncio.create_task(_down(upstream, websocket)), asyncio.create_task(_up(websocket, upstream))}
    code = 1001
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            if isinstance(error := task.exception(), _Rejected):
                code = error.code
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    if websocket.application_state is WebSocketState.CONNECTED and websocket.client_state is WebSocketState.CONNECTED:
        await websocket.close(code)


class _Rejected(Exception):
    """A message that our pages do not send. The connection is closed with this code."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


class _Head(msgspec.Struct):
    type: str


_HEAD = msgspec.msgpack.Decoder(_Head)


async def _down(upstream: "ClientConnection", websocket: WebSocket) -> None:
    async for message in upstream:
        await websocket.send_bytes(message if isinstance(message, bytes) else message.encode())


async def _up(websocket: WebSocket, upstream: "ClientConnection") -> None:
    while (event := await websocket.receive())["type"] != "websocket.disconnect":
        message: bytes | None = event.get("bytes")
        if message is None:
            raise _Rejected(1003)
        if len(message) > _LARGEST:
            raise _Rejected(1009)
        try:
            kind = _HEAD.decode(message).type
        except msgspec.DecodeError:
            raise _Rejected(1007) from None
        if kind in PASSED:
            await upstream.send(message)
        else:
            _log.debug("%s not forwarded to the 3D view", kind)
