"""Every error has an HTTP status and a cause, and none below the API names a route."""

import ast
import inspect
import re
from collections.abc import Iterator
from copy import copy
from pathlib import Path

import hornbill
from contract.source import nodes
from hornbill import errors
from hornbill.api.problems import STATUS, problem

FIXED = {
    "unknown_servo": 404, "unknown_parameter": 404, "not_in_this_model": 409, "read_only": 409,
    "forbidden_parameter": 403, "out_of_range": 422, "invalid_value": 422, "refused_by_servo": 502, "no_response": 504,
    "bus_disconnected": 503, "mode_off": 409, "lease_required": 428, "lease_held": 409, "stopped": 423, "busy": 409,
    "stale_revision": 412, "forbidden_origin": 403,
}  # fmt: skip


def classes(root: type[errors.HornbillError]) -> Iterator[type[errors.HornbillError]]:
    yield root
    for child in root.__subclasses__():
        yield from classes(child)


KINDS = list(classes(errors.HornbillError))


def test_every_error_has_its_status() -> None:
    """Errors of the client have none: no server responded."""
    assert FIXED.items() <= STATUS.items()
    assert {kind.code for kind in KINDS if not kind.__module__.startswith("hornbill.client")} <= STATUS.keys()


def test_facts_become_fields_of_the_problem_and_never_replace_its_own() -> None:
    shown = problem(
        errors.OutOfRange("too much", cause=None, minimum=0, maximum=100, unit="%", requested=120, status=200)
    )
    dumped = shown.model_dump()
    assert (dumped["minimum"], dumped["maximum"], dumped["unit"], dumped["requested"]) == (0, 100, "%", 120)
    assert (dumped["status"], dumped["code"], dumped["detail"]) == (422, "out_of_range", "too much")


def test_the_tree_in_the_docstring_contains_every_class() -> None:
    drawn = errors.__doc__ or ""
    for kind in KINDS:
        if kind.__module__ == "hornbill.errors":
            assert kind.__name__ in drawn, f"{kind.__name__} is missing in the drawing at the top of errors.py"


ERRORS = {kind.__name__ for kind in KINDS}
FOR_PROGRAMS = re.compile(r"/api/v1|…/|confirm: \[|\(parameter [a-z]+_|header '|Content-Type|save: true")


def test_no_layer_below_the_api_names_a_route() -> None:
    """Errors of the domain have a code and facts; `api.remedies` names the request."""
    root = Path(hornbill.__file__).parent
    named = [
        f"{file}:{node.lineno}"
        for file, node in (
            (path.relative_to(root).as_posix(), node)
            for path in sorted(root.rglob("*.py"))
            for node in nodes(path)
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and FOR_PROGRAMS.search(node.value)
        )
        if file.startswith(("bus/", "lab/", "node/", "schema/", "servo/", "sim/", "store/", "wire/"))
    ]
    assert named == []


PROGRAMS = re.compile(r"(cli|client|probe)/|(pytest_plugin|app/(network_policy|serving|simulate)|store/backup)\.py$")
"""Files whose errors are printed in a terminal: the page has no text for them."""


def test_every_error_requires_a_cause() -> None:
    """So pyright rejects a call without it."""
    for kind in KINDS:
        cause = inspect.signature(kind).parameters["cause"]
        assert (cause.kind, cause.default) == (inspect.Parameter.KEYWORD_ONLY, inspect.Parameter.empty), kind


def test_extending_a_copy_leaves_the_error_unchanged() -> None:
    error = errors.Unknown("unknown_run", "There is none.", cause="run_not_found", run=3)
    again = copy(error)
    again.extend(after=" Nothing was sent.", also="steps_incomplete")
    assert (type(again), again.code, again.detail) == (
        errors.Unknown,
        "unknown_run",
        "There is none. Nothing was sent.",
    )
    assert (error.detail, error.facts) == ("There is none.", {"cause": "run_not_found", "run": 3})


def test_every_error_of_the_server_has_a_cause() -> None:
    """None only in programs, and the facts of another error only where one error repeats another."""
    root = Path(hornbill.__file__).parent
    bare = [
        f"{file}:{call.lineno}"
        for file, call in (
            (path.relative_to(root).as_posix(), node)
            for path in sorted(root.rglob("*.py"))
            for node in nodes(path)
            if isinstance(node, ast.Call)
        )
        if not PROGRAMS.search(file) and ast.unparse(call.func).removeprefix("errors.") in ERRORS
        if {one.arg: ast.unparse(one.value) for one in call.keywords if one.arg in ("cause", None)}.get(
            "cause", "facts" if any(one.arg is None for one in call.keywords) else "None"
        )
        == "None"
    ]
    assert bare == []
