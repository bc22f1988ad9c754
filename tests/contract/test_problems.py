"""Every error of the tree has an HTTP answer, and the codes are those the contract fixes."""

from collections.abc import Iterator

import pytest

from hornbill import errors
from hornbill.api.problems import STATUS, problem

FIXED = {
    "unknown_servo": 404, "unknown_parameter": 404, "not_in_this_model": 409, "read_only": 409,
    "forbidden_parameter": 403, "out_of_range": 422, "invalid_value": 422, "refused_by_servo": 502, "no_answer": 504,
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
    shown = problem(errors.OutOfRange("too much", minimum=0, maximum=100, unit="%", requested=120, status=200))
    dumped = shown.model_dump()
    assert (dumped["minimum"], dumped["maximum"], dumped["unit"], dumped["requested"]) == (0, 100, "%", 120)
    assert (dumped["status"], dumped["code"], dumped["detail"]) == (422, "out_of_range", "too much")


def test_the_tree_in_the_docstring_names_every_class() -> None:
    drawn = errors.__doc__ or ""
    for kind in classes(errors.HornbillError):
        if kind.__module__ == "hornbill.errors":
            assert kind.__name__ in drawn, f"{kind.__name__} is missing in the drawing at the top of errors.py"
