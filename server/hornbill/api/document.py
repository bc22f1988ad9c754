"""Owns the OpenAPI document: FastAPI's own, with the WebSocket's messages added to its components."""

from typing import Any

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
        unions: dict[str, Any] = {"ClientMessage": messages.ClientMessage, "ServerMessage": messages.ServerMessage}
        for name, union in unions.items():
            shape = TypeAdapter[Any](union).json_schema(ref_template=_REF, mode="serialization")
            for part, definition in shape.pop("$defs", {}).items():
                schemas.setdefault(part, definition)
            schemas[name] = shape
        app.openapi_schema = made
    return app.openapi_schema
