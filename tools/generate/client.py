"""Generated modules of hornbill.client: response types from the OpenAPI document, and the client without await."""

import re
import subprocess
import sys
import textwrap
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

CLIENT = Path(__file__).parents[2] / "server" / "hornbill" / "client"

ANSWERS = (
    "Adapter", "AllocationChange", "Allocations", "AllocatorState", "AuditRow", "BatchPatched", "BatchRead",
    "BurstSent", "Bus", "Candidates", "Caution", "Commanded", "CommissioningPreview", "Comparison", "Drift", "Fault",
    "FaultsRead", "Finding", "Forecast", "Health", "Imported", "Job", "KnownServo", "Lease", "LeaseView", "LogFile",
    "LogState", "Node", "OutputRestorePreview", "Parameters", "ParametersPatched", "PositionUnitState", "Profile",
    "Reading", "RecorderState", "Recording", "RecordingContent", "Recycled", "ResetPreview", "Restored", "RunOverlay",
    "SavePreview", "SchemaDocument", "Servo", "Snapshot", "StepRun", "Stop", "Stream", "Telemetry", "TelemetryGrant",
)  # fmt: skip
"""Answers a program gets; what they are made of comes with them."""

SYNC = (
    (r"\basync (def|with|for)\b", r"\1"),
    (r"\bawait ", ""),
    (r"\bAsync(?=[A-Z])", ""),
    (r"\b__a(enter|exit)__", r"__\1__"),
    (r"\baclose\b", "close"),
    (r"\basyncio\b", "time"),
    (r"client\.aio\b", "client.sync"),
    (r"\bAsyncClient\b", "Client"),
    (r"\bAsyncBaseTransport\b", "BaseTransport"),
)
_TYPES = {"string": "str", "integer": "int", "number": "float", "boolean": "bool", "null": "None"}


def files(document: dict[str, Any]) -> dict[Path, str]:
    """Text of every file of the client that is made, by its path below hornbill/client."""
    found = {
        Path("answers.py"): _tidy(answers(document["components"]["schemas"])),
        Path(
            "sync", "__init__.py"
        ): '"""Client without asyncio. Made from hornbill.client.aio by `make generate`."""\n',
    }
    for source in sorted((CLIENT / "aio").glob("[!_]*.py")):
        found[Path("sync", source.name)] = _tidy(without_await(source.read_text(encoding="utf-8")))
    return found


def without_await(source: str) -> str:
    """The same program without asyncio."""
    for pattern, instead in SYNC:
        source = re.sub(pattern, instead, source)
    end = source.index('"""', 3) + 3
    return source[:end] + "\n\n# Made from hornbill.client.aio by `make generate`: change it there.\n" + source[end:]


def answers(schemas: dict[str, Any]) -> str:
    """A TypedDict for every answer and every object within one; an alias for what is not an object with fields."""
    text = [
        '"""The types of what the API answers. Made from its document by `make generate`."""',
        "from __future__ import annotations",
        "from typing import Any, Literal, TypeAlias, TypedDict",
    ]
    used = _within(schemas, ANSWERS)
    aliases = {name for name in used if "properties" not in schemas[name] or name.endswith("ByKey")}
    for name in sorted(used - aliases):
        shape = schemas[name]
        text.append(f"class {name}(TypedDict):\n    {_said(shape.get('description', name))}\n")
        for key, kind in shape["properties"].items():
            assert key.isidentifier(), f"{name}.{key} cannot be written so"
            text += [f"    {key}: {_type(kind)}", *(f"    {one}" for one in _explained(kind))]
    # Classes may name what comes later, aliases not.
    for name in TopologicalSorter(
        {one: sorted(_named(schemas[one]) & aliases) for one in sorted(aliases)}
    ).static_order():
        text += [f"{name}: TypeAlias = {_type(schemas[name])}", *_explained(schemas[name])]
    return "\n".join(text) + "\n"


def _within(schemas: dict[str, Any], names: tuple[str, ...]) -> set[str]:
    seen: set[str] = set()
    waiting = set(names)
    while waiting:
        name = waiting.pop()
        seen.add(name)
        waiting |= _named(schemas[name]) - seen
    return seen


def _named(shape: dict[str, Any]) -> set[str]:
    """The components a shape refers to."""
    return set(re.findall(r"'#/components/schemas/(\w+)'", str(shape)))


def _explained(shape: dict[str, Any]) -> list[str]:
    """The docstring of a field or an alias that is described."""
    return [_said(shape["description"])] if "description" in shape else []


def _type(kind: dict[str, Any]) -> str:
    match kind:
        case {"$ref": ref}:
            return str(ref).rsplit("/", 1)[-1]
        case {"anyOf": kinds} | {"oneOf": kinds}:
            return " | ".join(dict.fromkeys(_type(one) for one in kinds))
        case {"const": value}:
            return f"Literal[{value!r}]"
        case {"enum": values}:
            return f"Literal[{', '.join(map(repr, values))}]"
        case {"type": "array"}:
            return f"list[{_type(kind.get('items', {}))}]"
        case {"type": "object", "properties": fields}:  # a set by key, to loop over: what its values have in common
            kinds = {_type(one) for one in fields.values()}
            return f"dict[str, {'Reading' if len(kinds) > 1 else kinds.pop()}]"
        case {"type": "object"}:
            of: Any = kind.get("additionalProperties")
            return f"dict[str, {_type(of) if of not in (None, True, False) else 'Any'}]"
        case {"type": str(name)} if name in _TYPES:
            return _TYPES[name]
        case _:
            return "Any"


def _said(text: str) -> str:
    """A docstring, four columns in."""
    plain = text.replace("\\", "\\\\").replace('"""', "'''").rstrip('"')
    return f'"""{textwrap.fill(" ".join(plain.split()), 108, subsequent_indent="    ")}"""'


def _tidy(source: str) -> str:
    """As `make check` wants it."""
    for command in (["check", "--quiet", "--fix", "--select", "I,F401"], ["format", "--quiet"]):
        run = [sys.executable, "-m", "ruff", *command, "--stdin-filename", str(CLIENT / "made.py"), "-"]
        source = subprocess.run(run, input=source, capture_output=True, text=True, check=True).stdout
    return source
