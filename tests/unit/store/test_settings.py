"""Small values of ours that outlive the process."""

from pathlib import Path

import pytest

from hornbill.store.store import Store
from hornbill.store.tables import Json


@pytest.mark.parametrize("value", [None, True, 0, 1.5, "text", [], [1, [2]], {"a": {"b": None}}])
def test_any_json_value_comes_back_as_it_was(place: str, value: Json) -> None:
    with Store(place) as store:
        store.settings.put("key", value)
        assert store.settings.get("key", "default") == value
        store.settings.put("key", [value])
        assert store.settings.get("key") == [value]


def test_what_was_never_kept_or_was_dropped_is_the_default(place: str) -> None:
    with Store(place) as store:
        assert store.settings.get("key") is None
        assert store.settings.get("key", 5) == 5
        store.settings.put("key", 1)
        store.settings.drop("key")
        store.settings.drop("key")
        assert store.settings.get("key", 5) == 5


def test_our_unique_id_is_made_once_and_differs_between_installations(tmp_path: Path) -> None:
    with Store(tmp_path / "one") as store:
        first = store.settings.own_unique_id()
        assert len(first) == 16
        assert store.settings.own_unique_id() == first
    with Store(tmp_path / "one") as store:
        assert store.settings.own_unique_id() == first
    with Store(tmp_path / "other") as store:
        assert store.settings.own_unique_id() != first
