"""Idempotency-Key support: replays the stored response to a repeated POST."""

import asyncio
import logging
import re
from collections.abc import Callable
from hashlib import sha256
from typing import Any, Final

import orjson
from pydantic import BaseModel
from starlette.requests import HTTPConnection
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from hornbill.api import present
from hornbill.api.problems import problem_response
from hornbill.api.routes.motion import streams
from hornbill.api.routing import KEY_HEADER, LONGEST_KEY, WITHOUT_KEY
from hornbill.api.security.access import WHO, Identity
from hornbill.api.security.bodies import whole
from hornbill.api.security.guard import route_path
from hornbill.errors import HornbillError, Interrupted, InvalidValue, KeyReused, StoreFailed, Unknown
from hornbill.servo.host import Host
from hornbill.store.responses import StoredResponse
from hornbill.store.store import Store

log = logging.getLogger(__name__)

REPLAYED: Final = "Idempotency-Replayed"
"""Header of replayed responses."""

_KEY: Final = re.compile(rf"[\x21-\x7e]{{1,{LONGEST_KEY}}}")
_STORED_HEADERS: Final = ("content-type", "location", "retry-after")


def _lease(host: Host, stored: dict[str, Any]) -> BaseModel:
    lease = host.leases.find(stored["id"], host.base.now())
    if lease is None:
        raise Unknown(
            "unknown_lease",
            "The lease created with this key has ended. Request a new lease with a new key.",
            cause="lease_of_key_ended",
        )
    return present.lease(host, lease)


_CURRENT: Final[dict[str, Callable[[Host, dict[str, Any]], BaseModel]]] = {
    "/api/v1/leases": _lease,
    "/api/v1/leases/requests": lambda host, stored: present.take_over(
        host, host.motion_control.get_request(stored["id"])
    ),
    "/api/v1/streams": lambda host, stored: streams.shown(host.streams.get(stored["id"])),
}
"""Routes whose replay returns the current state: the resource may have ended since the first response."""


class Idempotency:
    """ASGI middleware behind the guard. Keys are scoped to a token; without access control all clients share them.

    Every response is stored, errors included: a key stands for one request with one outcome, and a new attempt needs a
    new key. A repeat during the first request waits for its response.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._in_progress: dict[str, tuple[str, asyncio.Future[StoredResponse | None]]] = {}
        self._registering = asyncio.Lock()
        """Held from the lookup of a key until the request is registered, because the store is awaited in between."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Carry the request out, or replay the stored response."""
        if scope["type"] != "http" or scope["method"] != "POST":
            await self._app(scope, receive, send)
            return
        keys = HTTPConnection(scope).headers.getlist(KEY_HEADER)
        path = route_path(scope)
        if not keys or path in WITHOUT_KEY or not path.startswith("/api/"):
            await self._app(scope, receive, send)
            return
        try:
            if len(keys) > 1 or not _KEY.fullmatch(keys[0]):
                raise InvalidValue(
                    f"Invalid {KEY_HEADER}. Send it once, with 1 to {LONGEST_KEY} visible ASCII characters.",
                    cause="key_malformed",
                    longest=LONGEST_KEY,
                )
            body, receive = await whole(receive)
            if body is None:
                return  # disconnected before the body was complete
            key, request = _digests(scope, path, keys[0], body)
            store: Store = scope["app"].state.host.store
            async with self._registering:
                first = self._in_progress.get(key)
                begun = None if first is not None else await store.keys.begin(key, request)
                if first is None and begun is None:
                    self._in_progress[key] = request, asyncio.get_running_loop().create_future()
            if first is not None:
                known, stored, here = first[0], None, True
            elif begun is not None:
                known, stored, here = begun.request, begun.response, begun.here
            else:
                await self._do(store, key, scope, receive, send)
                return
            if known != request:
                raise KeyReused(
                    f"This {KEY_HEADER} was already used for a different request. Use a new key for each request, for "
                    "example a UUID.",
                    cause="key_reused",
                )
            if first is not None:
                stored = await asyncio.shield(first[1])
            response = _replay(scope["app"].state.host, path, stored, here)
        except HornbillError as error:
            response = problem_response(error)
        await response(scope, receive, send)

    async def _do(self, store: Store, key: str, scope: Scope, receive: Receive, send: Send) -> None:
        """Carry out the first request. The response is stored before it is sent."""
        started: Message = {}
        content = bytearray()
        found: StoredResponse | None = None

        async def storing(message: Message) -> None:
            nonlocal started, found
            if message["type"] == "http.response.start":
                started = message
                return
            content.extend(message.get("body", b""))
            if message.get("more_body", False):
                return
            found = StoredResponse(started["status"], _headers(started), bytes(content))
            try:
                await store.keys.end(key, found)
            except StoreFailed:  # the request was carried out, so its response is sent; a repeat gets `interrupted`
                log.exception("cannot store the response to a request with an Idempotency-Key")
            await send(started)
            await send({"type": "http.response.body", "body": found.body})

        try:
            await self._app(scope, receive, storing)
        finally:
            self._in_progress.pop(key)[1].set_result(found)


def _digests(scope: Scope, path: str, key: str, body: bytes) -> tuple[str, str]:
    """Digests of token with key, and of the request. Neither key nor token is stored in plain text."""
    who: Identity | None = scope.get(WHO)
    owned = f"{'' if who is None else who.token}\n{key}"
    request = b"\n".join((path.encode(errors="replace"), scope["query_string"], body))
    return sha256(owned.encode()).hexdigest(), sha256(request).hexdigest()


def _headers(started: Message) -> dict[str, str]:
    pairs = ((name.decode("latin-1").lower(), value.decode("latin-1")) for name, value in started["headers"])
    return {name: value for name, value in pairs if name in _STORED_HEADERS}


def _replay(host: Host, path: str, stored: StoredResponse | None, here: bool) -> Response:
    """Replay of the first response. Raises Interrupted if there is none, and Unknown if the resource has ended."""
    if stored is None:
        why = (
            "It ended without a response"
            if here
            else "The server exited during the request, or another server received it"
        )
        raise Interrupted(
            f"A request with this {KEY_HEADER} was started before. {why}, so its outcome is unknown. Check the current "
            "state; the request is not repeated with this key.",
            cause="outcome_unknown",
        )
    body, current = stored.body, _CURRENT.get(path)
    if current is not None and stored.status < 300:
        body = current(host, orjson.loads(body)).model_dump_json().encode()
    return Response(body, stored.status, headers={**stored.headers, REPLAYED: "true"})
