"""`hornbill tokens`, and the token that network access requires."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from hornbill.cli import app
from hornbill.cli.server.tokens import first_link
from hornbill.store.store import Store
from hornbill.store.tokens import digest

RUN = CliRunner()


def run(*words: str, code: int = 0, environment: dict[str, str] | None = None) -> tuple[str, str]:
    """Standard output and error of a command that exits with `code`."""
    done = RUN.invoke(app, list(words), env={"HORNBILL_CONTAINER": "0", **(environment or {})})
    assert done.exit_code == code, f"{done.output} {done.exception!r}"
    return done.stdout, done.stderr


def test_a_token_is_printed_once_and_listed_without_its_secret(tmp_path: Path) -> None:
    folder = ("--data-dir", str(tmp_path))
    secret, errors = run("tokens", "create", "rig 3", "--role", "operate", *folder)
    assert "not shown again" in errors
    listed, _ = run("tokens", "list", *folder)
    assert "rig 3" in listed
    assert "operate" in listed
    assert secret.strip() not in listed
    with Store(tmp_path) as store:
        assert store.tokens.all()[0].digest == digest(secret.strip())
    assert json.loads(run("tokens", "list", "--json", *folder)[0])[0].keys() == {
        "name", "role", "created_at", "last_used_at"
    }  # fmt: skip


def test_a_token_can_be_revoked_and_errors_are_explained(tmp_path: Path) -> None:
    environment = {"HORNBILL_DATA_DIR": str(tmp_path)}
    made = json.loads(run("tokens", "create", "a", "--role", "view", "--json", environment=environment)[0])
    assert made["token"].startswith("hb_")
    assert "already" in run("tokens", "create", "a", "--role", "view", code=1, environment=environment)[1]
    errors = run("tokens", "create", "a/b", "--role", "view", code=1, environment=environment)[1]
    assert "not a valid token name" in errors
    run("tokens", "create", "b", "--role", "king", code=2, environment=environment)
    run("tokens", "revoke", "a", environment=environment)
    assert "Unknown token 'a'" in run("tokens", "revoke", "a", code=1, environment=environment)[1]
    assert run("tokens", "list", environment=environment)[0].startswith("No token")


@pytest.mark.parametrize("command", ["serve", "demo"])
def test_network_access_requires_a_token(tmp_path: Path, command: str) -> None:
    _, errors = run(
        command, "--host", "0.0.0.0", "--port", "0", code=2, environment={"HORNBILL_DATA_DIR": str(tmp_path)}
    )  # fmt: skip
    assert "without a token" in errors
    assert "--token" in errors


def test_the_first_link_has_its_token_in_the_fragment() -> None:
    text = first_link("hb_secret", "http", 8000)
    assert "http://localhost:8000/#token=hb_secret" in text
    assert first_link(None, "http", 8000) == ""
