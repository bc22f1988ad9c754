"""Owns the OpenAPI document: FastAPI's own, with the WebSocket's messages added to its components."""

from typing import Any, Literal

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import TypeAdapter

from hornbill.api import messages

_REF = "#/components/schemas/{model}"


def document(app: FastAPI) -> dict[str, Any]:
    """The document, made once and kept on the application."""
    if app.openapi_schema is None:
        made = get_openapi(title=app.title, version=app.version, summary=app.summary, routes=app.routes)
        schemas: dict[str, Any] = made.setdefault("components", {}).setdefault("schemas", {})
        unions: tuple[tuple[str, Any, Literal["validation", "serialization"]], ...] = (
            ("ClientMessage", messages.ClientMessage, "validation"),
            ("ServerMessage", messages.ServerMessage, "serialization"),
        )
        for name, union, mode in unions:
            shape = TypeAdapter[Any](union).json_schema(ref_template=_REF, mode=mode)
            for part, definition in shape.pop("$defs", {}).items():
                schemas.setdefault(part, definition)
            schemas[name] = shape
        app.openapi_schema = made
    return app.openapi_schema
