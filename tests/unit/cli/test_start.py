"""The command line starts without heavy imports, and every command has help."""

import os
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import typer

from hornbill.cli import app

HEAVY = set("asyncio fastapi uvicorn sqlalchemy alembic can viser numpy pydantic httpx rich websockets".split())  # noqa: SIM905


def test_importing_it_imports_no_heavy_package() -> None:
    script = "import sys, hornbill.cli; print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert not {name.split(".")[0] for name in ran.stdout.split()} & HEAVY


def test_importing_the_pytest_plugin_imports_nothing_else_of_hornbill() -> None:
    script = "import sys, pytest; import hornbill.pytest_plugin; print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    found = {name for name in ran.stdout.split() if name.startswith("hornbill")}
    assert found == {"hornbill", "hornbill.pytest_plugin"}
    assert "httpx" not in ran.stdout.split()


def test_every_command_and_parameter_has_help() -> None:
    def without_help(command: Any, *words: str) -> Iterator[str]:
        if words and not command.help:
            yield " ".join(words)
        yield from (f"{' '.join(words)} {one.name}" for one in command.params if words and not one.help)
        for name, one in getattr(command, "commands", {}).items():
            yield from without_help(one, *words, name)

    assert list(without_help(typer.main.get_command(app))) == []


def test_completion_without_a_server_prints_nothing() -> None:
    environment = {
        **os.environ, "HORNBILL_URL": "http://127.0.0.1:9", "_HORNBILL_COMPLETE": "complete_bash",
        "COMP_WORDS": "hornbill get ", "COMP_CWORD": "2",
    }  # fmt: skip
    command = [sys.executable, "-c", "import sys; sys.argv[0] = 'hornbill'; from hornbill.cli import main; main()"]
    ran = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert (ran.stdout.strip(), ran.stderr) == ("", "")
