"""Common options of commands, their client, and shell completion."""

import json
import sys
from collections.abc import Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hornbill.cli.failing import failures, use_json
from hornbill.errors import HornbillError

if TYPE_CHECKING:
    from hornbill.client import Hornbill

COMPLETE_WITHIN_S = 1.0
"""Response timeout for shell completion."""


@contextmanager
def client(server: str) -> "Generator[Hornbill]":
    """Client of the server. Errors in the block end the command with an exit code."""
    with failures(), _client_class()(server, by="command line", tries=1) as hornbill:
        yield hornbill


def _client_class() -> "type[Hornbill]":
    """The class of the client. Importing httpx is most of the time of a command."""
    # httpx imports its own command line, with rich and pygments, if it can: a third of its import.
    sys.modules.setdefault("httpx._main", None)  # pyright: ignore[reportArgumentType, reportCallIssue]
    from hornbill.client import Hornbill

    return Hornbill


def complete_servo(context: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Labels, else serials, of the servos that the server knows, with the model as help."""
    named = [(one["label"] or one["serial"] or one["uid"], one["model"] or "") for one in _fetch(context, "/servos")]
    return [(name, model) for name, model in named if name.lower().startswith(incomplete.lower())]


def complete_key(context: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Parameter keys."""
    return [(one["key"], one["label"]) for one in _rows(context) if one["key"].startswith(incomplete)]


def complete_job(context: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Jobs, newest first."""
    jobs = _fetch(context, "/jobs")
    return [(one["id"], f"{one['kind']}, {one['state']}") for one in jobs if one["id"].startswith(incomplete)]


def complete_change(context: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """`key=` of writable parameters, then the choices of the row."""
    rows = {one["key"]: one for one in _rows(context) if one["access"] == "rw"}
    key, equals, _ = incomplete.partition("=")
    if not equals:
        return [(f"{name}=", row["label"]) for name, row in rows.items() if name.startswith(incomplete)]
    if key not in rows:
        return []
    words = ["true", "false"] if rows[key]["kind"] == "switch" else [one["key"] for one in rows[key]["choices"]]
    return [(f"{key}={word}", "") for word in words if f"{key}={word}".startswith(incomplete)]


def _rows(context: typer.Context) -> list[dict[str, Any]]:
    found: Any = _fetch(context, "/schema")
    return found["parameters"] if found else []


def _fetch(context: typer.Context, path: str) -> list[dict[str, Any]]:
    """Response of the server, empty on failure: completion must never print an error."""
    try:
        with _client_class()(context.params.get("server"), tries=1, timeout_s=COMPLETE_WITHIN_S) as hornbill:
            return hornbill.request("GET", path)
    except HornbillError:
        return []


def parse_value(text: str) -> bool | int | float | str:
    """Value from text: a number, true or false, else the text itself."""
    try:
        value = json.loads(text)
    except ValueError:
        return text
    return value if isinstance(value, (bool, int, float)) else text


def changes_of(words: list[str]) -> dict[str, bool | int | float | str]:
    """Values by key from arguments KEY=VALUE. A malformed one is a usage error."""
    found: dict[str, bool | int | float | str] = {}
    for word in words:
        key, equals, value = word.partition("=")
        if not equals:
            raise typer.BadParameter(f"Invalid argument {word!r}. Use KEY=VALUE, for example angle_p_gain=40.")
        found[key.strip()] = parse_value(value.strip())
    return found


LOCAL_URL = "http://127.0.0.1:8000"
SERVO_HELP = "Label, serial or unique ID (or its first digits)."


def _server(context: typer.Context, given: str) -> str:
    """Address after the command, else before it, else HORNBILL_URL, else this computer."""
    before: str | None = context.find_root().params.get("server")
    source = context.get_parameter_source("server")
    return before if before and source is not None and source.name != "COMMANDLINE" else given


Server = Annotated[
    str,
    typer.Option(
        envvar="HORNBILL_URL",
        help="Address of the server, before or after the command. The token is read from HORNBILL_TOKEN.",
        callback=_server,
    ),
]
AnyServer = Annotated[
    str | None, typer.Option("--server", metavar="URL", help="Address of the server, for commands that use one.")
]
"""The same before the command."""
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, also errors (to standard error).", callback=use_json)]
AsJsonLines = Annotated[
    bool,
    typer.Option("--json", help="Print one JSON object per line, also errors (to standard error).", callback=use_json),
]
ServoName = Annotated[
    str, typer.Argument(metavar="SERVO", help=SERVO_HELP, autocompletion=complete_servo),
]  # fmt: skip
Key = Annotated[str | None, typer.Argument(help="Parameter key. Default: all parameters.", autocompletion=complete_key)]
Changes = Annotated[
    list[str], typer.Argument(metavar="KEY=VALUE…", help="One or more changes.", autocompletion=complete_change)
]
Save = Annotated[bool, typer.Option(help="Also save to ROM: the servo restarts and its horn may move.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Check everything and show the result without changing it.")]
Identity = Annotated[bool, typer.Option("--identity", help="Include origin, servo ID and node ID.")]
Confirm = Annotated[
    list[str] | None,
    typer.Option(metavar="CODE", help="Confirmation code of a 'needs_confirmation' problem. Repeatable."),
]
