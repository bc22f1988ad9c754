"""Servos are stored while they are off."""

from dataclasses import replace

import pytest

from hornbill.store.servos import ServoFacts, StoredServo
from hornbill.store.store import Store
from hornbill.units import Uid
from unit.store.clock import Wall

A, B = Uid("a0" * 16), Uid("b0" * 16)
FACTS = ServoFacts(
    name="jp.co.futaba.bla21", model="BLA21-06U-A0", model_number=61, hardware_version=6010, firmware=1300,
    serial=123456, production_date="2024-05-06T07:08", node_id=125, servo_id=0, bus="memory:demo",
)  # fmt: skip


def stored(store: Store, uid: Uid = A) -> StoredServo:
    found = store.servos.get(uid)
    assert found is not None
    return found


def test_a_servo_is_stored_whole(place: str, store: Store) -> None:
    store.servos.seen(A, FACTS)
    store.servos.set_label(A, "Elevator L")
    store.servos.put_rom(A, {"origin": 1, "servo_id": 2})
    store.servos.put_rom(A, {"torque_mode": 0, "origin": -900})
    store.servos.set_notes(A, "New gears.")
    store.servos.put_set_up(A, {"arm_mm": 60.0})
    expected = StoredServo(
        A, "Elevator L", FACTS, 1000.0, 1000.0, {"torque_mode": 0, "origin": -900}, notes="New gears.",
        set_up={"arm_mm": 60.0}, bench=store.bench,
    )  # fmt: skip
    assert store.servos.get(A) == expected
    store.close()
    with Store(place) as again:
        assert again.servos.all() == [expected]


def test_unknown_facts_keep_the_stored_ones(store: Store, wall: Wall) -> None:
    store.servos.seen(A, FACTS)
    wall.now = 2000.0
    store.servos.seen(A, ServoFacts(node_id=124, servo_id=7))
    expected = replace(FACTS, node_id=124, servo_id=7)
    assert stored(store) == StoredServo(A, "", expected, 1000.0, 2000.0, bench=store.bench)
    store.servos.seen(A, ServoFacts(servo_id=0))
    assert stored(store).facts.servo_id == 0


def test_a_label_can_be_set_before_the_servo_is_seen_and_removed(store: Store) -> None:
    store.servos.set_label(B, "x" * 200)
    with pytest.raises(ValueError, match="at most 200"):
        store.servos.set_label(B, "x" * 201)
    assert stored(store, B) == StoredServo(B, "x" * 200)
    store.servos.seen(B)
    store.servos.set_label(B, "")
    assert stored(store, B) == StoredServo(B, "", ServoFacts(), 1000.0, 1000.0, bench=store.bench)


def test_servos_are_ordered_by_unique_id_and_can_be_excluded_or_forgotten(store: Store) -> None:
    def uids(but: list[Uid] | None = None) -> list[Uid]:
        return [one.uid for one in store.servos.all(but=but or [])]

    store.servos.seen(B)
    store.servos.seen(A)
    assert (uids(), uids([A])) == ([A, B], [B])
    store.servos.forget(A)
    store.servos.forget(A)
    assert store.servos.get(A) is None
    assert uids() == [B]
