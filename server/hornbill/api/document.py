"""Owns the OpenAPI document: FastAPI's own, with the WebSocket's messages added to its components."""

from typing import Any, Literal

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import TypeAdapter

from hornbill.api import messages
from hornbill.api.problems import MEDIA_TYPE, STATUS, declared

_INVALID = declared("invalid_value")[STATUS["invalid_value"]]["description"]
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
        _declare_validation(made)
        app.openapi_schema = made
    return app.openapi_schema


def _declare_validation(made: dict[str, Any]) -> None:
    """FastAPI declares its own answer to a request of the wrong form where none is declared; ours is a problem."""
    status = str(STATUS["invalid_value"])
    for operations in made["paths"].values():
        for operation in operations.values():
            answers = operation["responses"]
            if "HTTPValidationError" in str(answers.get(status)):
                schema = {"$ref": _REF.format(model="Problem")}
                answers[status] = {"description": _INVALID, "content": {MEDIA_TYPE: {"schema": schema}}}
    for name in ("HTTPValidationError", "ValidationError"):
        made["components"]["schemas"].pop(name, None)
