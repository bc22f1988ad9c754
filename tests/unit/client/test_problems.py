"""The tests of what a server's problem becomes: the class its code names, with status and facts."""

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
def test_what_the_server_raises_is_what_the_program_catches(kind: type[errors.HornbillError]) -> None:
    sent = kind("It went wrong.", cause=None, limit=5)
    caught = raised(STATUS[sent.code], problem(sent).model_dump())
    assert type(caught) is kind
    assert (caught.code, caught.detail, caught.facts) == (sent.code, "It went wrong.", {"limit": 5})
    assert caught.status == STATUS[sent.code]


def test_no_answer_and_refused_are_never_the_same() -> None:
    silent, no = (raised(1, {"code": code, "detail": "x"}) for code in ("no_response", "refused_by_servo"))
    assert not isinstance(silent, type(no))
    assert not isinstance(no, type(silent))


@pytest.mark.parametrize("code", ["unknown_servo", "unknown_job", "unknown_of_tomorrow"])
def test_whatever_is_unknown_says_what(code: str) -> None:
    caught = raised(404, {"code": code, "detail": "No such thing."})
    assert type(caught) is errors.Unknown
    assert caught.code == code


def test_a_code_of_tomorrow_is_an_error_with_that_code() -> None:
    caught = raised(409, {"code": "moon_phase", "detail": "Not today.", "phase": "full"})
    assert type(caught) is errors.HornbillError
    assert (caught.code, caught.facts, caught.status) == ("moon_phase", {"phase": "full"}, 409)


def test_a_proxy_that_answers_without_a_problem_is_an_error_with_its_status() -> None:
    caught = raised(502, {})
    assert (caught.code, caught.status) == ("internal", 502)
    assert "502" in caught.detail
