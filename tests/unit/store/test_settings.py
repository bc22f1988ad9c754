"""Settings of the server are stored."""

from pathlib import Path

import pytest

from hornbill.store.store import Store
from hornbill.store.tables import Json


@pytest.mark.parametrize("value", [None, True, 0, 1.5, "text", [], [1, [2]], {"a": {"b": None}}])
def test_any_json_value_is_stored(store: Store, value: Json) -> None:
    store.settings.put("key", value)
    assert store.settings.get("key", "default") == value
    store.settings.put("key", [value])
    assert store.settings.get("key") == [value]


def test_a_missing_or_deleted_setting_is_the_default(store: Store) -> None:
    assert store.settings.get("key") is None
    assert store.settings.get("key", 5) == 5
    store.settings.put("key", 1)
    store.settings.drop("key")
    store.settings.drop("key")
    assert store.settings.get("key", 5) == 5


def test_the_unique_id_of_an_installation_is_permanent(tmp_path: Path) -> None:
    with Store(tmp_path / "one") as store:
        first = store.settings.own_unique_id()
        assert len(first) == 16
        assert store.settings.own_unique_id() == first
    with Store(tmp_path / "one") as store:
        assert store.settings.own_unique_id() == first
    with Store(tmp_path / "other") as store:
        assert store.settings.own_unique_id() != first
