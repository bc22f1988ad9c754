"""Owns the OpenAPI document: FastAPI's own, with each row's routes and the WebSocket's messages added."""

import re
from typing import Annotated, Any, Literal

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import TypeAdapter

from hornbill.api import examples, messages, once, roles, rows, words
from hornbill.api.access import COOKIE
from hornbill.api.problems import MEDIA_TYPE, STATUS, declared
from hornbill.schema.catalog import Catalog

_INVALID = declared("invalid_value")[STATUS["invalid_value"]]["description"]
_REF = "#/components/schemas/{model}"


def document(app: FastAPI, catalog: Catalog) -> dict[str, Any]:
    """The document, made once and kept on the application."""
    if app.openapi_schema is None:
        made = get_openapi(
            title=app.title, version=app.version, summary=app.summary, routes=app.routes, servers=app.servers or None
        )
        rows.declare(made, catalog)
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
        _declare_validation(made)
        _declare_access(made)
        _declare_keys(made)
        words.describe(made)
        examples.show(made)
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


_SCHEMES = {
    "token": {"type": "http", "scheme": "bearer", "description": "'hornbill token add NAME --role ROLE' makes one."},
    "session": {"type": "apiKey", "in": "cookie", "name": COOKIE, "description": "What POST /session sets."},
}


def _declare_access(made: dict[str, Any]) -> None:
    """Says of every operation which role it takes, and how the guard may answer in its place."""
    made["components"]["securitySchemes"] = _SCHEMES
    for path, operations in made["paths"].items():
        for verb, operation in operations.items():
            role = roles.declared(verb.upper(), re.sub(r"{[^}]*}", "{}", path))
            codes = ["forbidden_origin"]
            if role != roles.ANYBODY:
                least = roles.Role.VIEW if role == roles.HERE else roles.Role(role or roles.Role.ADMIN)
                operation["security"] = [{name: []} for name in _SCHEMES]
                operation["x-hornbill-role"] = least.word
                codes += ["unauthorized"] if least is roles.Role.VIEW else ["unauthorized", "forbidden_role"]
            if verb in ("post", "put", "patch", "delete"):
                codes += ["unsupported_media_type", "too_large"]
            if operation["operationId"] != "stop":  # a stop never waits for what others guessed
                codes.append("too_many_attempts")
            for status, answer in declared(*codes).items():
                _answers(operation["responses"], str(status), answer["description"])
            if "429" in operation["responses"]:
                operation["responses"]["429"]["headers"] = {"Retry-After": _LATER}


_LATER = {"description": "ask again after so long, s", "schema": {"type": "integer", "minimum": 1}}
_KEY = {
    "name": once.HEADER,
    "in": "header",
    "required": False,
    "description": "Sent again with the same key it is done once, and answered as at first. Kept for 24 h at least.",
    "example": "rig-7-run-2031",
    "schema": {"type": "string", "minLength": 1, "maxLength": once.LONGEST, "pattern": "^[!-~]+$"},
}


def _declare_keys(made: dict[str, Any]) -> None:
    """Every POST takes a key, but for those of which an answer of the past would be wrong or must not be kept."""
    for path, operations in made["paths"].items():
        if "post" in operations and path not in once.EVERY_TIME:
            operation = operations["post"]
            operation.setdefault("parameters", []).append(_KEY)
            for status, answer in declared("idempotency_key_reused", "interrupted", "store_failed").items():
                _answers(operation["responses"], str(status), answer["description"])


def _answers(answers: dict[str, Any], status: str, description: str) -> None:
    """One more reason for a status, beside those a route has declared itself."""
    if status in answers:
        said = answers[status]["description"]
        answers[status]["description"] = ", ".join(dict.fromkeys(f"{said}, {description}".split(", ")))
    else:
        schema = {"$ref": _REF.format(model="Problem")}
        answers[status] = {"description": description, "content": {MEDIA_TYPE: {"schema": schema}}}
