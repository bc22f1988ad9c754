"""Exit codes distinguish failures, and no failure exits with 0."""

from collections.abc import Iterator

import pytest
import typer

from hornbill import errors
from hornbill.cli.failing import Exit, code_of, failures
from hornbill.client import ServerUnreachable


def classes(root: type[errors.HornbillError]) -> Iterator[type[errors.HornbillError]]:
    yield root
    for child in root.__subclasses__():
        yield from classes(child)


def test_every_error_has_an_exit_code() -> None:
    for kind in classes(errors.HornbillError):
        error = kind("unknown_servo", "x", cause=None) if kind is errors.Unknown else kind("x", cause=None)
        assert code_of(error) not in (Exit.DONE, Exit.USAGE, Exit.INTERRUPTED), kind


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (ServerUnreachable("x", cause=None, sent=False), Exit.SERVER_UNREACHABLE),
        (errors.NoResponse("x", cause=None), Exit.NO_RESPONSE),
        (errors.Refused("x", cause=None), Exit.REFUSED),
        (errors.Stopped("x", cause=None), Exit.BLOCKED),
        (errors.Busy("x", cause=None), Exit.BLOCKED),
        (errors.LeaseHeld("x", cause=None), Exit.BLOCKED),
        (errors.BusDisconnected("x", cause=None), Exit.BLOCKED),
        (errors.Unauthorized("x", cause=None), Exit.NOT_ALLOWED),
        (errors.ForbiddenRole("x", cause=None), Exit.NOT_ALLOWED),
        (errors.OutOfRange("x", cause=None), Exit.FAILED),
        (errors.UnexpectedResult("x", cause=None), Exit.FAILED),
    ],
)
def test_exit_code_of_an_error(error: errors.HornbillError, code: Exit) -> None:
    with pytest.raises(typer.Exit) as caught, failures():
        raise error
    assert caught.value.exit_code == code


def test_exit_codes_are_stable() -> None:
    assert [(one.name, int(one)) for one in Exit] == [
        ("DONE", 0), ("FAILED", 1), ("USAGE", 2), ("SERVER_UNREACHABLE", 3), ("NO_RESPONSE", 4), ("REFUSED", 5),
        ("BLOCKED", 6), ("NOT_ALLOWED", 7), ("CANNOT_START", 8), ("CANNOT_START_NOW", 9), ("INTERRUPTED", 130),
    ]  # fmt: skip


def test_a_problem_is_printed_with_its_code(capsys: pytest.CaptureFixture[str]) -> None:
    error = errors.OutOfRange("0 is below this model's limit of 1.", cause=None)
    error.status = 422
    with pytest.raises(typer.Exit), failures():
        raise error
    assert capsys.readouterr().err == "out_of_range: 0 is below this model's limit of 1.\n"
