"""The OpenAPI document of FastAPI, extended by WebSocket messages, typed parameter routes and examples."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import TypeAdapter
from starlette.routing import BaseRoute

from hornbill.api.live import messages
from hornbill.api.openapi import examples, sharing
from hornbill.api.problems import RESPONSES
from hornbill.api.routes.configuration import rows
from hornbill.api.security.access import COOKIE
from hornbill.domain.by_key import documented
from hornbill.schema.catalog import Catalog

_REF = "#/components/schemas/{model}"

_SCHEMES = {
    "token": {
        "type": "http",
        "scheme": "bearer",
        "description": "Token created with `hornbill tokens create NAME --role ROLE` or `POST /tokens`.",
    },
    "session": {"type": "apiKey", "in": "cookie", "name": COOKIE, "description": "Cookie set by `POST /session`."},
}


def _with_rows(routes: Sequence[BaseRoute], catalog: Catalog) -> list[BaseRoute]:
    """The routes, with the typed ones of each parameter after the generic `{key}` ones."""
    after = 1 + max(index for index, one in enumerate(routes) if getattr(one, "path", "").endswith("/parameters/{key}"))
    return [*routes[:after], *(row.route for row in rows.declared(catalog).rows), *routes[after:]]


def document(app: FastAPI, catalog: Catalog) -> dict[str, Any]:
    """The document, generated once and cached on the application."""
    if app.openapi_schema is None:
        with documented(catalog.readable):
            app.openapi_schema = _made(app, catalog)
    return app.openapi_schema


def _made(app: FastAPI, catalog: Catalog) -> dict[str, Any]:
    made = get_openapi(
        title=app.title,
        version=app.version,
        summary=app.summary,
        routes=_with_rows(app.routes, catalog),
        servers=app.servers or None,
    )
    schemas: dict[str, Any] = made["components"]["schemas"]
    unions: tuple[tuple[str, Any, Literal["validation", "serialization"]], ...] = (
        ("ClientMessage", messages.ClientMessage, "validation"),
        ("ServerMessage", messages.ServerMessage, "serialization"),
        ("DroppedMessage", Annotated[messages.DroppedMessage, "of the event stream"], "serialization"),
    )
    for name, union, mode in unions:
        shape = TypeAdapter[Any](union).json_schema(ref_template=_REF, mode=mode)
        for part, definition in shape.pop("$defs", {}).items():
            schemas.setdefault(part, definition)
        schemas[name] = shape
    made["components"] |= {"securitySchemes": _SCHEMES, "responses": RESPONSES}
    examples.show(made)
    sharing.share(made)
    return made
