"""Exit codes, and the context manager that maps errors to them."""

import json
import sys
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from enum import IntEnum
from typing import Final

import typer

from hornbill import errors
from hornbill.cli import remedies
from hornbill.errors import HornbillError


class Exit(IntEnum):
    """Exit code of a command. Scripts depend on them, so they never change. See also docs/rigs.md."""

    DONE = 0
    FAILED = 1
    USAGE = 2
    SERVER_UNREACHABLE = 3
    NO_RESPONSE = 4
    REFUSED = 5
    BLOCKED = 6
    NOT_ALLOWED = 7
    CANNOT_START = 8
    CANNOT_START_NOW = 9
    INTERRUPTED = 130


MEANS: Final = {
    Exit.DONE: "success",
    Exit.FAILED: "invalid request, unexpected result, or differences found",
    Exit.USAGE: "invalid command line or setting",
    Exit.SERVER_UNREACHABLE: "server unreachable",
    Exit.NO_RESPONSE: "no response from the servo; whether it acted is unknown",
    Exit.REFUSED: "rejected by the servo",
    Exit.BLOCKED: "currently blocked: stopped, busy, no bus, or another client has motion control",
    Exit.NOT_ALLOWED: "token missing, or role not sufficient",
    Exit.CANNOT_START: "database, data folder, certificate or port needs a correction; a retry does not help",
    Exit.CANNOT_START_NOW: "port, database or bench in use, or database server unreachable; a retry may help",
    Exit.INTERRUPTED: "Ctrl-C",
}
"""Description of every exit code."""


_BLOCKED = (
    errors.Stopped, errors.Busy, errors.LeaseHeld, errors.LeaseRequired, errors.PortError, errors.StaleRevision,
)  # fmt: skip
_BY_CODE = {
    "server_unreachable": Exit.SERVER_UNREACHABLE,
    "unauthorized": Exit.NOT_ALLOWED,
    "forbidden_role": Exit.NOT_ALLOWED,
    "forbidden_origin": Exit.NOT_ALLOWED,
}


def code_of(error: HornbillError) -> Exit:
    """Exit code of an error."""
    if error.status is None and isinstance(error, (errors.CannotStart, errors.StoreFailed)):
        if error.facts.get("part") in ("settings", "access"):
            return Exit.USAGE
        return Exit.CANNOT_START_NOW if error.facts.get("retry") else Exit.CANNOT_START
    if isinstance(error, errors.NoResponse):
        return Exit.NO_RESPONSE
    if isinstance(error, errors.Refused):
        return Exit.REFUSED
    if isinstance(error, _BLOCKED):
        return Exit.BLOCKED
    return _BY_CODE.get(error.code, Exit.FAILED)


errors_as_json: ContextVar[bool] = ContextVar("errors_as_json", default=False)
"""Whether errors are printed as JSON."""


def use_json(context: typer.Context, chosen: bool) -> bool:
    """Print errors as JSON, too, until the command ends: callback of --json."""
    if chosen:
        errors_as_json.set(True)
        context.call_on_close(lambda: errors_as_json.set(False))
    return chosen


def _problem(error: HornbillError) -> str:
    """A problem as one line of JSON: all of the server's facts, and the exit code."""
    shown = {
        "code": error.code, "title": error.title, "status": error.status, "detail": remedies.detail(error),
        "exit_code": int(code_of(error)),
    }  # fmt: skip
    facts = {name: fact for name, fact in error.facts.items() if name not in shown and fact is not None}
    return json.dumps({**shown, **facts}, ensure_ascii=False, default=str)


@contextmanager
def failures() -> Generator[None]:
    """Turn errors of hornbill into a line on standard error and an exit code."""
    try:
        yield
    except HornbillError as error:
        print(_problem(error) if errors_as_json.get() else f"{error.code}: {remedies.detail(error)}", file=sys.stderr)
        raise typer.Exit(code_of(error)) from None
    except KeyboardInterrupt:
        raise typer.Exit(Exit.INTERRUPTED) from None
