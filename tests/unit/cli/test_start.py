"""The tests of how quick and quiet the command line is: nothing heavy before a command runs, help on each."""

import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from hornbill.cli import app


def commands(found: Any, *words: str) -> Iterator[tuple[str, ...]]:
    """Every command, and every group."""
    for name, one in getattr(found, "commands", {}).items():
        yield (*words, name)
        yield from commands(one, *words, name)


COMMANDS = list(commands(typer.main.get_command(app)))
HEAVY = (
    "fastapi",
    "uvicorn",
    "sqlalchemy",
    "alembic",
    "can",
    "viser",
    "numpy",
    "pydantic",
    "httpx",
    "rich",
    "websockets",
)


def test_importing_it_imports_nothing_heavy() -> None:
    script = "import sys, hornbill.cli; print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert not {name.split(".")[0] for name in ran.stdout.split()} & set(HEAVY)


def test_importing_the_pytest_plugin_imports_nothing_of_hornbill() -> None:
    script = "import sys, pytest; import hornbill.pytest_plugin; print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    found = {name for name in ran.stdout.split() if name.startswith("hornbill")}
    assert found == {"hornbill", "hornbill.pytest_plugin"}
    assert "httpx" not in ran.stdout.split()


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_every_command_has_help(command: tuple[str, ...]) -> None:
    shown = CliRunner().invoke(app, [*command, "--help"])
    assert shown.exit_code == 0
    assert len(shown.stdout) > 100


def test_completion_without_a_server_offers_nothing_and_says_nothing() -> None:
    import os

    environment = {
        **os.environ, "HORNBILL_URL": "http://127.0.0.1:9", "_HORNBILL_COMPLETE": "complete_bash",
        "COMP_WORDS": "hornbill get ", "COMP_CWORD": "2",
    }  # fmt: skip
    command = [sys.executable, "-c", "import sys; sys.argv[0] = 'hornbill'; from hornbill.cli import main; main()"]
    ran = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert (ran.stdout.strip(), ran.stderr) == ("", "")
