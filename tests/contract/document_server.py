"""A server made from the OpenAPI document: it responds with what the document allows, and rejects anything else.

It replaces a real server, to see which operations a program requests, and how the program handles full responses and
responses as empty as the document allows.
"""

import json
import re
from functools import lru_cache
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl

import httpx
import orjson

from hornbill.api.openapi.sharing import parameters_of

DOCUMENT = Path(__file__).parents[2] / "schemas" / "generated" / "openapi.json"
FILES = ("get_report", "export_profile")
"""Operations with several formats, one of them JSON."""
UID = "0123456789abcdef" * 2


@lru_cache
def document() -> dict[str, Any]:
    """The OpenAPI document, as generated (`test_generated.py`)."""
    return json.loads(DOCUMENT.read_text(encoding="utf-8"))


class DocumentServer:
    """Responds as the document says. `full`: no optional value is null, and lists have one item; else the opposite.

    `requested` lists the IDs of the requested operations, "preview_" before that of a dry run. Raises AssertionError
    for a request that the document does not declare: an unknown path, query or field, or a missing required field.
    """

    def __init__(self, *, full: bool = True) -> None:
        self.full = full
        self.requested: list[str] = []

    def transport(self) -> httpx.MockTransport:
        """For a client."""
        return httpx.MockTransport(self._respond)

    def _respond(self, request: httpx.Request) -> httpx.Response:
        path = request.url.path
        operation = _operation(request.method.lower(), path)
        planned = b'"dry_run":true' in request.content.replace(b" ", b"")
        self.requested.append(("preview_" if planned else "") + operation["operationId"])
        declared = {one["name"] for one in parameters_of(document(), operation) if one["in"] == "query"}
        sent = {key for key, _ in parse_qsl(request.url.query.decode(), keep_blank_values=True)}
        assert sent <= declared, f"{operation['operationId']} takes no {sent - declared}"
        self._check_body(operation, request)
        status = min(operation["responses"])
        response = operation["responses"][status]
        content = response.get("content", {})
        if status == "204":
            return httpx.Response(204)
        if "application/json" not in content or operation["operationId"] in FILES:
            return httpx.Response(200, text="{}\n", headers={"Content-Type": "text/plain"})
        schema = content["application/json"]["schema"]
        if planned and "anyOf" in schema:
            schema = schema["anyOf"][-1]
        made = self.made(schema)
        return httpx.Response(int(status), content=orjson.dumps(made), headers={"Content-Type": "application/json"})

    def _check_body(self, operation: dict[str, Any], request: httpx.Request) -> None:
        if "application/json" not in request.headers.get("content-type", ""):
            return
        name = operation["operationId"]
        declared = operation["requestBody"]["content"]["application/json"]["schema"]
        shape = _resolved(next((one for one in declared.get("anyOf", ()) if "$ref" in one), declared))
        body = orjson.loads(request.content)
        known = set(shape["properties"])
        assert set(body) <= known, f"{name} has no {set(body) - known}"
        assert set(shape.get("required", ())) <= set(body), f"{name} requires {shape['required']}"

    def made(self, shape: dict[str, Any], name: str = "") -> Any:
        """An example value of a schema."""
        shape = _resolved(shape)
        kinds = shape.get("anyOf") or shape.get("oneOf")
        if kinds:
            nothing = [one for one in kinds if one.get("type") == "null"]
            return None if nothing and not self.full else self.made(kinds[0], name)
        if "const" in shape or "enum" in shape:
            words = shape.get("enum") or [shape["const"]]
            # The program would wait for a job that never ends.
            return "succeeded" if "succeeded" in words else words[0]
        match shape.get("type"):
            case "object" if "properties" in shape:
                return self._object(shape)
            case "object":
                of: Any = shape.get("additionalProperties")
                return {"angle_p_gain": self.made({} if of in (None, True) else of)} if self.full else {}
            case "array":
                return [self.made(shape.get("items", {}), name)] if self.full else []
            case "string":
                return UID if "uid" in name else "x"
            case "boolean":
                # A change has an effect, and a cleared stop is not latched.
                return name not in ("latched", "before")
            case "integer" | "number":
                return shape.get("minimum", 1)
            case _:
                return None

    def _object(self, shape: dict[str, Any]) -> dict[str, Any]:
        made = {key: self.made(one, key) for key, one in shape["properties"].items()}
        title = shape.get("title", "")
        # A success has none of these.
        if "problem" in made:
            made["problem"] = None
        if title == "Job":
            made["error"] = None
        if title == "Imported":
            made["profile"] = DocumentServer().made(shape["properties"]["profile"])
        if title == "Stream":
            made["ended"] = None
        return made


@lru_cache
def _operation(verb: str, path: str) -> dict[str, Any]:
    paths = document()["paths"]
    found = [
        template
        for template, verbs in paths.items()
        if verb in verbs and re.fullmatch(re.sub(r"\{\w+\}", "[^/]+", template), path)
    ]
    assert found, f"the document has no {verb} {path}"
    # As in the server: the route of any parameter is before those of each; else a word is before anything.
    best = max(found, key=lambda one: (one.endswith("/parameters/{key}"), -one.count("{")))
    return paths[best][verb]


def _resolved(shape: dict[str, Any]) -> dict[str, Any]:
    while "$ref" in shape:
        shape = document()["components"]["schemas"][shape["$ref"].rsplit("/", 1)[-1]]
    return shape
