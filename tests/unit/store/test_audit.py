"""The audit is stored."""

from collections.abc import Iterator

import pytest

from hornbill.domain.note import Note
from hornbill.store.audit import AuditEntry, NewAuditEntry
from hornbill.store.store import Store
from hornbill.store.tables import Json
from hornbill.units import Uid
from unit.store.clock import Wall

A, B = Uid("a0" * 16), Uid("b0" * 16)


def test_an_entry_is_stored_whole_with_values_of_any_type(place: str, store: Store) -> None:
    values: list[Json] = [None, False, True, 0, 0.5, "", "off", [], {"a": None}]
    notes = Note.words("clamped by the servo")
    entries = [NewAuditEntry("Ada", "write", "clamped", A, "origin", one, one, one, notes, "0011") for one in values]
    store.audit.add(entries)
    with Store(place) as again:
        rows = again.audit.rows()[::-1]
    assert rows == [AuditEntry(row.id, 1000.0, entry, store.bench) for row, entry in zip(rows, entries, strict=True)]
    for value, row in zip(values, rows, strict=True):  # False equals 0
        assert {type(one) for one in (row.entry.before, row.entry.requested, row.entry.after)} == {type(value)}


def test_rows_are_paged_newest_first(store: Store) -> None:
    store.audit.add(NewAuditEntry("Ada", "write", "applied", notes=Note.words(str(n))) for n in range(5))
    page = store.audit.rows(limit=2)
    assert [row.entry.detail for row in page] == ["4", "3"]
    page = store.audit.rows(limit=2, before_id=page[-1].id)
    assert [row.entry.detail for row in page] == ["2", "1"]
    assert [row.entry.detail for row in store.audit.rows(before_id=page[-1].id)] == ["0"]
    assert len(store.audit.rows(before_id=2**70)) == 5
    assert store.audit.rows(before_id=-5) == []


def test_rows_are_filtered_by_servo_key_action_and_time(store: Store, wall: Wall) -> None:
    store.audit.add([NewAuditEntry("Ada", "write", "applied", A, "origin")])
    wall.now = 2000.0
    store.audit.add(
        [NewAuditEntry("Ada", "save", "succeeded", A), NewAuditEntry("Ada", "write", "applied", B, "origin")]
    )

    def found(**filters: object) -> list[tuple[str, Uid | None]]:
        return [(row.entry.action, row.entry.uid) for row in store.audit.rows(**filters)]  # pyright: ignore[reportArgumentType]

    assert found(uid=A) == [("save", A), ("write", A)]
    assert found(key="origin") == [("write", B), ("write", A)]
    assert found(action="save") == [("save", A)]
    assert found(since=2000.0) == [("write", B), ("save", A)]
    assert found(uid=A, since=2000.0, action="write") == []


def test_entries_are_added_all_or_none(store: Store) -> None:
    def entries() -> Iterator[NewAuditEntry]:
        yield NewAuditEntry("Ada", "write", "applied")
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        store.audit.add(entries())
    assert store.audit.rows() == []


def test_long_and_invalid_texts_are_cut_and_replaced(store: Store) -> None:
    store.audit.add(
        [NewAuditEntry("a\0b\ud800 🐦" + "x" * 200, "label", "applied", A, key="k" * 200, notes=Note.words("\0" * 3))]
    )
    (row,) = store.audit.rows()
    assert row.entry.by == "a\ufffdb\ufffd 🐦" + "x" * 74
    assert (row.entry.key, row.entry.detail) == ("k" * 100, "\ufffd" * 3)
