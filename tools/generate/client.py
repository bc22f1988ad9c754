"""Generated modules of hornbill.client: response types from the OpenAPI document, and the synchronous client."""

import re
import subprocess
import sys
import textwrap
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

CLIENT = Path(__file__).parents[2] / "server" / "hornbill" / "client"

RESPONSES = (
    "Adapter", "AllocationChange", "Allocations", "AllocatorState", "AuditRow", "BatchPatched", "BatchRead",
    "BurstSent", "Bus", "Candidates", "Caution", "Commanded", "CommissioningPreview", "Comparison", "Drift",
    "EventMessage", "Failsafe", "Fault", "FaultsRead", "Finding", "Forecast", "FrequencyResponse", "Health",
    "Imported", "ImportedPlan", "ImprovePreview", "Job", "KnownServo", "Lease", "LeaseView", "LogFile", "LogState",
    "Mechanics", "Node", "OutputRestorePreview", "ParameterFile", "Parameters", "ParametersPatched", "PlanOutput",
    "PlanPreview", "PositionUnitState", "Profile", "Reading", "RecorderState", "Recording", "RecordingContent",
    "Recycled", "ResetPreview", "Restored", "RunOverlay", "SavePreview", "SchemaDocument", "Servo", "SetUp",
    "SimAutopilot", "SimChaos", "SimClock", "SimInjection", "SimServo", "SimTruth", "SiteBench", "Snapshot",
    "StepRun", "Stop", "Stream", "Telemetry", "TelemetryGrant", "Tuning", "Verification",
)  # fmt: skip
"""Responses of the client methods; the types they contain are added."""

REQUESTS = ("SimBehaviour", "NewSimServo", "SimAutopilotChange", "SimChange", "SimOutputChange")
"""Bodies that client methods take as keywords."""

SYNC = (
    (r"\basync (def|with|for)\b", r"\1"),
    (r"\bawait ", ""),
    (r"\bAsync(?=[A-Z])", ""),
    (r"\b__a(enter|exit)__", r"__\1__"),
    (r"\baclose\b", "close"),
    (r"\basynccontextmanager\b", "contextmanager"),
    (r"\baclosing\b", "closing"),
    (r"\ba(iter_lines|read)\b", r"\1"),
    (r"\basyncio\b", "time"),
    (r"client\.aio\b", "client.sync"),
    (r"\bAsyncClient\b", "Client"),
    (r"\bAsyncBaseTransport\b", "BaseTransport"),
)
_TYPES = {"string": "str", "integer": "int", "number": "float", "boolean": "bool", "null": "None"}


def files(document: dict[str, Any]) -> dict[Path, str]:
    """Text of every generated file of the client, by its path below hornbill/client."""
    found = {
        Path("responses.py"): _tidy(responses(document["components"]["schemas"])),
        Path(
            "sync", "__init__.py"
        ): '"""Client without asyncio. Generated from hornbill.client.aio by `make generate`."""\n',
    }
    for source in sorted((CLIENT / "aio").glob("[!_]*.py")):
        found[Path("sync", source.name)] = _tidy(synchronous(source.read_text(encoding="utf-8")))
    return found


def synchronous(source: str) -> str:
    """The same source without asyncio."""
    for pattern, instead in SYNC:
        source = re.sub(pattern, instead, source)
    end = source.index('"""', 3) + 3
    note = "\n\n# Generated from hornbill.client.aio by `make generate`. Edit the source there.\n"
    return source[:end] + note + source[end:]


def responses(schemas: dict[str, Any]) -> str:
    """A TypedDict for every response and every object in it; an alias for every other type."""
    text = [
        '"""Types of the API\'s responses. Generated from the OpenAPI document by `make generate`."""',
        "from __future__ import annotations",
        "from typing import Any, Literal, Required, TypeAlias, TypedDict",
    ]
    used = _within(schemas, (*RESPONSES, *REQUESTS))
    aliases = {name for name in used if "properties" not in schemas[name] or name.endswith("ByKey")}
    for name in sorted(used - aliases):
        shape = schemas[name]
        partial = name in REQUESTS
        base = "TypedDict, total=False" if partial else "TypedDict"
        text.append(f"class {name}({base}):\n    {_docstring(shape.get('description', name))}\n")
        for key, kind in shape["properties"].items():
            assert key.isidentifier(), f"{name}.{key} is not an identifier"
            required = partial and key in shape.get("required", ())
            shown = f"Required[{_type(kind)}]" if required else _type(kind)
            text += [f"    {key}: {shown}", *(f"    {line}" for line in _description(kind))]
    # Classes may refer to later definitions, aliases may not.
    for name in TopologicalSorter(
        {one: sorted(_named(schemas[one]) & aliases) for one in sorted(aliases)}
    ).static_order():
        text += [f"{name}: TypeAlias = {_type(schemas[name])}", *_description(schemas[name])]
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
    """Components that a shape refers to."""
    return set(re.findall(r"'#/components/schemas/(\w+)'", str(shape)))


def _description(shape: dict[str, Any]) -> list[str]:
    """Docstring of a field or an alias with a description."""
    return [_docstring(shape["description"])] if "description" in shape else []


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
        case {"type": "object", "properties": fields}:  # a set by key: the common type of its values
            kinds = {_type(one) for one in fields.values()}
            return f"dict[str, {'Reading' if len(kinds) > 1 else kinds.pop()}]"
        case {"type": "object"}:
            of: Any = kind.get("additionalProperties")
            return f"dict[str, {_type(of) if of not in (None, True, False) else 'Any'}]"
        case {"type": str(name)} if name in _TYPES:
            return _TYPES[name]
        case _:
            return "Any"


def _docstring(text: str) -> str:
    """Docstring with an indent of four columns."""
    plain = text.replace("\\", "\\\\").replace('"""', "'''").rstrip('"')
    return f'"""{textwrap.fill(" ".join(plain.split()), 108, subsequent_indent="    ")}"""'


def _tidy(source: str) -> str:
    """Source as linted and formatted by ruff."""
    for command in (["check", "--quiet", "--fix", "--select", "I,F401"], ["format", "--quiet"]):
        run = [sys.executable, "-m", "ruff", *command, "--stdin-filename", str(CLIENT / "generated.py"), "-"]
        source = subprocess.run(run, input=source, capture_output=True, text=True, check=True).stdout
    return source
