"""The history of fault bits is stored."""

from dataclasses import replace

from hornbill.store.faults import FaultEntry, FaultReading
from hornbill.store.store import Store
from hornbill.units import Uid

A, B = Uid("a0" * 16), Uid("b0" * 16)
KEY = "temperature_high"
HOT = FaultEntry(A, KEY, 1000.0, 1000.0, 1, active=True)


def appeared(*keys: str, uid: Uid = A, at: float = 1000.0) -> FaultReading:
    return FaultReading(uid, at, appeared=frozenset(keys))


def test_a_fault_bit_is_stored_by_servo_until_it_is_forgotten(place: str, store: Store) -> None:
    store.faults.record(appeared(KEY))
    store.faults.record(appeared("motor_driver", uid=B))
    with Store(place) as again:
        assert again.faults.of(A) == {KEY: HOT}
        assert set(again.faults.of(B)) == {"motor_driver"}
        again.faults.forget(A)
        again.faults.forget(A)
        assert (again.faults.of(A), len(again.faults.of(B))) == ({}, 1)


def test_last_seen_is_the_latest_reading_with_the_bit(store: Store) -> None:
    def read(at: float, *, seen: bool, gone: bool = False) -> FaultEntry:
        key, none = frozenset([KEY]), frozenset[str]()
        store.faults.record(FaultReading(A, at, seen=key if seen else none, gone=key if gone else none))
        return store.faults.of(A)[KEY]

    store.faults.record(appeared(KEY))
    assert read(500.0, seen=True) == HOT, "it never decreases"
    assert read(1007.5, seen=True, gone=True) == replace(HOT, last_seen=1007.5, active=False)
    store.faults.record(appeared(KEY, at=2000.0))
    assert read(9000.0, seen=False, gone=True) == replace(HOT, last_seen=2000.0, count=2, active=False)


def test_the_first_acknowledgement_lasts_until_the_bit_appears_again(store: Store) -> None:
    store.faults.record(appeared(KEY))
    store.faults.acknowledge(A, [KEY], "Ada" + "x" * 100, 1001.0)
    store.faults.acknowledge(A, [KEY], "Bob", 1002.0)
    (entry,) = store.faults.of(A).values()
    assert (entry.acknowledged_at, entry.acknowledged_by) == (1001.0, "Ada" + "x" * 77)
    known = store.faults.record(appeared(KEY, at=2000.0))
    assert known == store.faults.of(A) == {KEY: replace(HOT, last_seen=2000.0, count=2)}


def test_unknown_bits_are_ignored(store: Store) -> None:
    assert store.faults.acknowledge(A, [KEY], "Ada", 1001.0) == {}
    never = frozenset([KEY])
    assert store.faults.record(FaultReading(A, 1000.0, seen=never, gone=never)) == {}
    assert store.faults.of(A) == {}


def test_bits_are_ordered_by_first_appearance(store: Store) -> None:
    store.faults.record(appeared("voltage_low", "rom_lost", at=2000.0))
    store.faults.record(appeared(KEY, at=1000.0))
    assert list(store.faults.of(A)) == [KEY, "rom_lost", "voltage_low"]
