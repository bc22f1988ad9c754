"""Allocations of node IDs are stored."""

import pytest

from hornbill.errors import InvalidValue, OutOfRange, Unknown
from hornbill.node.allocator import AllocationTable
from hornbill.store.allocations import AllocationEntry
from hornbill.store.store import Store
from hornbill.units import NodeId, Uid
from unit.store.clock import Wall

A = Uid("a0" * 16)
B = Uid("b0" * 16)


def test_it_is_the_table_of_the_allocator(store: Store) -> None:
    table: AllocationTable = store.allocations
    table.record(A, NodeId(125))
    assert table.entries() == {A: 125}
    assert not table.pinned(A)
    assert not table.pinned(B)


def test_a_row_has_first_and_last_seen(store: Store, wall: Wall) -> None:
    store.allocations.record(A, NodeId(125))
    wall.now = 1234.5
    store.allocations.record(A, NodeId(125))
    store.allocations.record(B, NodeId(3))
    assert store.allocations.rows() == [
        AllocationEntry(B, NodeId(3), False, 1234.5, 1234.5),
        AllocationEntry(A, NodeId(125), False, 1000.0, 1234.5),
    ]


def test_a_pin_is_kept_when_the_node_id_is_used(store: Store, wall: Wall) -> None:
    store.allocations.pin(A, NodeId(10))
    assert store.allocations.rows() == [AllocationEntry(A, NodeId(10), True, None, None)]
    assert store.allocations.pinned(A)
    wall.now = 2000.0
    store.allocations.record(A, NodeId(10))
    assert store.allocations.rows() == [AllocationEntry(A, NodeId(10), True, 2000.0, 2000.0)]


def test_pinning_changes_the_node_id_and_keeps_the_times(store: Store) -> None:
    store.allocations.record(A, NodeId(125))
    store.allocations.pin(A, NodeId(10))
    assert store.allocations.rows() == [AllocationEntry(A, NodeId(10), True, 1000.0, 1000.0)]


def test_another_node_id_ends_the_pin(store: Store) -> None:
    store.allocations.pin(A, NodeId(10))
    store.allocations.record(A, NodeId(11))
    assert not store.allocations.pinned(A)
    assert store.allocations.entries() == {A: 11}


def test_seen_updates_known_nodes_only(store: Store, wall: Wall) -> None:
    store.allocations.record(A, NodeId(125))
    store.allocations.record(B, NodeId(124))
    wall.now = 2000.0
    store.allocations.seen([A, Uid("c0" * 16)])
    store.allocations.seen([])
    assert store.allocations.get(A).last_seen == 2000.0
    assert store.allocations.get(B).last_seen == 1000.0
    assert len(store.allocations.rows()) == 2


def test_idle_is_ordered_by_last_seen_without_pinned_nodes(store: Store, wall: Wall) -> None:
    for seconds, uid in ((2000.0, A), (1000.0, B), (1500.0, Uid("c0" * 16)), (1200.0, Uid("d0" * 16))):
        wall.now = seconds
        store.allocations.record(uid, NodeId(int(seconds) // 100))
    store.allocations.pin(Uid("d0" * 16), NodeId(12))
    store.allocations.pin(Uid("e0" * 16), NodeId(13))
    wall.now = 3000.0
    assert store.allocations.idle(1200.0) == [B, "c0" * 16]
    assert store.allocations.idle(2000.0) == []
    assert store.allocations.idle(0.0) == [B, "c0" * 16, A]


def test_a_node_id_is_allocated_to_one_node(store: Store) -> None:
    store.allocations.record(A, NodeId(125))
    for method in (store.allocations.record, store.allocations.pin):
        with pytest.raises(InvalidValue, match=f"Node ID 125 is allocated to {A}") as caught:
            method(B, NodeId(125))
        assert caught.value.facts == {"node_id": 125, "owner": A, "cause": "node_id_reserved"}
    store.allocations.drop(A)
    store.allocations.pin(B, NodeId(125))
    assert store.allocations.entries() == {B: 125}


@pytest.mark.parametrize("node_id", [0, 126, 127, -1])
def test_reserved_node_ids_cannot_be_pinned(store: Store, node_id: int) -> None:
    with pytest.raises(OutOfRange) as caught:
        store.allocations.pin(A, NodeId(node_id))
    cause = "node_id_out_of_range"
    assert caught.value.facts == {"minimum": 1, "maximum": 125, "unit": "", "requested": node_id, "cause": cause}
    assert store.allocations.entries() == {}


def test_unknown_nodes_are_errors(store: Store) -> None:
    for method in (store.allocations.drop, store.allocations.get):
        with pytest.raises(Unknown) as caught:
            method(A)
        assert caught.value.code == "unknown_uid"
