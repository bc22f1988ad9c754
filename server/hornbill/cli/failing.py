"""Exit codes: what a failure is called at the end of a command, and the one place that catches it."""

import sys
from collections.abc import Generator
from contextlib import contextmanager
from enum import IntEnum
from typing import Final

import typer

from hornbill import errors
from hornbill.errors import HornbillError


class Exit(IntEnum):
    """What a command ends with; scripts branch on it, so numbers never change. Also in docs/rigs.md."""

    DONE = 0
    FAILED = 1
    USAGE = 2
    NO_SERVER = 3
    NO_RESPONSE = 4
    REFUSED = 5
    BLOCKED = 6
    NOT_ALLOWED = 7
    INTERRUPTED = 130


MEANS: Final = {
    Exit.DONE: "done",
    Exit.FAILED: "it cannot be done as asked, or was found not to be as wanted",
    Exit.USAGE: "wrong words on the command line",
    Exit.NO_SERVER: "no server",
    Exit.NO_RESPONSE: "the servo did not answer: nobody knows whether it acted",
    Exit.REFUSED: "the servo said no",
    Exit.BLOCKED: "not now: stopped, busy, somebody else has motion control, no bus",
    Exit.NOT_ALLOWED: "no token, or one that may not do this",
    Exit.INTERRUPTED: "Ctrl-C",
}
"""Every exit code for people."""


_BLOCKED = (
    errors.Stopped, errors.Busy, errors.LeaseHeld, errors.LeaseRequired, errors.PortError, errors.StaleRevision,
)  # fmt: skip
_BY_CODE = {
    "no_server": Exit.NO_SERVER,
    "unauthorized": Exit.NOT_ALLOWED,
    "forbidden_role": Exit.NOT_ALLOWED,
    "forbidden_origin": Exit.NOT_ALLOWED,
}


def code_of(error: HornbillError) -> Exit:
    """The exit code of an error."""
    if isinstance(error, errors.NoResponse):
        return Exit.NO_RESPONSE
    if isinstance(error, errors.Refused):
        return Exit.REFUSED
    if isinstance(error, _BLOCKED):
        return Exit.BLOCKED
    return _BY_CODE.get(error.code, Exit.FAILED)


@contextmanager
def failures() -> Generator[None]:
    """Whatever hornbill raises becomes a line on standard error and an exit code."""
    try:
        yield
    except HornbillError as error:
        # A server's problem has a code to look up; what fails right here is a sentence.
        print(error.detail if error.status is None else f"{error.code}: {error.detail}", file=sys.stderr)
        raise typer.Exit(code_of(error)) from None
    except KeyboardInterrupt:
        raise typer.Exit(Exit.INTERRUPTED) from None
