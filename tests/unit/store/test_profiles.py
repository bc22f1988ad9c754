"""Named sets of values."""

from collections.abc import Iterator

import pytest

from hornbill.errors import Unknown
from hornbill.store.profiles import StoredProfile
from hornbill.store.store import Store
from hornbill.store.tables import Json
from unit.store.clock import Wall

DOCUMENT: dict[str, Json] = {"z": 1, "values": {"origin": -90.5, "list": [1, None]}, "a": "§"}


@pytest.fixture
def wall() -> Wall:
    return Wall(1000.0)


@pytest.fixture
def store(place: str, wall: Wall) -> Iterator[Store]:
    with Store(place, wall=wall) as opened:
        yield opened


def test_a_profile_comes_back_with_its_lines_in_their_order(place: str, store: Store) -> None:
    assert store.profiles.put("Rudder", DOCUMENT) == StoredProfile("Rudder", DOCUMENT, 1000.0, 1000.0)
    store.close()
    with Store(place) as again:
        found = again.profiles.get("Rudder")
    assert found == StoredProfile("Rudder", DOCUMENT, 1000.0, 1000.0)
    assert list(found.document) == ["z", "values", "a"]


def test_one_of_the_same_name_is_replaced_and_keeps_its_birthday(store: Store, wall: Wall) -> None:
    store.profiles.put("Rudder", DOCUMENT)
    wall.now = 2000.0
    assert store.profiles.put("Rudder", {}) == StoredProfile("Rudder", {}, 1000.0, 2000.0)
    assert store.profiles.all() == [StoredProfile("Rudder", {}, 1000.0, 2000.0)]


def test_profiles_come_in_the_same_order_on_every_database(store: Store) -> None:
    for name in ("b", "Ä", "a", "B", "a b", "A"):
        store.profiles.put(name, {})
    assert [one.name for one in store.profiles.all()] == ["A", "B", "a", "a b", "b", "Ä"]


def test_one_that_is_dropped_is_gone_and_what_is_not_there_is_unknown(store: Store) -> None:
    store.profiles.put("Rudder", DOCUMENT)
    store.profiles.drop("Rudder")
    for name in ("Rudder", "rudder\0", "x" * 500, "\ud800"):
        for method in (store.profiles.get, store.profiles.drop):
            with pytest.raises(Unknown) as caught:
                method(name)
            assert caught.value.code == "unknown_profile"
