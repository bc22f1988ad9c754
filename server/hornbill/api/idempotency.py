"""A POST with an Idempotency-Key is done once; whoever sends it again gets the first answer."""

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
from hornbill.api.problems import answer as problem_answer
from hornbill.api.routes.motion import streams
from hornbill.api.routing import EVERY_TIME, KEY_HEADER, LONGEST_KEY
from hornbill.api.security.access import WHO, Identity
from hornbill.api.security.bodies import whole
from hornbill.api.security.guard import route_path
from hornbill.errors import HornbillError, Interrupted, InvalidValue, KeyReused, StoreFailed, Unknown
from hornbill.servo.host import Host
from hornbill.store.answers import Answer
from hornbill.store.store import Store

log = logging.getLogger(__name__)

REPLAYED: Final = "Idempotency-Replayed"
"""A header of every answer that is not the first."""

_KEY: Final = re.compile(rf"[\x21-\x7e]{{1,{LONGEST_KEY}}}")
_KEPT_HEADERS: Final = ("content-type", "location", "retry-after")


def _lease(host: Host, told: dict[str, Any]) -> BaseModel:
    lease = host.leases.current(host.base.now())
    if lease is None or lease.id != told["id"]:
        raise Unknown(
            "unknown_lease",
            "The lease this key was given has ended. Ask for a new one, with a new key.",
            cause="lease_of_key_ended",
        )
    return present.lease(host, lease)


_AS_IT_IS_NOW: Final[dict[str, Callable[[Host, dict[str, Any]], BaseModel]]] = {
    "/api/v1/leases": _lease,
    "/api/v1/leases/requests": lambda host, told: present.take_over(host, host.motion_control.look(told["id"])),
    "/api/v1/streams": lambda host, told: streams.shown(host.streams.get(told["id"])),
}
"""What was given may have ended since: the first answer would call it live. So it is looked at again."""


class Idempotency:
    """ASGI middleware behind the guard. Keys are those of a token; where nobody needs one, all share them.

    Every answer is kept, a refusal too: a key is one request with one outcome, and to try again takes a new key. Sent
    again while the first is under way, it waits for the same answer.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._under_way: dict[str, tuple[str, asyncio.Future[Answer | None]]] = {}
        self._beginning = asyncio.Lock()
        """Held from the look for a first request to when this one is it, for the store is waited for in between."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Do it, or answer what it was answered before."""
        if scope["type"] != "http" or scope["method"] != "POST":
            await self._app(scope, receive, send)
            return
        keys = HTTPConnection(scope).headers.getlist(KEY_HEADER)
        path = route_path(scope)
        if not keys or path in EVERY_TIME or not path.startswith("/api/"):
            await self._app(scope, receive, send)
            return
        try:
            if len(keys) > 1 or not _KEY.fullmatch(keys[0]):
                raise InvalidValue(
                    f"{KEY_HEADER} is one text of 1 to {LONGEST_KEY} visible ASCII characters.",
                    cause="key_malformed",
                    longest=LONGEST_KEY,
                )
            body, receive = await whole(receive)
            if body is None:
                return  # gone before all of it was here: nothing is done
            key, request = _digests(scope, path, keys[0], body)
            store: Store = scope["app"].state.host.store
            async with self._beginning:
                first = self._under_way.get(key)
                begun = None if first is not None else await store.run(store.answers.begin, key, request)
                if first is None and begun is None:
                    self._under_way[key] = request, asyncio.get_running_loop().create_future()
            if first is not None:
                known, answered, here = first[0], None, True
            elif begun is not None:
                known, answered, here = begun.request, begun.answer, begun.here
            else:
                await self._do(store, key, scope, receive, send)
                return
            if known != request:
                raise KeyReused(
                    f"This {KEY_HEADER} came with another request before. Make a new one, a UUID for one, for each "
                    "request.",
                    cause="key_reused",
                )
            if first is not None:
                answered = await asyncio.shield(first[1])
            response = _again(scope["app"].state.host, path, answered, here)
        except HornbillError as error:
            response = problem_answer(error)
        await response(scope, receive, send)

    async def _do(self, store: Store, key: str, scope: Scope, receive: Receive, send: Send) -> None:
        """The first time. What it is answered is kept before it is sent."""
        started: Message = {}
        said = bytearray()
        found: Answer | None = None

        async def keeping(message: Message) -> None:
            nonlocal started, found
            if message["type"] == "http.response.start":
                started = message
                return
            said.extend(message.get("body", b""))
            if message.get("more_body", False):
                return
            found = Answer(started["status"], _headers(started), bytes(said))
            try:
                await store.run(store.answers.end, key, found)
            except StoreFailed:  # it was done: whoever asked must hear so, and the key has no answer any more
                log.exception("the answer to a request with a key cannot be kept")
            await send(started)
            await send({"type": "http.response.body", "body": found.body})

        try:
            await self._app(scope, receive, keeping)
        finally:
            self._under_way.pop(key)[1].set_result(found)


def _digests(scope: Scope, path: str, key: str, body: bytes) -> tuple[str, str]:
    """The key together with whose it is, and the request. Neither key nor token can be read from what is kept."""
    who: Identity | None = scope.get(WHO)
    owned = f"{'' if who is None else who.token}\n{key}"
    asked = b"\n".join((path.encode(errors="replace"), scope["query_string"], body))
    return sha256(owned.encode()).hexdigest(), sha256(asked).hexdigest()


def _headers(started: Message) -> dict[str, str]:
    pairs = ((name.decode("latin-1").lower(), value.decode("latin-1")) for name, value in started["headers"])
    return {name: value for name, value in pairs if name in _KEPT_HEADERS}


def _again(host: Host, path: str, answered: Answer | None, here: bool) -> Response:
    """The first answer. Raises Interrupted where there is none, and Unknown where what it gave has ended."""
    if answered is None:
        why = (
            "It ended without an answer"
            if here
            else "The server ended, or another one was asked, while it was under way"
        )
        raise Interrupted(
            f"This request was begun before. {why}: whether it was done is not known. Look at what is there; "
            "it is not done again with this key.",
            cause="outcome_unknown",
        )
    body, look = answered.body, _AS_IT_IS_NOW.get(path)
    if look is not None and answered.status < 300:
        body = look(host, orjson.loads(body)).model_dump_json().encode()
    return Response(body, answered.status, headers={**answered.headers, REPLAYED: "true"})
