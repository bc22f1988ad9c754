"""How a route is declared: its least role, the problems it may answer, and with them what the document says of both."""

from collections.abc import Callable, Sequence
from typing import Any, Final, TypeVar

from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute, APIWebSocketRoute

from hornbill.api import PREFIX
from hornbill.api.problems import STATUS, declared
from hornbill.api.security.roles import ANYBODY, HERE, Role, RouteRole

Endpoint = TypeVar("Endpoint", bound=Callable[..., Any])

KEY_HEADER: Final = "Idempotency-Key"
LONGEST_KEY: Final = 255

EVERY_TIME: Final = {
    f"{PREFIX}/stop": "a stop is done each time it is asked for",
    f"{PREFIX}/session": "its answer is a secret, which is kept nowhere",
    f"{PREFIX}/tickets": "its answer is a secret, which is kept nowhere",
    f"{PREFIX}/tokens": "its answer is a secret, which is kept nowhere; a second token of a name is refused anyway",
}
"""POSTs without an Idempotency-Key, and why."""

_KEY: Final = {
    "name": KEY_HEADER,
    "in": "header",
    "required": False,
    "description": "Sent again with the same key it is done once, and answered as at first. Kept for 24 h at least.",
    "example": "rig-7-run-2031",
    "schema": {"type": "string", "minLength": 1, "maxLength": LONGEST_KEY, "pattern": "^[!-~]+$"},
}


class Routes:
    """Routes of one subject. Each takes its path, its least role, and the codes of the problems it may answer.

    The endpoint's name is the operation's.
    """

    def __init__(self, tag: str, prefix: str = PREFIX) -> None:
        """`tag`: the subject, as the document groups operations."""
        self.rows: list[RouteRole] = []
        self._tag = tag
        self._prefix = prefix

    def get(self, path: str, least: int, *codes: str, **more: Any) -> Callable[[Endpoint], Endpoint]:
        """Declare a GET; `more` as FastAPI takes it."""
        return self._declare("GET", path, least, codes, more)

    def put(self, path: str, least: int, *codes: str, **more: Any) -> Callable[[Endpoint], Endpoint]:
        """Declare a PUT."""
        return self._declare("PUT", path, least, codes, more)

    def post(self, path: str, least: int, *codes: str, **more: Any) -> Callable[[Endpoint], Endpoint]:
        """Declare a POST; it takes an Idempotency-Key, unless its path is in EVERY_TIME."""
        return self._declare("POST", path, least, codes, more)

    def patch(self, path: str, least: int, *codes: str, **more: Any) -> Callable[[Endpoint], Endpoint]:
        """Declare a PATCH."""
        return self._declare("PATCH", path, least, codes, more)

    def delete(self, path: str, least: int, *codes: str, **more: Any) -> Callable[[Endpoint], Endpoint]:
        """Declare a DELETE."""
        return self._declare("DELETE", path, least, codes, more)

    def websocket(self, path: str, least: int) -> Callable[[Endpoint], Endpoint]:
        """Declare a WebSocket."""

        def add(endpoint: Endpoint) -> Endpoint:
            self.rows.append(RouteRole(APIWebSocketRoute(self._prefix + path, endpoint), least))
            return endpoint

        return add

    def _declare(
        self, method: str, path: str, least: int, codes: Sequence[str], more: dict[str, Any]
    ) -> Callable[[Endpoint], Endpoint]:
        def add(endpoint: Endpoint) -> Endpoint:
            given: dict[str, Any] = {
                "operation_id": endpoint.__name__,
                **more,
                "tags": [self._tag, *more.get("tags", ())],
            }
            route = APIRoute(self._prefix + path, endpoint, methods=[method], **given)
            keyed = method == "POST" and route.path not in EVERY_TIME
            route.responses = {**route.responses, **_problems(route, codes, keyed=keyed)}
            route.openapi_extra = {**_access(least), **(route.openapi_extra or {})}
            if keyed:
                route.openapi_extra["parameters"] = [_KEY]
            self.rows.append(RouteRole(route, least))
            return endpoint

        return add


def _problems(route: APIRoute, codes: Sequence[str], *, keyed: bool) -> dict[int | str, dict[str, Any]]:
    """What a route may answer. What the guard may answer in its place is the same for all: `default`."""
    every = [*codes]
    if STATUS["invalid_value"] not in {STATUS[code] for code in codes} and _takes_anything(route.dependant):
        every.append("invalid_value")
    if keyed:
        every += ["idempotency_key_reused", "interrupted", "store_failed"]
    return declared(*every, limited=route.operation_id != "stop")  # a stop never waits for what others guessed


def _takes_anything(of: Dependant) -> bool:
    taken = of.path_params, of.query_params, of.header_params, of.cookie_params, of.body_params
    return any(taken) or any(map(_takes_anything, of.dependencies))


def _access(least: int) -> dict[str, Any]:
    """Which tokens an operation takes, and the least role of them."""
    if least == ANYBODY:
        return {}
    role = Role.VIEW if least == HERE else Role(least)
    return {"security": [{"token": []}, {"session": []}], "x-hornbill-role": role.word}
