"""Snapshots are stored."""

from typing import Any

import pytest

from hornbill.store import snapshots
from hornbill.store.snapshots import StoredSnapshot
from hornbill.store.store import Store
from hornbill.units import Uid
from unit.store.clock import Wall

A, B = Uid("a0" * 16), Uid("b0" * 16)


def add(store: Store, uid: Uid = A, *, automatic: bool = True, **other: Any) -> StoredSnapshot:
    facts: dict[str, Any] = {
        "reason": "before a change", "by": "Ada", "model": "BLA21-06U-A0", "firmware": 1300,
        "schema_revision": "1.3", "ram": {"origin": -900}, "rom": {"origin": 0}, **other,
    }  # fmt: skip
    return store.snapshots.add(uid, automatic=automatic, **facts)


def test_snapshots_are_stored_whole_and_ordered_newest_first(place: str, store: Store, wall: Wall) -> None:
    first = add(store)
    expected = StoredSnapshot(
        first.id, A, 1000.0, "before a change", "Ada", True, "BLA21-06U-A0", 1300, "1.3",
        {"origin": -900}, {"origin": 0}, bench=store.bench,
    )  # fmt: skip
    assert first == expected
    other = add(store, B, ram={"origin": 1})
    wall.now = 900.0  # a wall clock may be set back: the order of creation counts
    assert add(store, by="Bo", unless_same=True) == first, "it equals the newest"
    second = add(store, rom={"origin": 5}, unless_same=True)
    third = add(store, unless_same=True)
    with Store(place) as again:
        assert again.snapshots.get(first.id) == expected
        assert again.snapshots.of(A) == [third, second, first]
        assert again.snapshots.of(A, limit=1) == [third]
        assert (again.snapshots.latest(A), again.snapshots.latest(B)) == (third, other)
        assert again.snapshots.latest(Uid("c0" * 16)) is None
        assert again.snapshots.counts() == {A: 3, B: 1}


def test_only_automatic_snapshots_of_the_servo_are_deleted(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(snapshots, "MAX_AUTOMATIC", 3)
    monkeypatch.setattr(snapshots, "PRUNE_EVERY", 1)
    manual = add(store, automatic=False)
    other = add(store, B)
    made = [add(store) for _ in range(5)]
    assert store.snapshots.of(A) == [*made[:1:-1], manual]
    assert store.snapshots.of(B) == [other]


def test_the_oldest_are_deleted_periodically_and_after_a_start(
    place: str, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(snapshots, "MAX_AUTOMATIC", 3)
    monkeypatch.setattr(snapshots, "PRUNE_EVERY", 4)
    counts: list[int] = []
    for _ in range(10):
        add(store)
        counts.append(len(store.snapshots.of(A)))
    assert counts == [1, 2, 3, 4, 3, 4, 5, 6, 3, 4]
    store.close()
    with Store(place) as again:
        add(again)
        assert again.snapshots.counts() == {A: 3}


def test_deleted_snapshots_are_gone_and_their_numbers_are_not_reused(store: Store) -> None:
    other = add(store, B, automatic=False)
    made = [add(store) for _ in range(3)]
    store.snapshots.drop(made[-1].id)
    assert store.snapshots.drop_all(A) == 2
    assert store.snapshots.drop_all(A) == 0
    assert store.snapshots.counts() == {B: 1}
    assert store.snapshots.latest(B) == other
    assert add(store).id > made[-1].id


def test_long_texts_are_cut(store: Store) -> None:
    made = add(store, reason="r" * 300, by="b" * 100)
    assert (len(made.reason), len(made.by)) == (200, 80)
