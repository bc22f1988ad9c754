"""The history of fault bits is stored."""

from dataclasses import replace

from hornbill.store.faults import FaultEntry, FaultReading
from hornbill.store.store import Store
from hornbill.units import Uid

A = Uid("a0" * 16)
B = Uid("b0" * 16)
HOT = FaultEntry(A, "temperature_high", 1000.0, 1000.0, 1, active=True)


def appeared(*keys: str, uid: Uid = A, at: float = 1000.0) -> FaultReading:
    return FaultReading(uid, at, appeared=frozenset(keys))


def test_a_fault_bit_is_stored(place: str, store: Store) -> None:
    store.faults.record(appeared("temperature_high"))
    store.faults.record(appeared("motor_driver", uid=B))
    store.close()
    with Store(place) as again:
        assert again.faults.of(A) == {"temperature_high": HOT}
        assert set(again.faults.of(B)) == {"motor_driver"}


def test_a_cleared_bit_keeps_first_and_last_seen(store: Store) -> None:
    store.faults.record(appeared("temperature_high"))
    store.faults.record(
        FaultReading(A, 1007.5, seen=frozenset(["temperature_high"]), gone=frozenset(["temperature_high"]))
    )
    assert store.faults.of(A) == {"temperature_high": replace(HOT, last_seen=1007.5, active=False)}


def test_clearing_without_seeing_does_not_change_last_seen(store: Store) -> None:
    store.faults.record(appeared("temperature_high"))
    store.faults.record(FaultReading(A, 9000.0, gone=frozenset(["temperature_high"])))
    assert store.faults.of(A) == {"temperature_high": replace(HOT, active=False)}


def test_last_seen_never_decreases(store: Store) -> None:
    store.faults.record(appeared("temperature_high"))
    store.faults.record(FaultReading(A, 500.0, seen=frozenset(["temperature_high"])))
    assert store.faults.of(A) == {"temperature_high": HOT}


def test_every_appearance_is_counted_and_resets_the_acknowledgement(store: Store) -> None:
    store.faults.record(appeared("temperature_high"))
    store.faults.acknowledge(A, ["temperature_high"], "Ada", 1001.0)
    known = store.faults.record(appeared("temperature_high", at=2000.0))
    assert known == store.faults.of(A) == {"temperature_high": replace(HOT, last_seen=2000.0, count=2)}


def test_the_first_acknowledgement_is_kept(store: Store) -> None:
    store.faults.record(appeared("temperature_high"))
    store.faults.acknowledge(A, ["temperature_high"], "Ada" + "x" * 100, 1001.0)
    store.faults.acknowledge(A, ["temperature_high"], "Bob", 1002.0)
    (entry,) = store.faults.of(A).values()
    assert (entry.acknowledged_at, entry.acknowledged_by) == (1001.0, "Ada" + "x" * 77)


def test_unknown_bits_are_ignored(store: Store) -> None:
    assert store.faults.acknowledge(A, ["temperature_high"], "Ada", 1001.0) == {}
    never = frozenset(["temperature_high"])
    assert store.faults.record(FaultReading(A, 1000.0, seen=never, gone=never)) == {}
    assert store.faults.of(A) == {}


def test_forgetting_one_servo_keeps_others(store: Store) -> None:
    store.faults.record(appeared("temperature_high"))
    store.faults.record(appeared("temperature_high", uid=B))
    store.faults.forget(A)
    store.faults.forget(A)
    assert store.faults.of(A) == {}
    assert len(store.faults.of(B)) == 1


def test_bits_are_ordered_by_first_appearance(store: Store) -> None:
    store.faults.record(appeared("voltage_low", "rom_lost", at=2000.0))
    store.faults.record(appeared("temperature_high", at=1000.0))
    assert list(store.faults.of(A)) == ["temperature_high", "rom_lost", "voltage_low"]
