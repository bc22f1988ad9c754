"""Exit codes distinguish failures, and no failure exits with 0."""

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from functools import partial

import pytest
import typer
from typer.testing import CliRunner

from contract.test_doc_references import command_error
from hornbill import errors
from hornbill.api.remedies import REQUESTS
from hornbill.cli import app
from hornbill.cli.failing import Exit, code_of, errors_as_json, failures
from hornbill.cli.remedies import COMMANDS, detail
from hornbill.client import ServerUnreachable
from hornbill.client.problems import raised


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


def test_with_json_an_error_has_all_facts_of_the_problem(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    error = errors.OutOfRange("0 is below 1.", cause="outside_range", minimum=1, maximum=100, requested=0)
    error.status = 422
    errors_as_json.set(True)
    try:
        with pytest.raises(typer.Exit), failures():
            raise error
    finally:
        errors_as_json.set(False)
    assert json.loads(capsys.readouterr().err) == {
        "code": "out_of_range", "title": "Out of range", "status": 422, "detail": "0 is below 1.", "exit_code": 1,
        "cause": "outside_range", "minimum": 1, "maximum": 100, "requested": 0,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["list", "--server", "http://127.0.0.1:9"], "server_unreachable"),
        (["watch", "--server", "http://127.0.0.1:9"], "server_unreachable"),
        (["decode", "missing.log"], "log_failed"),
    ],
)
def test_the_option_selects_json_for_one_command(words: list[str], code: str) -> None:
    done = CliRunner().invoke(app, [*words, "--json"])
    found = json.loads(done.stderr)
    assert (found["code"], found["exit_code"]) == (code, done.exit_code)
    assert CliRunner().invoke(app, words).stderr.startswith(f"{code}: ")


@pytest.mark.parametrize(
    ("words", "port"),
    [
        ("list", 7),
        ("list --server http://127.0.0.1:8", 8),
        ("--server http://127.0.0.1:9 list", 9),
        ("--server http://127.0.0.1:9 bus show", 9),
        ("--server http://127.0.0.1:9 list --server http://127.0.0.1:8", 8),
    ],
)
def test_the_server_is_named_before_or_after_the_command_or_in_the_environment(words: str, port: int) -> None:
    done = CliRunner().invoke(app, words.split(), env={"HORNBILL_URL": "http://127.0.0.1:7"})
    assert f"http://127.0.0.1:{port}: " in done.stderr


@pytest.mark.parametrize("words", [("set", "S", "angle_p_gain"), ("sim",), ("set-up", "S", "arm_mm")])
def test_an_invalid_argument_is_a_usage_error(words: tuple[str, ...]) -> None:
    assert CliRunner().invoke(app, [*words]).exit_code == Exit.USAGE


def test_remedies_name_commands_for_the_same_causes_as_requests() -> None:
    """Except for what the command line does not do, such as streams."""
    missing = set(REQUESTS) - set(COMMANDS)
    assert missing == {"stream_not_found", "commanded_by_other_stream", "control_request_not_found"}
    assert set(COMMANDS) <= set(REQUESTS)
    for cause, command in COMMANDS.items():
        if command.startswith("hornbill "):
            assert command_error(_words(command), complete=False) == "", cause


def test_a_remedy_replaces_the_request_of_the_server() -> None:
    body = {
        "code": "torque_off", "cause": "torque_is_off", "detail": "Torque is off. Use: POST /api/v1/…", "uid": "a1",
        "summary": "Torque is off.",
    }  # fmt: skip
    assert detail(raised(409, body)) == "Torque is off. Use: hornbill move --torque-on, or hornbill torque a1 on."


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_simulated_servos_in_the_background_end_with_0(number: signal.Signals) -> None:
    words = [sys.executable, "-m", "hornbill", "sim", "--bus", "virtual:sim-ends"]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, text=True, preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_IGN)
    ) as process:  # as a shell without job control starts programs in the background
        assert process.stdout is not None
        process.stdout.readline()
        process.send_signal(number)
        assert process.wait(timeout=30) == 0


def _words(command: str) -> list[str]:
    """Arguments of the first command of a remedy, with examples in place of facts."""
    return command.partition(",")[0].format(uid="S", snapshot_id=7).split()[1:]
