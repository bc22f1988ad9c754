"""What each servo held at which instant."""

from collections.abc import Iterator
from typing import Any

import pytest

from hornbill.errors import Unknown
from hornbill.store import snapshots
from hornbill.store.snapshots import StoredSnapshot
from hornbill.store.store import Store
from hornbill.units import Uid
from unit.store.clock import Wall

A = Uid("a0" * 16)
B = Uid("b0" * 16)


@pytest.fixture
def wall() -> Wall:
    return Wall(1000.0)


@pytest.fixture
def store(place: str, wall: Wall) -> Iterator[Store]:
    with Store(place, wall=wall) as opened:
        yield opened


def add(store: Store, uid: Uid = A, *, automatic: bool = True, **other: Any) -> StoredSnapshot:
    facts: dict[str, Any] = {
        "reason": "before a change", "by": "Ada", "model": "BLA21-06U-A0", "firmware": 1300,
        "schema_revision": "1.3", "ram": {"origin": -900}, "rom": {"origin": 0}, **other,
    }  # fmt: skip
    return store.snapshots.add(uid, automatic=automatic, **facts)


def test_everything_about_a_snapshot_comes_back(place: str, store: Store) -> None:
    made = add(store)
    expected = StoredSnapshot(
        made.id, A, 1000.0, "before a change", "Ada", True, "BLA21-06U-A0", 1300, "1.3", {"origin": -900}, {"origin": 0}
    )
    assert made == expected
    store.close()
    with Store(place) as again:
        assert again.snapshots.get(made.id) == expected


def test_a_servos_snapshots_come_newest_first_and_without_those_of_others(store: Store, wall: Wall) -> None:
    first = add(store)
    add(store, B)
    wall.now = 900.0  # a wall clock may be set back: the order in which they were made counts
    second = add(store)
    assert store.snapshots.of(A) == [second, first]
    assert store.snapshots.of(A, limit=1) == [second]
    assert store.snapshots.latest(A) == second
    assert store.snapshots.latest(Uid("c0" * 16)) is None
    assert store.snapshots.counts() == {A: 2, B: 1}


def test_only_automatic_ones_of_that_servo_make_room(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(snapshots, "MAX_AUTOMATIC", 3)
    monkeypatch.setattr(snapshots, "PRUNE_EVERY", 1)
    by_hand = add(store, automatic=False)
    other = add(store, B)
    made = [add(store) for _ in range(5)]
    assert store.snapshots.of(A) == [*made[:1:-1], by_hand]
    assert store.snapshots.of(B) == [other]


def test_the_oldest_are_looked_for_now_and_then_and_first_of_all_after_a_start(
    place: str, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(snapshots, "MAX_AUTOMATIC", 3)
    monkeypatch.setattr(snapshots, "PRUNE_EVERY", 4)
    counts: list[int] = []
    for _ in range(10):
        add(store)
        counts.append(len(store.snapshots.of(A)))
    assert counts == [1, 2, 3, 4, 3, 4, 5, 6, 3, 4], "never four more than are kept"
    store.close()
    with Store(place) as again:
        add(again)
        assert again.snapshots.counts() == {A: 3}


def test_what_the_newest_has_already_is_not_kept_twice(store: Store) -> None:
    first = add(store)
    add(store, B, ram={"origin": 1})
    assert add(store, by="Bo", unless_same=True) == first
    second = add(store, rom={"origin": 5}, unless_same=True)
    third = add(store, unless_same=True)
    assert store.snapshots.of(A) == [third, second, first], "the newest counts, none before it"


def test_the_number_of_one_that_was_dropped_is_not_given_again(store: Store) -> None:
    dropped = add(store)
    store.snapshots.drop(dropped.id)
    assert add(store).id > dropped.id


def test_what_is_not_there_is_unknown(store: Store) -> None:
    for method in (store.snapshots.get, store.snapshots.drop):
        with pytest.raises(Unknown, match="Unknown snapshot 7") as caught:
            method(7)
        assert caught.value.code == "unknown_snapshot"
        assert caught.value.facts == {"snapshot": 7, "cause": "snapshot_not_found"}


def test_a_number_no_database_can_hold_is_unknown_too(store: Store) -> None:
    for number in (2**31, 2**63, -(2**70)):
        with pytest.raises(Unknown):
            store.snapshots.get(number)
        with pytest.raises(Unknown):
            store.snapshots.drop(number)


def test_words_that_are_too_long_are_cut(store: Store) -> None:
    made = add(store, reason="r" * 300, by="b" * 100)
    assert (len(made.reason), len(made.by)) == (200, 80)


def test_all_of_one_servo_are_dropped_at_once(store: Store) -> None:
    for _ in range(3):
        add(store)
    other = add(store, B, automatic=False)
    assert store.snapshots.drop_all(A) == 3
    assert store.snapshots.counts() == {B: 1}
    assert store.snapshots.latest(B) == other
    assert store.snapshots.drop_all(A) == 0
