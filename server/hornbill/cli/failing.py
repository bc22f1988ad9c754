"""Exit codes, and the context manager that maps errors to them."""

import sys
from collections.abc import Generator
from contextlib import contextmanager
from enum import IntEnum
from typing import Final

import typer

from hornbill import errors
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
    INTERRUPTED = 130


MEANS: Final = {
    Exit.DONE: "success",
    Exit.FAILED: "invalid request, unexpected result, or differences found",
    Exit.USAGE: "invalid command line",
    Exit.SERVER_UNREACHABLE: "server unreachable",
    Exit.NO_RESPONSE: "no response from the servo; whether it acted is unknown",
    Exit.REFUSED: "rejected by the servo",
    Exit.BLOCKED: "currently blocked: stopped, busy, no bus, or another client has motion control",
    Exit.NOT_ALLOWED: "token missing, or role not sufficient",
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
    if isinstance(error, errors.NoResponse):
        return Exit.NO_RESPONSE
    if isinstance(error, errors.Refused):
        return Exit.REFUSED
    if isinstance(error, _BLOCKED):
        return Exit.BLOCKED
    return _BY_CODE.get(error.code, Exit.FAILED)


@contextmanager
def failures() -> Generator[None]:
    """Turn errors of hornbill into a line on standard error and an exit code."""
    try:
        yield
    except HornbillError as error:
        # Only problems of the server are printed with their code.
        print(error.detail if error.status is None else f"{error.code}: {error.detail}", file=sys.stderr)
        raise typer.Exit(code_of(error)) from None
    except KeyboardInterrupt:
        raise typer.Exit(Exit.INTERRUPTED) from None
