"""Proves the rules of the layers that import-linter cannot say: threads, clocks, sockets, names, docstrings, sizes."""

import ast
import sys
from pathlib import Path

import pytest

from contract.source import nodes, tree

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
    for node in nodes(file):
        if isinstance(node, ast.Import):
            found.update(alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.split(".")[0])
    return found


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_threads_live_in_bus_and_view_alone(file: Path) -> None:
    """And one in the client, which runs in other people's programs: there no loop could renew a lease."""
    if layer(file) not in ("bus", "view") and file != PACKAGE / "client" / "heartbeat.py":
        assert "threading" not in imported(file)


@pytest.mark.parametrize(
    "file", [file for file in FILES if layer(file) == "client"], ids=lambda file: str(file.relative_to(PACKAGE))
)
def test_the_client_needs_httpx_and_the_leaves_and_nothing_else(file: Path) -> None:
    others = imported(file) - set(sys.stdlib_module_names)
    assert others <= {"httpx", "hornbill"}
    for node in nodes(file):
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
    first = (ast.get_docstring(tree(file)) or "").splitlines()
    assert first, f"{file.name} has no docstring"
    assert text.startswith('"""'), f"{file.name} does not begin with its docstring"


@pytest.mark.parametrize("file", WRITTEN, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_no_file_is_a_drawer(file: Path) -> None:
    assert file.stem not in BANNED_NAMES


def test_no_star_import() -> None:
    for file in FILES:
        for node in nodes(file):
            if isinstance(node, ast.ImportFrom):
                assert all(alias.name != "*" for alias in node.names), file


MOST_COLLABORATORS = 7


def classes() -> list[tuple[Path, ast.ClassDef]]:
    return [(file, node) for file in FILES for node in nodes(file) if isinstance(node, ast.ClassDef)]


def test_no_constructor_takes_more_than_seven_arguments() -> None:
    """What is more is a frozen bundle. Dataclasses have fields instead of a constructor, so they are left out."""
    over: list[str] = []
    for file, one in classes():
        for method in one.body:
            if isinstance(method, ast.FunctionDef) and method.name == "__init__":
                taken = [*method.args.posonlyargs, *method.args.args, *method.args.kwonlyargs][1:]
                if len(taken) > MOST_COLLABORATORS:
                    over.append(f"{file.relative_to(PACKAGE)}: {one.name} takes {len(taken)}")
    assert not over


FRAMEWORKS = {"api/http.py: app.openapi"}
"""FastAPI has its document replaced this way and no other."""


def test_nothing_is_wired_by_setting_an_attribute_of_another_object() -> None:
    """A callback or a collaborator comes in by the constructor, or by a method that listens (hub, hooks, subscribe).

    Looked for: a public attribute that a class declares as something to call, and an attribute of another object, or an
    entry of one, that is given a lambda, a `partial` or a bound method.
    """
    found: set[str] = set()
    for file in FILES:
        methods = {node.name for node in nodes(file) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)}
        for node in nodes(file):
            targets: list[ast.expr] = []
            if isinstance(node, ast.AnnAssign) and ast.unparse(node.annotation).startswith("Callable"):
                targets = [node.target] if not ast.unparse(node.target).startswith("self._") else []
            elif isinstance(node, ast.Assign) and is_call(node.value, methods):
                targets = [target for target in node.targets if not is_own(target)]
            found |= {
                f"{file.relative_to(PACKAGE)}: {ast.unparse(target)}"
                for target in targets
                if isinstance(target, ast.Attribute | ast.Subscript)
            }
    assert not found - FRAMEWORKS


def is_own(target: ast.expr) -> bool:
    """Whether it is an attribute of `self`, an entry of one, or an entry of a local mapping."""
    if isinstance(target, ast.Subscript):
        return isinstance(target.value, ast.Name) or is_own(target.value)
    return isinstance(target, ast.Attribute) and ast.unparse(target.value) == "self"


def is_call(value: ast.expr, methods: set[str]) -> bool:
    """Whether a value is something to call, as far as its own text tells."""
    if isinstance(value, ast.Attribute):
        return ast.unparse(value.value) == "self" and value.attr in methods
    return isinstance(value, ast.Lambda) or (isinstance(value, ast.Call) and ast.unparse(value.func) == "partial")
