"""An idempotency key is used for one request, and its response is stored."""

from hornbill.store import responses
from hornbill.store.responses import Begun, StoredResponse
from hornbill.store.store import Store

DONE = StoredResponse(202, {"content-type": "application/json", "location": "/x"}, b'{"id":"\x00\xff"}')


def test_a_key_is_used_once_and_then_returns_the_response(store: Store) -> None:
    store.responses.end("k", DONE)  # of a deleted key: ignored
    assert store.responses.begin("k", "r") is None
    assert store.responses.begin("k", "other") == Begun("r", True, None)
    store.responses.end("k", DONE)
    assert store.responses.begin("k", "r") == Begun("r", True, DONE)
    assert store.responses.begin("k2", "r") is None
    empty = StoredResponse(204, {}, b"")
    store.responses.end("k2", empty)
    assert store.responses.begin("k2", "r") == Begun("r", True, empty)


def test_another_process_finds_the_response_or_its_absence(place: str) -> None:
    with Store(place) as store, Store(place) as other:
        assert store.responses.begin("responded", "r") is None
        store.responses.end("responded", DONE)
        assert store.responses.begin("interrupted", "r") is None
        assert other.responses.begin("responded", "r") == Begun("r", False, DONE)
        assert other.responses.begin("interrupted", "r") == Begun("r", False, None)


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
