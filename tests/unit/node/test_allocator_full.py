"""When no node id is left: who loses one, who gets none, and what is said of it."""

import pytest

from hornbill.node.allocator import RECYCLE_AFTER_S, Allocator
from hornbill.node.waiting import AllocationRequest
from hornbill.units import NodeId, Uid
from unit.node.table import MemoryTable, Neighbours, exchange

A = bytes(range(0xA0, 0xB0))
B = bytes(range(0xB0, 0xC0))


def allocator(table: MemoryTable, neighbours: Neighbours | None = None, own: int = 127) -> Allocator:
    return Allocator(table, own_ids=frozenset({own, 127}), known_nodes=neighbours or Neighbours())


def number(n: int) -> bytes:
    return n.to_bytes(16, "big")


def test_without_a_free_id_the_request_is_refused_and_logged(caplog: pytest.LogCaptureFixture) -> None:
    table = MemoryTable({number(n).hex(): n for n in range(1, 126)})
    it = allocator(table)
    refusals: list[AllocationRequest] = []
    it.on_refused.append(refusals.append)
    assert exchange(it, A, 0.0) is None
    assert exchange(it, A, 1.0) is None
    (refusal,) = refusals
    assert refusal.partial == A.hex()
    assert refusal.refusal == "All 125 node IDs are taken. Remove allocations of nodes no longer in use."
    assert A.hex() in caplog.text
    (waiting,) = it.pending(1.2)
    assert (waiting.refusal, waiting.attempts) == (refusal.refusal, 2)
    del table.kept[number(7).hex()]
    assert exchange(it, A, 2.0) == 7
    assert it.pending(2.2) == []


def away(oldest_s: float, *, pins: frozenset[str] = frozenset()) -> MemoryTable:
    """A full table; number(n) was away for a second less than its predecessor."""
    table = MemoryTable({number(n).hex(): n for n in range(1, 126)}, pins)
    table.away_s = {number(n).hex(): oldest_s - n for n in range(1, 126)}
    return table


def test_in_a_full_table_the_id_unused_for_longest_is_recycled() -> None:
    table = away(RECYCLE_AFTER_S + 100)
    it = allocator(table, Neighbours({1: 2.0, 3: 2.0}))
    lost: list[tuple[Uid, NodeId]] = []
    it.on_recycled.append(lambda uid, node_id: lost.append((uid, node_id)))
    assert exchange(it, A, 1.0, preferred=77) == 2  # number(1) is here
    assert exchange(it, B, 2.0) == 4
    assert lost == [(number(2).hex(), 2), (number(4).hex(), 4)]
    assert len(table.kept) == 125
    assert exchange(it, number(2), 3.0) == 5  # whoever comes back is new


def test_in_a_full_table_pinned_present_and_recent_nodes_keep_their_ids() -> None:
    table = away(RECYCLE_AFTER_S + 3.5, pins=frozenset({number(1).hex()}))  # 1, 2 and 3 were away for long enough
    it = allocator(table, Neighbours({2: 0.0}), own=3)
    assert exchange(it, A, 1.0) is None
    assert len(table.kept) == 125


def test_while_an_id_is_free_none_is_recycled() -> None:
    table = away(RECYCLE_AFTER_S + 100)
    del table.kept[number(60).hex()]
    it = allocator(table)
    assert exchange(it, A, 1.0) == 60
    assert set(table.kept) - {A.hex()} == {number(n).hex() for n in range(1, 126) if n != 60}


def test_a_failing_table_refuses_the_request_until_it_works_again() -> None:
    table = MemoryTable()
    it = allocator(table)
    refusals: list[AllocationRequest] = []
    it.on_refused.append(refusals.append)
    table.broken = True
    assert exchange(it, A, 0.0) is None
    assert [each.partial for each in refusals] == [A.hex()]
    assert "data folder" in (refusals[0].refusal or "")
    table.broken = False
    assert exchange(it, A, 1.0) == 125
