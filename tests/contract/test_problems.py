"""Every error of the tree has an HTTP answer, and the codes are those the contract fixes."""

import ast
import inspect
import re
from collections.abc import Iterator
from copy import copy
from pathlib import Path

import pytest

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


@pytest.mark.parametrize(("code", "status"), FIXED.items())
def test_codes_and_statuses_are_those_of_the_contract(code: str, status: int) -> None:
    assert STATUS[code] == status


# What the client raises where no server answers has no answer of a server's.
SERVERS = [kind for kind in classes(errors.HornbillError) if not kind.__module__.startswith("hornbill.client")]


@pytest.mark.parametrize("kind", SERVERS, ids=lambda kind: kind.__name__)
def test_every_error_has_a_status(kind: type[errors.HornbillError]) -> None:
    assert kind.code in STATUS


def test_facts_become_members_of_the_problem_and_never_replace_its_own() -> None:
    shown = problem(
        errors.OutOfRange("too much", cause=None, minimum=0, maximum=100, unit="%", requested=120, status=200)
    )
    dumped = shown.model_dump()
    assert (dumped["minimum"], dumped["maximum"], dumped["unit"], dumped["requested"]) == (0, 100, "%", 120)
    assert (dumped["status"], dumped["code"], dumped["detail"]) == (422, "out_of_range", "too much")


def test_the_tree_in_the_docstring_names_every_class() -> None:
    drawn = errors.__doc__ or ""
    for kind in classes(errors.HornbillError):
        if kind.__module__ == "hornbill.errors":
            assert kind.__name__ in drawn, f"{kind.__name__} is missing in the drawing at the top of errors.py"


ERRORS = {kind.__name__ for kind in classes(errors.HornbillError)}
FOR_PROGRAMS = re.compile(r"/api/v1|…/|confirm: \[|\(parameter [a-z]+_|header '|Content-Type|save: true")


def test_no_layer_below_the_api_names_a_route() -> None:
    """Below the edges, what went wrong is a code with facts; `api.remedies` names the request."""
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


PROGRAMS = re.compile(r"(cli|client|probe)/|(pytest_plugin|app/(network_policy|serving|simulate))\.py$")
"""Files whose errors end in a terminal: no page words them."""


@pytest.mark.parametrize("kind", list(classes(errors.HornbillError)), ids=lambda kind: kind.__name__)
def test_no_error_can_be_made_without_a_cause(kind: type[errors.HornbillError]) -> None:
    """The argument is required, so pyright refuses a call without it."""
    cause = inspect.signature(kind).parameters["cause"]
    assert (cause.kind, cause.default) == (inspect.Parameter.KEYWORD_ONLY, inspect.Parameter.empty)


def test_a_copy_of_an_error_is_extended_alone() -> None:
    error = errors.Unknown("unknown_run", "There is none.", cause="run_not_found", run=3)
    again = copy(error)
    again.extend(after=" Nothing was sent.", also="steps_incomplete")
    assert (type(again), again.code, again.detail) == (
        errors.Unknown,
        "unknown_run",
        "There is none. Nothing was sent.",
    )
    assert (error.detail, error.facts) == ("There is none.", {"cause": "run_not_found", "run": 3})


def test_a_problem_of_the_server_has_a_cause() -> None:
    """None, or the facts of another error, only where a program reports it, or one error repeats another."""
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
