"""Generated reference pages of the documentation: API by subject, types, WebSocket, metrics, command line."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from typing import Any, Final

import typer

from hornbill.api.http import table_of
from hornbill.api.openapi.sharing import parameters_of
from hornbill.api.problems import COMMON, STATUS
from hornbill.api.routes.server.metrics import TABLE
from hornbill.api.security.roles import ANYBODY, HERE, Role, RouteTable, needed
from hornbill.app.settings import Settings
from hornbill.cli import app
from hornbill.cli.failing import MEANS, Exit
from hornbill.schema.catalog import Catalog

DO_NOT: Final = "<!-- Written by `make generate`. Do not edit. -->\n\n"
_ROW: Final = re.compile(r"/api/v1/servos/\{uid\}/parameters/[a-z0-9_]+$")
_SHAPE: Final = re.compile(r"\{shape (\w+)\}")
_PROBLEM: Final = "application/problem+json"


def pages(document: dict[str, Any]) -> dict[str, str]:
    """Text of every page, by its path in docs/reference; `document` is the OpenAPI document."""
    by_tag: dict[str, list[tuple[str, str, dict[str, Any]]]] = {}
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            by_tag.setdefault(operation.get("tags", ["server"])[0], []).append((method.upper(), path, operation))
    schemas = document["components"]["schemas"]
    made = {f"api/{tag}.md": _api_page(tag, found, document) for tag, found in by_tag.items()}
    made["api/README.md"] = _api_index(by_tag)
    made["api/types.md"] = _types(schemas)
    made["websocket.md"] = _websocket(schemas)
    made["metrics.md"] = _metrics()
    made["command-line.md"] = _command_line()
    return {path: DO_NOT + _lead(text, path).rstrip() + "\n" for path, text in made.items()}


def _lead(text: str, path: str) -> str:
    """With what `_type` marks as a shape leading to the page of shapes."""
    folder = "" if path.startswith("api/") else "api/"
    return _SHAPE.sub(lambda found: f"[{found[1]}]({folder}types.md#{found[1].lower()})", text)


def _api_index(by_tag: Mapping[str, list[tuple[str, str, dict[str, Any]]]]) -> str:
    lines = [
        "# The API", "",
        "REST below `/api/v1`, JSON both ways. A running server has the whole contract at "
        "`/api/v1/openapi.json`; the one of "
        "this version is [openapi.json](../../../schemas/generated/openapi.json). A failure has a status of 400 "
        "or more and "
        "`application/problem+json` with `code` and `detail`; every code is named where it may come. Any request may "
        "be refused before it reaches its operation; the routes below do not repeat these codes:", "",
        "| code | status |", "| --- | --- |",
        *(f"| `{code}` | {STATUS[code]} |" for code in COMMON), "",
        "| subject | routes |", "| --- | --- |",
    ]  # fmt: skip
    for tag in sorted(by_tag):
        shown = [f"`{method} {_short(path)}`" for method, path, _ in by_tag[tag] if not _ROW.match(path)]
        lines.append(f"| [{tag}]({tag}.md) | {', '.join(shown)} |")
    return "\n".join([*lines, "", "Bodies and responses: [types](types.md)."])


def _api_page(tag: str, found: Iterable[tuple[str, str, dict[str, Any]]], document: dict[str, Any]) -> str:
    schemas = document["components"]["schemas"]
    lines = [f"# API: {tag}", "", "Paths are below `/api/v1`. [All subjects](README.md)"]
    rows = 0
    for method, path, operation in found:
        if _ROW.match(path):
            rows += 1
            continue
        lines += [
            "",
            f"## {method} {_short(path)}",
            "",
            _text(operation.get("description", operation.get("summary", ""))),
        ]
        lines += ["", f"Needs: {_role(method, path)}."]
        lines += _parameters(parameters_of(document, operation), schemas)
        lines += _body(operation, schemas)
        lines += ["", "| status | answer |", "| --- | --- |"]
        answers = [(status, _whole(document, told)) for status, told in sorted(operation["responses"].items())]
        lines += [f"| {status} | {_answer(told, schemas)} |" for status, told in answers if status != "default"]
    if rows:
        lines += [
            "", "## GET and PUT /servos/{uid}/parameters/KEY", "",
            f"One route a row, {rows} in all: the keys, their units, ranges and meanings are in "
            "[the parameter manual](../../../schemas/generated/parameters.md). `PUT` takes `{\"value\"}` and "
            "answers the "
            "reading after it was written and read back.",
        ]  # fmt: skip
    return "\n".join(lines)


def _types(schemas: Mapping[str, Any]) -> str:
    lines = [
        "# API: types", "",
        "What bodies and answers are made of. `?`: may be left out. Paths are in [the API](README.md), the messages "
        "of the socket in [the WebSocket](../websocket.md), and what a row takes in "
        "[the parameter manual](../../../schemas/generated/parameters.md).",
    ]  # fmt: skip
    for name in sorted(filter(lambda one: _has_section(one, schemas), schemas)):
        lines += ["", f"## {name}", "", _text(schemas[name].get("description", "")), *_fields(schemas[name], schemas)]
    return "\n".join(lines)


def _has_section(name: str, schemas: Mapping[str, Any]) -> bool:
    return bool(schemas[name].get("properties")) and not name.endswith(("Value", "Message"))


def _parameters(declared: Iterable[Mapping[str, Any]], schemas: Mapping[str, Any]) -> list[str]:
    given = [one for one in declared if one["in"] != "path"]
    if not given:
        return []
    lines = ["", "| given | where | type | meaning |", "| --- | --- | --- | --- |"]
    for one in given:
        shape = one.get("schema", {})
        text = one.get("description") or shape.get("description", "")
        lines.append(f"| `{one['name']}` | {one['in']} | {_type(shape, schemas)} | {_cell(text)} |")
    return lines


def _body(operation: Mapping[str, Any], schemas: Mapping[str, Any]) -> list[str]:
    content = operation.get("requestBody", {}).get("content", {})
    lines: list[str] = []
    for media, told in content.items():
        shape = told.get("schema", {})
        lines += ["", f"Body, `{media}`: {_type(shape, schemas)}"]
        lines += _fields(_resolved(shape, schemas), schemas)
        for one in told.get("examples", {}).values():
            sent = json.dumps(one["value"], ensure_ascii=False)
            lines += ["", f"Example, {one['summary']}:", "", "```json", sent, "```"]
    return lines


def _fields(shape: Mapping[str, Any], schemas: Mapping[str, Any]) -> list[str]:
    fields: dict[str, Any] = shape.get("properties", {})
    if not fields:
        return []
    required = shape.get("required", ())
    lines = ["", "| field | type | meaning |", "| --- | --- | --- |"]
    for name, field in fields.items():
        need = "" if name in required or shape.get("title", "").endswith("Message") else "?"
        lines.append(f"| `{name}`{need} | {_type(field, schemas)} | {_cell(field.get('description', ''))} |")
    return lines


def _websocket(schemas: Mapping[str, Any]) -> str:
    lines = [
        "# The WebSocket", "",
        "`/api/v1/ws` carries what changes. Every message is a JSON object with `type`; those of the server "
        "have `seq`, too, which "
        "counts up. A slow reader gets fewer, larger messages and a count of what was `dropped`; it never slows "
        "the bus or "
        "anybody else. Subscribe to topics: `servos`, `telemetry`, `events`, `jobs`, `bus`, `frames`. A program "
        "that can set no "
        "header asks `POST /api/v1/tickets` and opens `/api/v1/ws?ticket=…` within 30 s.",
    ]  # fmt: skip
    for union, title in (("ClientMessage", "To the server"), ("ServerMessage", "From the server")):
        lines += ["", f"## {title}"]
        for one in schemas[union]["oneOf"]:
            shape = _resolved(one, schemas)
            word = shape["properties"]["type"].get("const", shape["title"])
            lines += ["", f"### {title.split()[0].lower()}: {word}", "", _text(shape.get("description", ""))]
            lines += _fields(
                {**shape, "properties": {k: v for k, v in shape["properties"].items() if k not in ("type", "seq")}},
                schemas,
            )
    return "\n".join(lines)


def _metrics() -> str:
    lines = [
        "# Metrics", "",
        "`GET /metrics`, in the text format of Prometheus. A counter's samples end in `_total`. "
        "A dashboard for Grafana is in `docs/grafana`.", "",
        "| name | kind | labels | meaning |", "| --- | --- | --- | --- |",
    ]  # fmt: skip
    for one in TABLE:
        labels = ", ".join(f"`{label}`" for label in one.labels)
        lines.append(f"| `{one.name}` | {one.kind} | {labels} | {_cell(one.help)} |")
    return "\n".join(lines)


def _command_line() -> str:
    lines = [
        "# The command line", "",
        "`hornbill COMMAND --help` says the same. Commands that ask a server find it by `--server` or "
        "`HORNBILL_URL`, and their token in `HORNBILL_TOKEN`.", "",
        "## Exit codes", "", "| code | means |", "| --- | --- |", *(f"| {int(one)} | {MEANS[one]} |" for one in Exit),
    ]  # fmt: skip
    lines += [
        "", "## Environment variables", "",
        "Of `hornbill demo` and `hornbill serve`; a word on the command line wins.", "",
        "| variable | default | meaning |", "| --- | --- | --- |",
    ]  # fmt: skip
    for name, field in Settings.model_fields.items():
        default = field.default if isinstance(field.default, (str, int, float)) and field.default != "" else None
        shown = "" if default is None or default is False else f"`{int(default) if default is True else default}`"
        lines.append(f"| `HORNBILL_{name.upper()}` | {shown} | {_cell(field.description or '')} |")
    lines += [
        "| `HORNBILL_URL` | `http://127.0.0.1:8000` | the server that other commands ask |",
        "| `HORNBILL_CONTAINER` | found out | 1: this is a container, 0: it is none |",
    ]
    command: Any = typer.main.get_command(app)
    for name, one in _commands(command, "hornbill"):
        lines += ["", f"## {name}", "", _text(one.help or "")]
        rows = [_option(each) for each in one.params if not getattr(each, "hidden", False)]
        if rows:
            lines += ["", "| word | default | meaning |", "| --- | --- | --- |", *rows]
    return "\n".join(lines)


def _commands(group: Any, before: str) -> Iterator[tuple[str, Any]]:
    for name, one in group.commands.items():
        if hasattr(one, "commands"):
            yield from _commands(one, f"{before} {name}")
        else:
            yield f"{before} {name}", one


def _option(one: Any) -> str:
    if one.param_type_name == "argument":
        word = f"`{one.metavar or str(one.name).upper()}`" + ("" if one.required else " (may be left out)")
    else:
        word = ", ".join(f"`{opt}`" for opt in (*one.opts, *one.secondary_opts))
    default = "" if one.default is None or one.default is False or callable(one.default) else f"`{one.default}`"
    return f"| {word} | {default} | {_cell(one.help or '')} |"


def _whole(document: Mapping[str, Any], told: Mapping[str, Any]) -> Mapping[str, Any]:
    """A response with what it shares with others."""
    shared = document["components"]["responses"].get(str(told.get("$ref", "")).rpartition("/")[2], {})
    return {**shared, **told}


def _answer(told: Mapping[str, Any], schemas: Mapping[str, Any]) -> str:
    content = told.get("content", {})
    shape: Mapping[str, Any] = content.get("application/json", {}).get("schema", {})
    kind = f" ({_type(shape, schemas)})" if shape and not str(shape.get("$ref", "")).endswith("/Problem") else ""
    media = [one for one in content if one not in ("application/json", _PROBLEM)]
    text = str(told.get("description", "")).replace("Successful Response", "done")
    return _cell(text + kind + "".join(f" `{one}`" for one in media))


def _type(shape: Mapping[str, Any], schemas: Mapping[str, Any]) -> str:
    if "$ref" in shape:
        resolved = _resolved(shape, schemas)
        name = str(shape["$ref"]).rsplit("/", 1)[-1]
        if "enum" in resolved:
            return _type(resolved, schemas)
        return f"{{shape {name}}}" if _has_section(name, schemas) else name
    if "const" in shape:
        return f"`{shape['const']}`"
    if "enum" in shape:
        return " / ".join(f"`{one}`" for one in shape["enum"])
    for word in ("anyOf", "oneOf"):
        if word in shape:
            return " or ".join(dict.fromkeys(_type(one, schemas) for one in shape[word]))
    kind = str(shape.get("type", "anything"))
    if kind == "array":
        return f"list of {_type(shape.get('items', {}), schemas)}"
    if kind == "object" and isinstance(shape.get("additionalProperties"), dict):
        return f"{_type(shape['additionalProperties'], schemas)} by key"
    low, high = shape.get("minimum", shape.get("exclusiveMinimum")), shape.get("maximum", shape.get("exclusiveMaximum"))
    if kind == "integer":
        low, high = (None if one is None else int(one) for one in (low, high))
    if low is not None or high is not None:
        return f"{kind} {'' if low is None else low}…{'' if high is None else high}"
    return kind


def _resolved(shape: Mapping[str, Any], schemas: Mapping[str, Any]) -> Mapping[str, Any]:
    return schemas[shape["$ref"].rsplit("/", 1)[-1]] if "$ref" in shape else shape


@lru_cache
def _table() -> RouteTable:
    return table_of(Catalog.load())


def _role(method: str, path: str) -> str:
    role = needed(_table().find(method, path))
    words = {ANYBODY: "nothing", HERE: "any token; none on this machine"}
    return words[role] if role in words else f"role `{Role(role).word}`"


def _short(path: str) -> str:
    return path.removeprefix("/api/v1")


def _text(text: str) -> str:
    return re.sub(r"\n(?!\n)", " ", text.strip())


def _cell(text: str) -> str:
    return re.sub(r"\s+", " ", text).replace("|", "\\|").strip()
