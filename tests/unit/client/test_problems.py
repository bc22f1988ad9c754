"""A problem of the server becomes the error of its code, with status and facts."""

from collections.abc import Iterator

import pytest

from hornbill import errors
from hornbill.api.problems import STATUS, problem
from hornbill.client.problems import raised


def classes(root: type[errors.HornbillError]) -> Iterator[type[errors.HornbillError]]:
    for child in root.__subclasses__():
        if child.__module__ == "hornbill.errors":
            yield child
            yield from classes(child)


CODED = [kind for kind in classes(errors.HornbillError) if kind.code != "internal"]


@pytest.mark.parametrize("kind", CODED, ids=lambda kind: kind.__name__)
def test_the_client_raises_the_error_of_the_server(kind: type[errors.HornbillError]) -> None:
    sent = kind("It went wrong.", cause=None, limit=5)
    caught = raised(STATUS[sent.code], problem(sent).model_dump())
    assert type(caught) is kind
    assert (caught.code, caught.detail, caught.facts) == (sent.code, "It went wrong.", {"limit": 5})
    assert caught.status == STATUS[sent.code]


def test_no_response_and_refused_are_different_classes() -> None:
    silent, no = (raised(1, {"code": code, "detail": "x"}) for code in ("no_response", "refused_by_servo"))
    assert not isinstance(silent, type(no))
    assert not isinstance(no, type(silent))


@pytest.mark.parametrize("code", ["unknown_servo", "unknown_job", "unknown_future_thing"])
def test_unknown_resources_have_their_code(code: str) -> None:
    caught = raised(404, {"code": code, "detail": "No such thing."})
    assert type(caught) is errors.Unknown
    assert caught.code == code


def test_an_unknown_code_is_kept() -> None:
    caught = raised(409, {"code": "moon_phase", "detail": "Not today.", "phase": "full"})
    assert type(caught) is errors.HornbillError
    assert (caught.code, caught.facts, caught.status) == ("moon_phase", {"phase": "full"}, 409)


def test_a_response_without_a_problem_is_an_error_with_its_status() -> None:
    caught = raised(502, {})
    assert (caught.code, caught.status) == ("internal", 502)
    assert "502" in caught.detail
