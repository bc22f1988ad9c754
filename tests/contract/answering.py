"""A server that says of everything what the document allows, and refuses what it does not declare.

It stands where a real one would be, to see which operations a program asks for, and how it takes answers that are
full, and answers that are as empty as the document allows.
"""

import re
from functools import lru_cache
from typing import Any
from urllib.parse import parse_qsl

import httpx
import orjson

from hornbill.api.http import create_api
from hornbill.api.openapi.sharing import parameters_of
from hornbill.schema.catalog import Catalog

FILES = ("get_report", "export_profile")
"""JSON is one of their forms."""
UID = "0123456789abcdef" * 2


@lru_cache
def document() -> dict[str, Any]:
    """The OpenAPI document."""
    return create_api(Catalog.load()).openapi()


class Answering:
    """Answers by the document. `full`: whatever may be null is there, and lists hold one thing; else neither.

    `asked` holds the ids of the operations asked for, "preview_" before that of a dry run. Raises AssertionError for a
    request the document does not declare: another path, a query or a field it does not name, a field it requires.
    """

    def __init__(self, *, full: bool = True) -> None:
        self.full = full
        self.asked: list[str] = []

    def transport(self) -> httpx.MockTransport:
        """For a client."""
        return httpx.MockTransport(self._answer)

    def _answer(self, request: httpx.Request) -> httpx.Response:
        path = request.url.path
        operation = _operation(request.method.lower(), path)
        planned = b'"dry_run":true' in request.content.replace(b" ", b"")
        self.asked.append(("preview_" if planned else "") + operation["operationId"])
        named = {one["name"] for one in parameters_of(document(), operation) if one["in"] == "query"}
        sent = {key for key, _ in parse_qsl(request.url.query.decode(), keep_blank_values=True)}
        assert sent <= named, f"{operation['operationId']} takes no {sent - named}"
        self._check_body(operation, request)
        status = min(operation["responses"])
        answer = operation["responses"][status]
        content = answer.get("content", {})
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
        assert set(body) <= known, f"{name} knows no {set(body) - known}"
        assert set(shape.get("required", ())) <= set(body), f"{name} wants {shape['required']}"

    def made(self, shape: dict[str, Any], name: str = "") -> Any:
        """Something of a shape."""
        shape = _resolved(shape)
        kinds = shape.get("anyOf") or shape.get("oneOf")
        if kinds:
            nothing = [one for one in kinds if one.get("type") == "null"]
            return None if nothing and not self.full else self.made(kinds[0], name)
        if "const" in shape or "enum" in shape:
            words = shape.get("enum") or [shape["const"]]
            # Nobody waits for a job that never ends.
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
                # A change changes something, and a stop that was cleared is cleared.
                return name not in ("latched", "before")
            case "integer" | "number":
                return shape.get("minimum", 1)
            case _:
                return None

    def _object(self, shape: dict[str, Any]) -> dict[str, Any]:
        made = {key: self.made(one, key) for key, one in shape["properties"].items()}
        title = shape.get("title", "")
        # What the server says beside a success.
        if "problem" in made:
            made["problem"] = None
        if title == "Job":
            made["error"] = None
        if title == "Imported":
            made["profile"] = Answering().made(shape["properties"]["profile"])
        if title == "Stream":
            made["ended"] = None
        return made


def _operation(verb: str, path: str) -> dict[str, Any]:
    for template, verbs in document()["paths"].items():
        pattern = re.sub(r"\{\w+\}", "[^/]+", template)
        if verb in verbs and re.fullmatch(pattern, path):
            return verbs[verb]
    raise AssertionError(f"the document has no {verb} {path}")


def _resolved(shape: dict[str, Any]) -> dict[str, Any]:
    while "$ref" in shape:
        shape = document()["components"]["schemas"][shape["$ref"].rsplit("/", 1)[-1]]
    return shape
