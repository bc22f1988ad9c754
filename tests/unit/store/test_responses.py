"""An idempotency key is used for one request, and its response is stored."""

import pytest

from hornbill.store import responses
from hornbill.store.responses import Begun, StoredResponse
from hornbill.store.store import Store

DONE = StoredResponse(202, {"content-type": "application/json", "location": "/x"}, b'{"id":"\x00\xff"}')


def test_a_key_is_used_once_and_then_returns_the_response(store: Store) -> None:
    assert store.responses.begin("k", "r") is None
    assert store.responses.begin("k", "other") == Begun("r", True, None)
    store.responses.end("k", DONE)
    assert store.responses.begin("k", "r") == Begun("r", True, DONE)
    assert store.responses.begin("k2", "r") is None


def test_another_process_finds_the_response_or_its_absence(place: str) -> None:
    with Store(place) as store:
        store.responses.begin("responded", "r")
        store.responses.end("responded", DONE)
        store.responses.begin("interrupted", "r")
    with Store(place) as again:
        assert again.responses.begin("responded", "r") == Begun("r", False, DONE)
        assert again.responses.begin("interrupted", "r") == Begun("r", False, None)


def test_of_two_processes_one_gets_the_key(place: str) -> None:
    with Store(place) as one, Store(place) as two:
        assert one.responses.begin("k", "r") is None
        assert two.responses.begin("k", "r") == Begun("r", False, None)


def test_responses_are_stored_for_at_least_a_day_and_then_deleted(place: str) -> None:
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


def test_an_empty_response_is_stored(store: Store) -> None:
    store.responses.begin("k", "r")
    store.responses.end("k", StoredResponse(204, {}, b""))
    begun = store.responses.begin("k", "r")
    assert begun is not None
    assert begun.response == StoredResponse(204, {}, b"")


@pytest.mark.parametrize("key", ["k", "f" * 64])
def test_a_response_to_a_deleted_key_is_ignored(store: Store, key: str) -> None:
    store.responses.end(key, DONE)
    assert store.responses.begin(key, "r") is None
