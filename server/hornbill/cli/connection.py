"""How commands reach a server: the options all of them have, the client, and what the shell can complete."""

import json
from collections.abc import Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hornbill.cli.failing import failures
from hornbill.errors import HornbillError, InvalidValue

if TYPE_CHECKING:
    from hornbill.client import Hornbill

COMPLETE_WITHIN_S = 1.0
"""A shell waits so long for a server when somebody presses Tab."""


@contextmanager
def client(server: str) -> "Generator[Hornbill]":
    """A client of the server; whatever fails in the block ends the command with its exit code."""
    from hornbill.client import Hornbill

    with failures(), Hornbill(server, by="command line", tries=1) as hornbill:
        yield hornbill


def complete_servo(context: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Labels, or else serials, of the servos the server knows, with the model as help."""
    named = [(one["label"] or one["serial"] or one["uid"], one["model"] or "") for one in _at_once(context, "/servos")]
    return [(name, model) for name, model in named if name.lower().startswith(incomplete.lower())]


def complete_key(context: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Keys of parameters."""
    return [(one["key"], one["label"]) for one in _rows(context) if one["key"].startswith(incomplete)]


def complete_job(context: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Jobs, the newest first."""
    jobs = reversed(_at_once(context, "/jobs"))
    return [(one["id"], f"{one['kind']}, {one['state']}") for one in jobs if one["id"].startswith(incomplete)]


def complete_change(context: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """`key=` of parameters that can be written, and after it the choices of the row."""
    rows = {one["key"]: one for one in _rows(context) if one["access"] == "rw"}
    key, equals, _ = incomplete.partition("=")
    if not equals:
        return [(f"{name}=", row["label"]) for name, row in rows.items() if name.startswith(incomplete)]
    if key not in rows:
        return []
    words = ["true", "false"] if rows[key]["kind"] == "switch" else [one["key"] for one in rows[key]["choices"]]
    return [(f"{key}={word}", "") for word in words if f"{key}={word}".startswith(incomplete)]


def _rows(context: typer.Context) -> list[dict[str, Any]]:
    found: Any = _at_once(context, "/schema")
    return found["parameters"] if found else []


def _at_once(context: typer.Context, path: str) -> list[dict[str, Any]]:
    """What the server says, or nothing: a shell that completes must never print an error."""
    from hornbill.client import Hornbill

    try:
        with Hornbill(context.params.get("server"), tries=1, timeout_s=COMPLETE_WITHIN_S) as hornbill:
            return hornbill.ask("GET", path)
    except HornbillError:
        return []


def typed(text: str) -> bool | int | float | str:
    """What somebody typed: a number or true/false where it is one, else a word."""
    try:
        value = json.loads(text)
    except ValueError:
        return text
    return value if isinstance(value, (bool, int, float)) else text


def changes_of(words: list[str]) -> dict[str, bool | int | float | str]:
    """Values by key of words `KEY=VALUE`. Raises InvalidValue for a word that is none."""
    found: dict[str, bool | int | float | str] = {}
    for word in words:
        key, equals, value = word.partition("=")
        if not equals:
            raise InvalidValue(f"{word!r} is no change. Write KEY=VALUE, for example angle_p_gain=40.", cause=None)
        found[key.strip()] = typed(value.strip())
    return found


HERE = "http://127.0.0.1:8000"
Server = Annotated[
    str, typer.Option(envvar="HORNBILL_URL", help="address of a running server; its token is read from HORNBILL_TOKEN")
]
AsJson = Annotated[bool, typer.Option("--json", help="print JSON")]
Which = Annotated[
    str,
    typer.Argument(metavar="SERVO", help="uid (or the start of it), label or serial", autocompletion=complete_servo),
]
Key = Annotated[str | None, typer.Argument(help="parameter; all unless given", autocompletion=complete_key)]
Changes = Annotated[list[str], typer.Argument(metavar="KEY=VALUE…", help="one or more", autocompletion=complete_change)]
Confirm = Annotated[
    list[str] | None,
    typer.Option(metavar="WORD", help="word that an earlier 'needs_confirmation' asked for; may be repeated"),
]
