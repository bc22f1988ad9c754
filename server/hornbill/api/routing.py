"""Declaration of routes: minimum role, possible problems, and their documentation."""

import warnings
from collections.abc import Awaitable, Callable, Sequence
from functools import cached_property
from typing import Any, Final, TypeVar

from fastapi import Depends, Request
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute, APIWebSocketRoute
from starlette.responses import Response
from starlette.routing import Match, compile_path
from starlette.types import ASGIApp, Receive, Scope, Send

from hornbill.api import PREFIX
from hornbill.api.paging import CURSOR, LINK
from hornbill.api.problems import STATUS, declared
from hornbill.api.security.bodies import whole
from hornbill.api.security.queries import query_names
from hornbill.api.security.roles import LOCAL, PUBLIC, ROW, Role, RouteRole

Endpoint = TypeVar("Endpoint", bound=Callable[..., Any])

Direct = Callable[[Request, bytes], Awaitable[Response | None]]
"""Response to the usual form of a request and its body; None for every other form."""

KEY_HEADER: Final = "Idempotency-Key"
LONGEST_KEY: Final = 255

WITHOUT_KEY: Final = {
    f"{PREFIX}/stop": "every stop request is carried out",
    f"{PREFIX}/session": "the response contains a secret, which is not stored",
    f"{PREFIX}/tickets": "the response contains a secret, which is not stored",
    f"{PREFIX}/tokens": "the response contains a secret, which is not stored; a duplicate name is refused anyway",
}
"""POST routes without Idempotency-Key, each with the reason."""

_STRICT: Final = ("/api/", "/metrics")
"""Paths whose query is checked. Health probes and files of the page accept any query."""

_KEY: Final = {
    "name": KEY_HEADER,
    "in": "header",
    "required": False,
    "description": "A repeated request with the same key is carried out once and returns the first response. Responses "
    "are stored for at least 24 h.",
    "example": "rig-7-run-2031",
    "schema": {"type": "string", "minLength": 1, "maxLength": LONGEST_KEY, "pattern": "^[!-~]+$"},
}


class Routes:
    """Routes of one subject. Each is declared with its path, minimum role and possible problem codes.

    The name of the endpoint is the operation ID.
    """

    def __init__(self, tag: str, prefix: str = PREFIX, *, after: Callable[[], Awaitable[None]] | None = None) -> None:
        """`tag`: subject by which the document groups operations. `after`: called before each endpoint."""
        self.rows: list[RouteRole] = []
        self._tag = tag
        self._prefix = prefix
        self._dependencies = [] if after is None else [Depends(after)]

    def get(
        self, path: str, least: int, *codes: str, direct: Direct | None = None, **more: Any
    ) -> Callable[[Endpoint], Endpoint]:
        """Declare a GET; `more` is passed to FastAPI.

        `direct` serves the usual form of a frequent request: FastAPI's parameters take longer than the rest.
        """
        return self._declare("GET", path, least, codes, more, direct)

    def put(
        self, path: str, least: int, *codes: str, direct: Direct | None = None, **more: Any
    ) -> Callable[[Endpoint], Endpoint]:
        """Declare a PUT; `direct` as for GET."""
        return self._declare("PUT", path, least, codes, more, direct)

    def post(self, path: str, least: int, *codes: str, **more: Any) -> Callable[[Endpoint], Endpoint]:
        """Declare a POST; it accepts an Idempotency-Key unless its path is in WITHOUT_KEY."""
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
        self, method: str, path: str, least: int, codes: Sequence[str], more: dict[str, Any],
        direct: Direct | None = None,
    ) -> Callable[[Endpoint], Endpoint]:  # fmt: skip
        def add(endpoint: Endpoint) -> Endpoint:
            def build() -> APIRoute:
                given: dict[str, Any] = {
                    "operation_id": endpoint.__name__,
                    "summary": _summary(endpoint.__name__),
                    "response_description": "Success.",
                    "dependencies": self._dependencies,
                    **more,
                    "tags": [self._tag, *more.get("tags", ())],
                }
                route = APIRoute(self._prefix + path, endpoint, methods=[method], **given)
                if CURSOR in query_names(route.dependant):
                    route.responses = {200: {"headers": LINK}, **route.responses}
                keyed = method == "POST" and route.path not in WITHOUT_KEY
                route.responses = {**route.responses, **_problems(route, codes, keyed=keyed)}
                route.openapi_extra = {**_access(least), **(route.openapi_extra or {})}
                if keyed:
                    route.openapi_extra["parameters"] = [_KEY]
                if route.body_field is not None:
                    with warnings.catch_warnings(action="ignore"):  # of pydantic, of an alias that FastAPI gives it
                        route.body_field.validate(None)
                return route

            parts = self._prefix + path, endpoint, method, build
            route = _LazyRoute(*parts) if direct is None else _DirectRoute(direct, *parts)
            self.rows.append(RouteRole(route, least))
            return endpoint

        return add


def build_route(route: object) -> None:
    """Build a route now, so that its first request takes no longer than others. Idempotent."""
    getattr(route, "app", None)


class _LazyRoute(APIRoute):
    """Route of FastAPI that is built when it is first used, because most are not: all together take 0.2 s of CPU and
    6 MiB, none more than 8 ms.

    Until then it has what the look-up of a request needs.
    """

    def __init__(self, path: str, endpoint: Callable[..., Any], method: str, build: Callable[[], APIRoute]) -> None:
        self.path, self.endpoint, self.methods = path, endpoint, {method}
        self.path_regex, self.path_format, self.param_convertors = compile_path(path)
        self._build: Callable[[], APIRoute] | None = build

    def __getattr__(self, name: str) -> Any:
        build: Callable[[], APIRoute] | None = vars(self).get("_build")
        if build is None:
            raise AttributeError(name)
        vars(self).update(vars(build()), _build=None)
        return getattr(self, name)

    @cached_property
    def query(self) -> frozenset[str] | None:
        """Names of the query parameters; None if any are accepted."""
        return frozenset(query_names(self.dependant)) if self.path.startswith(_STRICT) else None


class _DirectRoute(_LazyRoute):
    """The same, with a function for the usual form of its requests."""

    def __init__(self, direct: Direct, *parts: Any) -> None:
        super().__init__(*parts)
        self._direct = direct

    async def handle(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request whose path matches, or refuse its method."""
        if scope["method"] in (self.methods or ()):
            body, receive = await whole(receive)
            response = None if body is None else await self._direct(Request(scope), body)
            if response is not None:
                await response(scope, receive, send)
                return
        await super().handle(scope, receive, send)


class Dispatch:
    """ASGI application that passes a request to the route that the guard found; `router` serves all others."""

    def __init__(self, router: ASGIApp) -> None:
        self._router = router

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve the request."""
        row: RouteRole | None = scope.get(ROW)
        if row is not None:
            match, found = row.route.matches(scope)
            if match is Match.FULL:
                scope.update(found)
                await row.route.handle(scope, receive, send)
                return
        await self._router(scope, receive, send)


def _summary(name: str) -> str:
    """Summary of an operation from the name of its function."""
    words = ("CSV" if word == "csv" else word for word in name.split("_"))
    text = " ".join(words)
    return text[0].upper() + text[1:]


def _problems(route: APIRoute, codes: Sequence[str], *, keyed: bool) -> dict[int | str, dict[str, Any]]:
    """Problem responses of a route. Those of the guard are the same for all routes: `default`."""
    every = [*codes]
    if "unknown_servo" in codes:
        every.append("conflict")  # a label or serial number of several servos
    if STATUS["invalid_value"] not in {STATUS[code] for code in codes} and _takes_input(route.dependant):
        every.append("invalid_value")
    if keyed:
        every += ["idempotency_key_reused", "interrupted", "store_failed"]
    return declared(*every, limited=route.operation_id != "stop")  # Stop is never rate-limited


def _takes_input(of: Dependant) -> bool:
    taken = of.path_params, of.query_params, of.header_params, of.cookie_params, of.body_params
    return any(taken) or any(map(_takes_input, of.dependencies))


def _access(least: int) -> dict[str, Any]:
    """Security schemes and minimum role of an operation."""
    if least == PUBLIC:
        return {}
    role = Role.VIEW if least == LOCAL else Role(least)
    return {"security": [{"token": []}, {"session": []}], "x-hornbill-role": role.word}
