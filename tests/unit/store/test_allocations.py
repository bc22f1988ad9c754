"""Allocations of node IDs are stored."""

import pytest

from hornbill.errors import InvalidValue, OutOfRange
from hornbill.store.allocations import AllocationEntry
from hornbill.store.store import Store
from hornbill.units import NodeId, Uid
from unit.store.clock import Wall

A, B, C, D, E = (Uid(f"{letter}0" * 16) for letter in "abcde")


def test_a_row_has_first_and_last_seen(store: Store, wall: Wall) -> None:
    store.allocations.record(A, NodeId(125))
    wall.now = 1234.5
    store.allocations.record(A, NodeId(125))
    store.allocations.record(B, NodeId(3))
    assert store.allocations.rows() == [
        AllocationEntry(B, NodeId(3), False, 1234.5, 1234.5),
        AllocationEntry(A, NodeId(125), False, 1000.0, 1234.5),
    ]
    wall.now = 2000.0
    store.allocations.seen([A, C])
    store.allocations.seen([])
    assert store.allocations.get(A).last_seen == 2000.0
    assert store.allocations.get(B).last_seen == 1234.5
    assert store.allocations.entries() == {A: 125, B: 3}


def test_a_pin_lasts_until_another_node_id_is_used(store: Store, wall: Wall) -> None:
    store.allocations.pin(A, NodeId(10))
    assert store.allocations.rows() == [AllocationEntry(A, NodeId(10), True, None, None)]
    store.allocations.record(A, NodeId(10))
    wall.now = 2000.0
    store.allocations.pin(A, NodeId(11))
    assert store.allocations.rows() == [AllocationEntry(A, NodeId(11), True, 1000.0, 1000.0)]
    assert store.allocations.pinned(A)
    assert not store.allocations.pinned(B)
    store.allocations.record(A, NodeId(12))
    assert store.allocations.rows() == [AllocationEntry(A, NodeId(12), False, 1000.0, 2000.0)]
    assert not store.allocations.pinned(A)


def test_idle_is_ordered_by_last_seen_without_pinned_nodes(store: Store, wall: Wall) -> None:
    for seconds, uid in ((2000.0, A), (1000.0, B), (1500.0, C), (1200.0, D)):
        wall.now = seconds
        store.allocations.record(uid, NodeId(int(seconds) // 100))
    store.allocations.pin(D, NodeId(12))
    store.allocations.pin(E, NodeId(13))
    wall.now = 3000.0
    for longer_than_s, idle in ((1200.0, [B, C]), (2000.0, []), (0.0, [B, C, A])):
        assert store.allocations.idle(longer_than_s) == idle


def test_a_node_id_is_allocated_to_one_node(store: Store) -> None:
    store.allocations.record(A, NodeId(125))
    for method in (store.allocations.record, store.allocations.pin):
        with pytest.raises(InvalidValue, match=f"Node ID 125 is allocated to {A}") as caught:
            method(B, NodeId(125))
        assert caught.value.facts == {"node_id": 125, "owner": A, "cause": "node_id_reserved"}
    store.allocations.drop(A)
    store.allocations.pin(B, NodeId(125))
    assert store.allocations.entries() == {B: 125}


def test_reserved_node_ids_cannot_be_pinned(store: Store) -> None:
    for node_id in (0, 126, 127, -1):
        with pytest.raises(OutOfRange) as caught:
            store.allocations.pin(A, NodeId(node_id))
        facts = {"minimum": 1, "maximum": 125, "unit": "", "requested": node_id, "cause": "node_id_out_of_range"}
        assert caught.value.facts == facts
    assert store.allocations.entries() == {}
