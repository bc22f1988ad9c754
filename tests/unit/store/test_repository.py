"""Behaviour shared by the tables: unknown keys, and the maximum number of rows."""

import pytest

from hornbill.errors import Unknown
from hornbill.store import runs
from hornbill.store.store import Store
from hornbill.units import Uid

UID = Uid("ab" * 16)


@pytest.mark.parametrize("subject", ["runs", "snapshots", "profiles", "allocations"])
def test_an_unknown_key_is_an_error(store: Store, subject: str) -> None:
    table = getattr(store, subject)
    keys = (1, 0, -1, 2**31, 2**63, -(2**70)) if subject in ("runs", "snapshots") else ("nothing",)
    for key in keys:
        with pytest.raises(Unknown):
            table.get(key)
        with pytest.raises(Unknown):
            table.drop(key)


def test_the_oldest_rows_of_a_servo_are_deleted(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runs, "MAX_ROWS", 2)
    other = Uid("cd" * 16)
    with Store(place) as store:
        store.runs.add(other, "", {})
        for number in range(4):
            store.runs.add(UID, str(number), {})
        assert [one.note for one in store.runs.of(UID)] == ["3", "2"]
        assert len(store.runs.of(other)) == 1
