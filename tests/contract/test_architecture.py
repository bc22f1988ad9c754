"""Proves the rules of the layers that import-linter cannot say: threads, clocks, sockets, names, docstrings, sizes."""

import ast
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "server" / "hornbill"
FILES = sorted(PACKAGE.rglob("*.py"))
WRITTEN = [file for file in FILES if "migrations" not in file.parts]
CLOCKS_AND_IO = {"time", "datetime", "asyncio", "socket", "threading", "sqlite3", "subprocess"}
BANNED_NAMES = {"utils", "helpers", "common", "misc", "core", "base"}


def layer(file: Path) -> str:
    parts = file.relative_to(PACKAGE).parts
    return parts[0] if len(parts) > 1 else ""


def imported(file: Path) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found.update(alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.split(".")[0])
    return found


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_threads_live_in_bus_and_view_alone(file: Path) -> None:
    """And one in the client, which runs in other people's programs: there no loop could renew a lease."""
    if layer(file) not in ("bus", "view") and file != PACKAGE / "client" / "beating.py":
        assert "threading" not in imported(file)


@pytest.mark.parametrize(
    "file", [file for file in FILES if layer(file) == "client"], ids=lambda file: str(file.relative_to(PACKAGE))
)
def test_the_client_needs_httpx_and_the_leaves_and_nothing_else(file: Path) -> None:
    others = imported(file) - set(sys.stdlib_module_names)
    assert others <= {"httpx", "hornbill"}
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("hornbill"):
            assert (node.module or "").startswith(("hornbill.client", "hornbill.errors", "hornbill.units")) or (
                node.module == "hornbill" and {one.name for one in node.names} <= {"errors", "units"}
            )


@pytest.mark.parametrize(
    "file",
    [file for file in FILES if layer(file) in ("wire", "schema")],
    ids=lambda file: str(file.relative_to(PACKAGE)),
)
def test_wire_and_schema_hold_no_clock_thread_or_socket(file: Path) -> None:
    assert not imported(file) & CLOCKS_AND_IO


@pytest.mark.parametrize("file", WRITTEN, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_every_file_says_in_its_first_line_what_it_owns(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    first = (ast.get_docstring(ast.parse(text)) or "").splitlines()
    assert first, f"{file.name} has no docstring"
    assert text.startswith('"""'), f"{file.name} does not begin with its docstring"


@pytest.mark.parametrize("file", WRITTEN, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_no_file_is_a_drawer(file: Path) -> None:
    assert file.stem not in BANNED_NAMES


def test_no_star_import() -> None:
    for file in FILES:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                assert all(alias.name != "*" for alias in node.names), file
