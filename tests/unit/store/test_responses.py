"""A key is taken once, for one request, and its answer outlasts the process that gave it."""

import pytest

from hornbill.store import responses
from hornbill.store.responses import Begun, StoredResponse
from hornbill.store.store import Store

DONE = StoredResponse(202, {"content-type": "application/json", "location": "/x"}, b'{"id":"\x00\xff"}')


def test_a_key_is_taken_once_and_tells_the_answer_from_then_on(place: str) -> None:
    with Store(place) as store:
        assert store.responses.begin("k", "r") is None
        assert store.responses.begin("k", "other") == Begun("r", True, None)
        store.responses.end("k", DONE)
        assert store.responses.begin("k", "r") == Begun("r", True, DONE)
        assert store.responses.begin("k2", "r") is None


def test_another_process_finds_the_answer_or_that_there_is_none(place: str) -> None:
    with Store(place) as store:
        store.responses.begin("answered", "r")
        store.responses.end("answered", DONE)
        store.responses.begin("cut off", "r")
    with Store(place) as again:
        assert again.responses.begin("answered", "r") == Begun("r", False, DONE)
        assert again.responses.begin("cut off", "r") == Begun("r", False, None)


def test_of_two_processes_one_gets_the_key(place: str) -> None:
    with Store(place) as one, Store(place) as two:
        assert one.responses.begin("k", "r") is None
        assert two.responses.begin("k", "r") == Begun("r", False, None)


def test_answers_are_kept_for_a_day_at_least_and_not_for_ever(place: str) -> None:
    now = 1_000_000.0
    with Store(place, wall=lambda: now) as store:
        store.responses.begin("k", "r")
        store.responses.end("k", DONE)
        now += 24 * 3600.0
        assert store.responses.begin("a day later", "r") is None
        assert store.responses.begin("k", "r") is not None
        now += responses.RETAIN_S
        assert store.responses.begin("much later", "r") is None
        assert store.responses.begin("k", "r") is None


def test_an_empty_answer_is_an_answer(place: str) -> None:
    with Store(place) as store:
        store.responses.begin("k", "r")
        store.responses.end("k", StoredResponse(204, {}, b""))
        begun = store.responses.begin("k", "r")
        assert begun is not None
        assert begun.response == StoredResponse(204, {}, b"")


@pytest.mark.parametrize("key", ["k", "f" * 64])
def test_an_answer_to_a_key_that_was_dropped_meanwhile_is_passed_over(place: str, key: str) -> None:
    with Store(place) as store:
        store.responses.end(key, DONE)
        assert store.responses.begin(key, "r") is None
