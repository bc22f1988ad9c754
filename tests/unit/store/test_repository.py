"""Tests of what the tables of the store share: one row by its key, and what there is too much of."""

import pytest

from hornbill.errors import Unknown
from hornbill.store import runs
from hornbill.store.store import Store
from hornbill.units import Uid

UID = Uid("ab" * 16)


@pytest.mark.parametrize("subject", ["runs", "snapshots", "profiles", "allocations"])
def test_a_key_without_a_row_is_unknown_to_get_and_to_drop(place: str, subject: str) -> None:
    with Store(place) as store:
        table = getattr(store, subject)
        keys = (1, 0, -1, 2**31, 2**70) if subject in ("runs", "snapshots") else ("nothing",)
        for key in keys:
            with pytest.raises(Unknown):
                table.get(key)
            with pytest.raises(Unknown):
                table.drop(key)


def test_the_oldest_beyond_what_is_kept_of_one_servo_are_dropped(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runs, "MAX_ROWS", 2)
    other = Uid("cd" * 16)
    with Store(place) as store:
        store.runs.add(other, "", {})
        for number in range(4):
            store.runs.add(UID, str(number), {})
        assert [one.note for one in store.runs.of(UID)] == ["3", "2"]
        assert len(store.runs.of(other)) == 1
