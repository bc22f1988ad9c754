"""Rules of the layers that import-linter cannot express: threads, clocks, sockets, imports of the client, wiring."""

import ast
import sys
from pathlib import Path

from contract.source import nodes

PACKAGE = Path(__file__).parents[2] / "server" / "hornbill"
FILES = sorted(PACKAGE.rglob("*.py"))
CLOCKS_AND_IO = {"time", "datetime", "asyncio", "socket", "threading", "sqlite3", "subprocess"}


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


def in_layers(*names: str) -> list[Path]:
    return [file for file in FILES if layer(file) in names]


def test_only_bus_view_the_database_and_the_heartbeat_of_the_client_use_threads() -> None:
    """The client runs in other programs, which may have no event loop to renew a lease."""
    threaded = {file for file in FILES if "threading" in imported(file)}
    assert threaded <= {*in_layers("bus", "view", "store"), PACKAGE / "client" / "heartbeat.py"}


def test_the_client_imports_only_httpx_errors_and_units() -> None:
    for file in in_layers("client"):
        assert imported(file) - set(sys.stdlib_module_names) <= {"httpx", "hornbill"}, file
        for node in nodes(file):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("hornbill"):
                assert (node.module or "").startswith(("hornbill.client", "hornbill.errors", "hornbill.units")) or (
                    node.module == "hornbill" and {one.name for one in node.names} <= {"errors", "units"}
                ), file


def test_wire_and_schema_use_no_clock_thread_or_socket() -> None:
    assert [file for file in in_layers("wire", "schema") if imported(file) & CLOCKS_AND_IO] == []


def test_a_constructor_takes_at_most_seven_arguments() -> None:
    """More are passed as a frozen dataclass."""
    for file in FILES:
        for node in nodes(file):
            if isinstance(node, ast.FunctionDef) and node.name == "__init__":
                assert len([*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]) <= 1 + 7, file


FRAMEWORKS = {"api/http.py: app.openapi"}
"""FastAPI offers no other way to replace its document."""


def test_objects_are_wired_by_constructor_or_subscription() -> None:
    """A callback is passed to the constructor or to a method that subscribes it, never set on another object.

    Found are public attributes declared as callables, and attributes (or their entries) of other objects that are set
    to a lambda, a `partial` or a bound method.
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
    """Whether a value is a callable, as far as its source shows."""
    if isinstance(value, ast.Attribute):
        return ast.unparse(value.value) == "self" and value.attr in methods
    return isinstance(value, ast.Lambda) or (isinstance(value, ast.Call) and ast.unparse(value.func) == "partial")
