"""Failures at start: each is one sentence with a remedy and its exit code, from `serve` and `check` alike."""

import gc
import json
import os
import sqlite3
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from socket import socket

import pytest
from typer.testing import CliRunner

from hornbill.app.serving import listen
from hornbill.cli import app
from hornbill.errors import CannotStart
from hornbill.store import database as databases
from hornbill.store.data_folder import FILE_NAME, FIRST_TOKEN
from hornbill.store.store import Store

TOKEN = "long-enough-a-token"
Fault = Callable[[Path, ExitStack, pytest.MonkeyPatch], list[str]]
"""Causes a failure for the data folder, and returns more arguments."""


def write(content: bytes) -> Fault:
    def fault(folder: Path, _stack: ExitStack, _patch: pytest.MonkeyPatch) -> list[str]:
        (folder / FILE_NAME).write_bytes(content)
        return []

    return fault


def truncated(folder: Path, _stack: ExitStack, _patch: pytest.MonkeyPatch) -> list[str]:
    Store(folder).close()
    file = folder / FILE_NAME
    os.truncate(file, file.stat().st_size // 2)
    return []


def newer(folder: Path, _stack: ExitStack, _patch: pytest.MonkeyPatch) -> list[str]:
    Store(folder).close()
    with closing(sqlite3.connect(folder / FILE_NAME)) as database:
        database.execute("UPDATE alembic_version SET version_num = '9999'")
        database.commit()
    return []


def locked(folder: Path, stack: ExitStack, patch: pytest.MonkeyPatch) -> list[str]:
    Store(folder).close()
    patch.setattr(databases, "OPEN_TIMEOUT_S", 0.05)
    other = stack.enter_context(closing(sqlite3.connect(folder / FILE_NAME, isolation_level=None)))
    other.execute("PRAGMA locking_mode = EXCLUSIVE").close()
    other.execute("BEGIN EXCLUSIVE")
    other.execute("CREATE TABLE held (x INTEGER)")
    return []


def no_driver(_folder: Path, _stack: ExitStack, patch: pytest.MonkeyPatch) -> list[str]:
    patch.setitem(sys.modules, "psycopg", None)
    return ["--database", "postgresql://bench:secret@127.0.0.1:1/bench"]


def folder_is_a_file(folder: Path, _stack: ExitStack, _patch: pytest.MonkeyPatch) -> list[str]:
    (folder / "file").write_text("")
    return ["--data-dir", str(folder / "file")]


def read_only(_folder: Path, _stack: ExitStack, patch: pytest.MonkeyPatch) -> list[str]:
    def access(_path: object, mode: int) -> bool:  # root may write anywhere
        return not mode & os.W_OK

    patch.setattr(os, "access", access)
    return []


def port_in_use(_folder: Path, stack: ExitStack, _patch: pytest.MonkeyPatch) -> list[str]:
    other = stack.enter_context(socket())
    other.bind(("127.0.0.1", 0))
    other.listen()
    return ["--port", str(other.getsockname()[1])]


def certificate(folder: Path, _stack: ExitStack, _patch: pytest.MonkeyPatch) -> list[str]:
    (folder / "x.pem").write_text("no certificate")
    return ["--tls-cert", str(folder / "x.pem"), "--tls-key", str(folder / "x.pem")]


def words(*given: str, **environment: str) -> Fault:
    def fault(_folder: Path, _stack: ExitStack, patch: pytest.MonkeyPatch) -> list[str]:
        for name, value in environment.items():
            patch.setenv(name, value)
        return [*given]

    return fault


FAULTS: dict[str, tuple[Fault, int, str, str]] = {
    "garbage": (write(b"a holiday photograph" * 300), 8, "file is not a database", "hornbill restore FILE"),
    "truncated": (truncated, 8, "malformed", "hornbill restore FILE"),
    "newer": (newer, 8, "written by a newer hornbill (tables 9999)", "Install that version"),
    "locked": (locked, 9, "database is locked", "End that process"),
    "driver": (no_driver, 8, "package psycopg is not installed", "pip install 'hornbill[postgres]'"),
    "unreachable": (
        words("--database", "postgresql://bench:secret@127.0.0.1:1/bench"), 9, "onnection refused",
        "Check that the database server runs",
    ),
    "address": (words("--database", "nosuchkind://x/y"), 8, "is not a usable database", "--database URL"),
    "a file": (folder_is_a_file, 8, "is a file", "--data-dir FOLDER"),
    "not created": (words("--data-dir", "/proc/hornbill"), 8, "/proc/hornbill cannot be created", "--data-dir FOLDER"),
    "read-only": (read_only, 8, "is not writable", "--data-dir FOLDER"),
    "port in use": (port_in_use, 9, "Cannot listen on port", "Choose another port with --port"),
    "no such address": (words("--host", "192.0.2.7", "--token", TOKEN), 9, "does not have the address", "--host"),
    "certificate": (certificate, 8, "Invalid TLS certificate or key", "matching pair"),
    "no certificate": (words("--tls-cert", "/no/x.pem", "--tls-key", "/no/x.pem"), 8, "not found", "PEM file"),
    "no key": (words("--tls-cert", "/etc/hostname"), 2, "needs a certificate and its key", "Add --tls-key"),
    "short token": (words("--token", "short"), 2, "5 characters", "tokens create NAME"),
    "no token": (words("--host", "0.0.0.0", HORNBILL_CONTAINER="0"), 2, "without a token", "tokens create NAME"),
    "empty token": (words(HORNBILL_TOKEN=" "), 2, "The token is empty", "HORNBILL_TOKEN"),
    "setting": (words(HORNBILL_SERVOS="abc"), 2, "Invalid setting servos", "HORNBILL_SERVOS"),
}  # fmt: skip
"""Fault, exit code, what the message says, and the remedy."""


@pytest.fixture
def put_back() -> Iterator[None]:
    """`serve` changes the garbage collection and the umask of its process."""
    mask = os.umask(0o022)
    yield
    os.umask(mask)
    gc.enable()


@pytest.mark.usefixtures("put_back")
@pytest.mark.parametrize("name", FAULTS)
def test_a_failure_at_start_is_a_sentence_and_an_exit_code(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fault, code, says, remedy = FAULTS[name]
    with ExitStack() as stack:
        more = fault(tmp_path, stack, monkeypatch)
        before = {file: file.read_bytes() for file in tmp_path.iterdir()} if name != "locked" else {}
        for command in ("serve", "check"):
            given = [command, "--port", "0", "--data-dir", str(tmp_path), *more]
            done = CliRunner().invoke(app, given)
            assert isinstance(done.exception, SystemExit), done.exception
            assert done.exit_code == code, (command, done.output)
            text = done.stderr if command == "serve" or not done.stdout else done.stdout
            assert says in text
            assert remedy in text
            assert "Traceback" not in done.output
            assert "secret" not in done.output
            if command == "serve":
                assert len(text.splitlines()) == 1
        assert {file: file.read_bytes() for file in before} == before


def test_a_privileged_port_is_not_retried(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(socket, "bind", refuse)
    with pytest.raises(CannotStart, match="administrator rights") as caught:
        listen("127.0.0.1", 80)
    assert caught.value.facts == {"part": "port", "retry": False}


def test_a_check_finds_what_start_will_do_and_changes_nothing(tmp_path: Path) -> None:
    def check() -> dict[str, str]:
        done = CliRunner().invoke(app, ["check", "--json", "--port", "0", "--data-dir", str(tmp_path)])
        assert done.exit_code == 0, done.output
        found = json.loads(done.stdout)
        assert all(one["ok"] for one in found)
        return {one["part"]: one["detail"] for one in found}

    assert "created at start" in check()["database"]
    assert not (tmp_path / FILE_NAME).exists()
    with Store(tmp_path) as store:
        store.tokens.add("me", "admin")
    found = check()
    assert "with a token" in found["access"]
    with closing(sqlite3.connect(tmp_path / FILE_NAME)) as database:
        database.execute("UPDATE alembic_version SET version_num = '0009'")
        database.commit()
    assert "tables 0009, migrated to" in check()["database"]
    assert [file.name for file in tmp_path.iterdir()] == [FILE_NAME]


def test_the_data_folder_is_for_its_user_alone(tmp_path: Path) -> None:
    def mode(path: Path) -> int:
        return stat.S_IMODE(path.stat().st_mode)

    mask = os.umask(0o022)
    try:
        folder = tmp_path / "new"
        with Store(folder):
            assert {mode(one) for one in folder.iterdir()} == {0o600}
        assert mode(folder) == 0o700
        (folder / "logs").mkdir()
        (folder / FIRST_TOKEN).touch(mode=0o644)
        folder.chmod(0o755)
        (folder / FILE_NAME).chmod(0o644)
        Store(folder).close()
        assert (mode(folder), mode(folder / FILE_NAME), mode(folder / "logs")) == (0o700, 0o600, 0o700)
        assert mode(folder / FIRST_TOKEN) == 0o600
        (folder / "thesis.odt").touch()
        folder.chmod(0o755)
        Store(folder).close()
        assert mode(folder) == 0o755, "a folder with other files is shared on purpose"
    finally:
        os.umask(mask)


def test_the_version_names_the_commit() -> None:
    plain = CliRunner().invoke(app, ["--version"]).stdout
    found = json.loads(CliRunner().invoke(app, ["version", "--json"]).stdout)
    assert plain == f"hornbill {found['version']}" + (f" (commit {found['commit']})" if found["commit"] else "") + "\n"
    assert CliRunner().invoke(app, ["version"]).stdout == plain


@pytest.mark.parametrize("command", [["tokens", "list"], ["backup", "new.zip"], ["check"]])
def test_an_invalid_setting_is_one_sentence_without_its_value_for_every_command(command: list[str]) -> None:
    done = CliRunner().invoke(app, command, env={"HORNBILL_NODE_ID": TOKEN})
    assert done.exit_code == 2
    assert "Invalid setting node_id" in done.stderr
    assert "HORNBILL_NODE_ID" in done.stderr
    assert TOKEN not in done.output
