"""Two allocators on one bus: the one that hears the other stands down, unless it was told to insist."""

import pytest

from hornbill.node.allocator import AllocationMode, Allocator, AllocatorStatus, CompetingAllocator
from hornbill.wire.messages import AllocationMessage
from unit.node.table import MemoryTable, Neighbours, competing_response, exchange, request

A = bytes(range(0xA0, 0xB0))


def allocator(table: MemoryTable | None = None) -> Allocator:
    return Allocator(table or MemoryTable(), own_ids=frozenset({127}), known_nodes=Neighbours())


def test_it_goes_to_standby_when_another_allocator_responds(caplog: pytest.LogCaptureFixture) -> None:
    table = MemoryTable()
    it = allocator(table)
    request(it, A[:6], 0.0, first=True)
    assert competing_response(it, 9, AllocationMessage(0, False, A[:6]), 0.01) is None
    assert it.state is AllocatorStatus.STANDBY
    assert it.competitor == CompetingAllocator(9, 0.01, 1)
    assert request(it, A[6:12], 0.1) is None
    competing_response(it, 9, AllocationMessage(0, False, A[:12]), 0.11)
    assert [(each.partial, each.stage) for each in it.pending(0.2)] == [(A[:12].hex(), 2)]
    assert request(it, A[12:], 0.3) is None
    competing_response(it, 9, AllocationMessage(77, False, A), 0.31)
    assert it.pending(0.4) == []
    assert table.recorded == []
    assert it.competitor == CompetingAllocator(9, 0.31, 3)
    assert caplog.text.count("competing node ID allocator") == 1


def test_it_returns_when_the_other_allocator_ignores_three_requests() -> None:
    it = allocator()
    told: list[CompetingAllocator] = []
    it.on_competitor_found.append(told.append)
    it.on_competitor_gone.append(told.append)
    competing_response(it, 9, AllocationMessage(0, False, A[:6]), 0.0)
    for n in range(3):
        assert request(it, A[:6], 1.0 + n, first=True) is None
    assert len(told) == 1
    assert exchange(it, A, 4.0) == 125
    assert it.state is AllocatorStatus.ON
    assert told == [CompetingAllocator(9, 0.0, 1)] * 2


def test_it_stays_in_standby_while_the_other_allocator_responds() -> None:
    it = allocator()
    for n in range(20):
        request(it, A[:6], n, first=True)
        competing_response(it, 9, AllocationMessage(0, False, A[:6]), n + 0.001)
    assert it.state is AllocatorStatus.STANDBY


def test_in_force_mode_it_responds_beside_another_allocator() -> None:
    it = allocator()
    it.mode = AllocationMode.FORCE
    for n, part in enumerate((A[:6], A[6:12], A[12:])):
        now, before = 0.1 * n, A[: 6 * n]
        reply = request(it, part, now, first=n == 0)
        assert reply == AllocationMessage(125 if n == 2 else 0, False, before + part)
        competing_response(it, 9, AllocationMessage(99 if n == 2 else 0, False, before + part), now + 0.01)
    assert it.state is AllocatorStatus.ON
    assert it.competitor is not None
    assert it.competitor.responses == 3
    it.mode = AllocationMode.ON
    assert it.state is AllocatorStatus.STANDBY


def test_an_operator_can_resume_it() -> None:
    it = allocator()
    competing_response(it, 9, AllocationMessage(0, False, A[:6]), 0.0)
    it.resume()
    assert exchange(it, A, 1.0) == 125
