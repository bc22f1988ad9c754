"""Profiles are stored."""

import pytest

from hornbill.errors import Unknown
from hornbill.store.profiles import StoredProfile
from hornbill.store.store import Store
from hornbill.store.tables import Json
from unit.store.clock import Wall

DOCUMENT: dict[str, Json] = {"z": 1, "values": {"origin": -90.5, "list": [1, None]}, "a": "§"}


def test_a_profile_is_stored_with_its_order(place: str, store: Store) -> None:
    assert store.profiles.put("Rudder", DOCUMENT) == StoredProfile("Rudder", DOCUMENT, 1000.0, 1000.0)
    store.close()
    with Store(place) as again:
        found = again.profiles.get("Rudder")
    assert found == StoredProfile("Rudder", DOCUMENT, 1000.0, 1000.0)
    assert list(found.document) == ["z", "values", "a"]


def test_replacing_a_profile_keeps_its_creation_time(store: Store, wall: Wall) -> None:
    store.profiles.put("Rudder", DOCUMENT)
    wall.now = 2000.0
    assert store.profiles.put("Rudder", {}) == StoredProfile("Rudder", {}, 1000.0, 2000.0)
    assert store.profiles.all() == [StoredProfile("Rudder", {}, 1000.0, 2000.0)]


def test_the_order_of_profiles_is_the_same_on_every_database(store: Store) -> None:
    for name in ("b", "Ä", "a", "B", "a b", "A"):
        store.profiles.put(name, {})
    assert [one.name for one in store.profiles.all()] == ["A", "B", "a", "a b", "b", "Ä"]


def test_a_deleted_profile_is_unknown(store: Store) -> None:
    store.profiles.put("Rudder", DOCUMENT)
    store.profiles.drop("Rudder")
    for name in ("Rudder", "rudder\0", "x" * 500, "\ud800"):
        for method in (store.profiles.get, store.profiles.drop):
            with pytest.raises(Unknown) as caught:
                method(name)
            assert caught.value.code == "unknown_profile"
