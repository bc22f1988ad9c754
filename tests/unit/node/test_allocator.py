"""The allocator: the rules of uavcan.protocol.dynamic_node_id.Allocation, a full table and competing allocators."""

from concurrent.futures import Future

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.node.allocator import RECYCLE_AFTER_S, AllocationMode, Allocator, AllocatorStatus, CompetingAllocator
from hornbill.node.directory import Directory
from hornbill.node.node_ids import find_free
from hornbill.node.waiting import AllocationRefusal, AllocationRequest
from hornbill.units import NodeId, Uid
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import AllocationMessage
from hornbill.wire.transfer import Transfer
from unit.node.table import MemoryTable, Neighbours, competing_response, exchange, request

A = bytes(range(0xA0, 0xB0))
B = bytes(range(0xB0, 0xC0))
C = bytes(range(0xC0, 0xD0))


def allocator(
    table: MemoryTable | None = None, neighbours: Neighbours | None = None, own: frozenset[int] = frozenset({127})
) -> Allocator:
    return Allocator(table or MemoryTable(), own_ids=own, known_nodes=neighbours or Neighbours())


def number(n: int) -> bytes:
    return n.to_bytes(16, "big")


# The free id.


def test_without_a_preference_the_highest_free_id_is_given() -> None:
    it = allocator()
    assert [exchange(it, each, 10.0 * n) for n, each in enumerate((A, B, C))] == [125, 124, 123]


SEARCHES: list[tuple[int, set[int], int | None]] = [
    (0, set(), 125),
    (0, {125, 124, 122}, 123),
    (20, set(), 20),
    (20, {20}, 21),
    (20, {20, 21, 23}, 22),
    (20, set(range(20, 126)), 19),
    (124, {124, 125}, 123),
    (1, {1}, 2),
    (125, {125}, 124),
    (126, set(), 125),
    (127, {125}, 124),
    (0, set(range(2, 126)), 1),
    (60, set(range(1, 126)), None),
]


@pytest.mark.parametrize(("preferred", "taken", "expected"), SEARCHES)
def test_the_search_goes_up_from_the_preference_then_down(
    preferred: int, taken: set[int], expected: int | None
) -> None:
    assert find_free(preferred, taken) == expected


@given(preferred=st.integers(0, 127), taken=st.sets(st.integers(0, 127)))
def test_an_id_is_found_if_and_only_if_one_is_free(preferred: int, taken: set[int]) -> None:
    found = find_free(preferred, taken)
    free = set(range(1, 126)) - taken
    assert found in free if free else found is None
    if preferred in free:
        assert found == preferred


def test_a_preferred_id_or_the_next_free_one_is_given() -> None:
    it = allocator(MemoryTable({"00" * 16: 20}))
    assert exchange(it, A, 0.0, preferred=20) == 21
    assert exchange(it, B, 10.0, preferred=20) == 22


def test_ids_in_use_and_our_own_are_never_allocated() -> None:
    neighbours = Neighbours({125: 0.0, 123: 0.0})
    it = allocator(neighbours=neighbours, own=frozenset({124, 122}))
    assert exchange(it, A, 1.0) == 121
    assert exchange(it, B, 2.0, preferred=122) == 120


def test_free_ids_are_neither_ours_nor_assigned_nor_in_use() -> None:
    it = allocator(MemoryTable({A.hex(): 10, B.hex(): 20}), Neighbours({20: 0.0, 30: 0.0}), frozenset({127, 60}))
    assert it.free(0.0) == 121
    assert it.free(3.0) == 122


def test_the_id_of_a_node_that_is_switched_off_is_allocated_last() -> None:
    neighbours = Neighbours({125: 0.0, **dict.fromkeys(range(1, 124), 1000.0)})
    it = allocator(neighbours=neighbours)
    assert exchange(it, A, 1000.0) == 124
    assert exchange(it, B, 1000.5) == 125


# The same node again.


def test_a_unique_id_gets_the_same_id_again_regardless_of_its_preference(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")
    table = MemoryTable()
    it = allocator(table)
    granted: list[tuple[str, int]] = []
    it.on_granted.append(lambda uid, node_id: granted.append((uid, node_id)))
    assert exchange(it, A, 0.0) == 125
    assert exchange(it, A, 1.0) == 125  # the response was lost
    assert table.recorded == granted == [(A.hex(), 125)] * 2
    assert caplog.messages == [f"node ID 125 assigned to {A.hex()}"] * 2
    assert exchange(it, B, 10.0) == 124
    assert exchange(it, B, 20.0, preferred=50) == 124
    assert exchange(it, A, 30.0) == 125
    assert exchange(allocator(table), B, 0.0) == 124  # the server was restarted


@pytest.mark.parametrize(
    ("error", "mode", "given"),
    [(None, AllocationMode.ON, True), (None, AllocationMode.OFF, False), (OSError(), AllocationMode.ON, False)],
)
def test_an_id_is_sent_as_soon_as_it_is_stored(error: OSError | None, mode: AllocationMode, given: bool) -> None:
    table, write = MemoryTable(), Future[None]()
    table.write = write
    it = allocator(table)
    sent, granted, refused = list[AllocationMessage](), list[tuple[str, int]](), list[AllocationRequest]()
    it.on_response.append(sent.append)
    it.on_granted.append(lambda uid, node_id: granted.append((uid, node_id)))
    it.on_refused.append(refused.append)
    assert [exchange(it, A, now) for now in (0.0, 1.0)] == [None, None]
    assert (table.recorded, sent, granted) == ([(A.hex(), 125)], [], [])  # stored once, though requested twice
    it.mode = mode
    write.set_exception(error) if error else write.set_result(None)
    assert (sent, granted) == (([AllocationMessage(125, False, A)], [(A.hex(), 125)]) if given else ([], []))
    assert [each.refused and each.refused.code for each in refused] == (["table_failed"] if error else [])
    assert [each.partial for each in it.pending(1.5)] == ([] if given else [A.hex()])
    it.mode, table.write = AllocationMode.ON, None
    assert exchange(it, A, 2.0) == 125


def test_a_node_that_restarts_keeps_its_id_although_it_was_just_seen() -> None:
    neighbours = Neighbours()
    it = allocator(neighbours=neighbours)
    assert exchange(it, A, 0.0) == 125
    neighbours.seen[125], neighbours.uids[125] = 10.0, A
    assert exchange(it, A, 10.7) == 125  # it sends its first request at least 0.6 s after its start
    for seen in (20.4, 20.5):
        neighbours.seen[125] = seen
        assert exchange(it, A, 20.5) == 125


def test_while_the_user_of_its_id_is_unknown_a_node_gets_none_and_the_user_is_identified() -> None:
    neighbours = Neighbours({20: 9.0})
    table = MemoryTable({A.hex(): 20})
    it = allocator(table, neighbours)
    unclear: list[int] = []
    it.on_unclear.append(unclear.append)
    assert exchange(it, A, 10.0) is None
    assert unclear == [20]
    assert exchange(it, B, 10.3) == 125  # other nodes do not wait
    neighbours.uids[20] = A  # it was the node itself, before its restart
    assert exchange(it, A, 11.0) == 20
    neighbours.seen[20], neighbours.uids[20] = 99.0, C
    assert exchange(it, A, 100.0) == 124
    assert unclear == [20]


def test_an_id_of_an_unidentified_node_returns_to_its_owner_after_three_seconds_of_silence() -> None:
    it = allocator(MemoryTable({A.hex(): 20}), Neighbours({20: 9.0}))
    assert [exchange(it, A, now) for now in (10.0, 11.0, 12.0)] == [None, None, 20]


def test_a_node_that_sends_while_the_owner_requests_is_another_node() -> None:
    neighbours = Neighbours({125: 9.0}, {125: A})
    table = MemoryTable({A.hex(): 125})
    it = allocator(table, neighbours)
    request(it, A[:6], 10.0, first=True)
    neighbours.seen[125] = 10.05
    request(it, A[6:12], 10.1)
    assert request(it, A[12:], 10.2) == AllocationMessage(124, False, A)


def test_a_node_seen_before_gets_its_former_id_unless_it_prefers_another() -> None:
    """The table is new, or another allocator allocated that ID."""
    neighbours = Neighbours({20: 5.0, 30: 5.0, 40: 5.0}, {20: A, 30: B, 40: C})
    it = allocator(MemoryTable({"00" * 16: 40}), neighbours)
    assert exchange(it, A, 10.0) == 20
    assert exchange(it, B, 11.0, preferred=60) == 60
    assert exchange(it, C, 12.0) == 125  # its former ID is allocated to another node


def test_remembered_ids_are_allocated_last() -> None:
    it = Allocator(MemoryTable(), own_ids=frozenset(), known_nodes=Directory(remembered=(125, 124)))
    assert exchange(it, A, 0.0) == 123


@pytest.mark.parametrize(
    "neighbours", [Neighbours({125: 9.5}, {125: B}), Neighbours({125: 9.8}), Neighbours({125: 9.5})]
)
def test_a_node_whose_id_is_used_by_another_gets_a_new_one(
    neighbours: Neighbours, caplog: pytest.LogCaptureFixture
) -> None:
    """Identified, or it sends while the owner is silent."""
    table = MemoryTable({A.hex(): 125})
    assert exchange(allocator(table, neighbours), A, 10.0) == 124
    assert table.kept == {A.hex(): 124}
    assert caplog.messages == [f"node ID 125 of {A.hex()} is used by another node: assigning a new one"]


def test_an_allocation_of_an_id_that_became_ours_or_is_reserved_is_replaced() -> None:
    table = MemoryTable({A.hex(): 125, B.hex(): 126, C.hex(): 1})
    it = allocator(table, own=frozenset({125}))
    assert [exchange(it, each, now) for now, each in enumerate((A, B, C))] == [124, 123, 1]


def test_a_pinned_id_is_never_replaced() -> None:
    neighbours = Neighbours()
    table = MemoryTable({A.hex(): 10}, frozenset({A.hex()}))
    it = allocator(table, neighbours)
    refusals: list[AllocationRequest] = []
    it.on_refused.append(refusals.append)
    assert exchange(it, A, 0.0) == 10
    neighbours.seen[10], neighbours.uids[10] = 99.0, B
    assert exchange(it, A, 100.0) is None
    assert exchange(it, A, 101.0) is None
    text = "Node ID 10 is pinned to this node, but another node uses it."
    assert [each.refused for each in refusals] == [AllocationRefusal("pinned_id_in_use", text, {"node_id": 10})]
    assert refusals[0].refusal == text
    assert table.kept == {A.hex(): 10}


# Stages.


def test_a_follow_up_after_half_a_second_is_too_late() -> None:
    it = allocator()
    request(it, A[:6], 0.0, first=True)
    assert request(it, A[6:12], 0.51) is None
    request(it, A[:6], 1.0, first=True)
    assert request(it, A[6:12], 1.5) == AllocationMessage(0, False, A[:12])
    assert request(it, A[12:], 2.01) is None
    assert exchange(it, A, 3.0) == 125


def test_a_first_part_restarts_the_exchange_at_any_stage() -> None:
    it = allocator()
    request(it, A[:6], 0.0, first=True)
    request(it, A[6:12], 0.1)
    assert exchange(it, B, 0.2) == 125
    assert request(it, A[12:], 0.5) is None
    assert exchange(it, A, 1.0) == 124


def test_unexpected_parts_are_ignored() -> None:
    it = allocator()
    assert request(it, A[6:12], 0.0) is None
    assert request(it, A[12:], 0.0) is None
    request(it, A[:6], 1.0, first=True)
    assert request(it, A[12:], 1.1) is None  # the third part before the second
    for wrong in (b"", A[:5], A[:7], A):
        assert request(it, wrong, 1.1) is None
        assert request(it, wrong, 1.1, first=True) is None
    assert request(it, A[6:12], 1.2) == AllocationMessage(0, False, A[:12])
    assert request(it, A[12:], 1.3) == AllocationMessage(125, False, A)


def test_unique_ids_with_the_same_beginning_are_distinguished() -> None:
    it = allocator()
    one, other = A[:12] + b"1111", A[:12] + b"2222"
    assert exchange(it, one, 0.0) == 125
    assert exchange(it, other, 1.0) == 124
    assert exchange(it, one, 2.0) == 125


@given(
    st.lists(
        st.tuples(
            st.floats(0, 0.6), st.booleans(), st.integers(0, 127), st.binary(max_size=16), st.sampled_from([0, 0, 0, 9])
        ),
        max_size=60,
    )
)
def test_no_message_raises_or_breaks_a_rule(
    messages: list[tuple[float, bool, int, bytes, int]],
) -> None:
    table = MemoryTable()
    it = allocator(table, Neighbours({100: 0.0}))
    now = 0.0
    for pause, first, node_id, part, source in messages:
        now += pause
        message = AllocationMessage(node_id, first, part)
        reply = it.handle(message, Transfer(Kind.MESSAGE, 1, source, 0, 24, 0, message.encode(), now), now)
        if reply is not None:
            assert source == 0
            assert not reply.first_part_of_unique_id
            assert (reply.node_id != 0) == (len(reply.unique_id) == 16)
            assert reply.node_id <= 125
            assert reply.node_id != 100
            assert reply.unique_id.endswith(part)
    assert len(set(table.kept.values())) == len(table.kept)


# Who waits.


def test_a_pending_request_is_listed_with_its_known_part() -> None:
    it = allocator()
    request(it, A[:6], 0.0, first=True)
    assert it.pending(0.0) == [AllocationRequest(A[:6].hex(), 1, 0.0, 0.0, 1)]
    request(it, A[6:12], 0.2)
    assert it.pending(0.2) == [AllocationRequest(A[:12].hex(), 2, 0.0, 0.2, 1)]
    request(it, B[:6], 0.3, first=True)
    request(it, A[:6], 1.3, first=True)
    # The known part is retained, although the exchange was restarted.
    assert it.pending(1.3) == [
        AllocationRequest(A[:12].hex(), 2, 0.0, 1.3, 2),
        AllocationRequest(B[:6].hex(), 1, 0.3, 0.3, 1),
    ]
    assert exchange(it, A, 2.0) == 125
    assert [each.partial for each in it.pending(2.2)] == [B[:6].hex()]
    assert it.pending(61.0) == []


def test_the_number_of_pending_requests_is_limited() -> None:
    it = allocator()
    for n in range(1000):
        request(it, number(n)[-6:], n * 0.01, first=True)
    assert len(it.pending(10.0)) == 256
    assert it.pending(10.0)[-1].partial == number(999)[-6:].hex()


def test_switched_off_it_lists_requests_and_does_not_respond() -> None:
    it = allocator()
    it.mode = AllocationMode.OFF
    assert it.state is AllocatorStatus.OFF
    assert request(it, A[:6], 0.0, first=True) is None
    assert [each.partial for each in it.pending(0.0)] == [A[:6].hex()]
    it.mode = AllocationMode.ON
    assert exchange(it, A, 1.0) == 125


# Before we know the bus.


def test_a_new_id_is_not_allocated_before_listening_to_the_bus() -> None:
    table = MemoryTable({A.hex(): 99})
    it = Allocator(table, own_ids=frozenset(), known_nodes=Neighbours(), listening_since=100.0)
    assert exchange(it, B, 100.1) is None
    assert exchange(it, A, 100.2) == 99  # a known node does not wait
    assert exchange(it, B, 100.3) == 125  # the last part comes half a second after the start


# A full table.


def test_without_a_free_id_the_request_is_refused_and_logged(caplog: pytest.LogCaptureFixture) -> None:
    table = MemoryTable({number(n).hex(): n for n in range(1, 126)})
    it = allocator(table)
    refusals: list[AllocationRequest] = []
    it.on_refused.append(refusals.append)
    assert exchange(it, A, 0.0) is None
    assert exchange(it, A, 1.0) is None
    text = "All 125 node IDs are taken. Remove allocations of nodes no longer in use."
    full = AllocationRefusal("all_taken", text, {"node_ids": 125})
    assert [(each.partial, each.refused) for each in refusals] == [(A.hex(), full)]
    assert caplog.messages == [f"no node ID for {A.hex()}: {text}"]
    assert [(each.refused, each.attempts) for each in it.pending(1.2)] == [(full, 2)]
    del table.kept[number(7).hex()]
    assert exchange(it, A, 2.0) == 7
    assert it.pending(2.2) == []


def away(oldest_s: float, *, pins: frozenset[str] = frozenset()) -> MemoryTable:
    """A full table; number(n) was absent for a second less than its predecessor."""
    table = MemoryTable({number(n).hex(): n for n in range(1, 126)}, pins)
    table.away_s = {number(n).hex(): oldest_s - n for n in range(1, 126)}
    return table


@pytest.mark.parametrize(("idle", "given"), [(1, 1), (125, 125), (126, None)])
def test_only_dynamic_ids_are_recycled(idle: int, given: int | None, caplog: pytest.LogCaptureFixture) -> None:
    table = MemoryTable({number(n).hex(): n for n in range(1, 127)})
    table.away_s = {number(idle).hex(): RECYCLE_AFTER_S + 1}
    assert exchange(allocator(table), A, 0.0) == given
    if given:
        text = f"node ID {idle} of {number(idle).hex()} reassigned to another node: no free ID left"
        assert caplog.messages == [text]


def test_in_a_full_table_the_id_unused_for_longest_is_recycled() -> None:
    table = away(RECYCLE_AFTER_S + 100)
    it = allocator(table, Neighbours({1: 2.0, 3: 2.0}))
    lost: list[tuple[Uid, NodeId]] = []
    it.on_recycled.append(lambda uid, node_id: lost.append((uid, node_id)))
    assert exchange(it, A, 1.0, preferred=77) == 2  # number(1) is present
    assert exchange(it, B, 2.0) == 4
    assert lost == [(number(2).hex(), 2), (number(4).hex(), 4)]
    assert len(table.kept) == 125
    assert exchange(it, number(2), 3.0) == 5  # a returning node counts as new


def test_in_a_full_table_pinned_present_and_recent_nodes_keep_their_ids() -> None:
    table = away(RECYCLE_AFTER_S + 3.5, pins=frozenset({number(1).hex()}))  # 1, 2 and 3 were away for long enough
    it = allocator(table, Neighbours({2: 0.0}), own=frozenset({3, 127}))
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
    assert [each.refused and each.refused.code for each in refusals] == ["table_failed"]
    table.broken = False
    assert exchange(it, A, 1.0) == 125


# Another allocator.


def test_it_goes_to_standby_when_another_allocator_responds(caplog: pytest.LogCaptureFixture) -> None:
    table = MemoryTable()
    it = allocator(table)
    request(it, A[:6], 0.0, first=True)
    assert competing_response(it, 9, AllocationMessage(5, False, A[:6]), 0.4) is None
    assert it.state is AllocatorStatus.STANDBY
    assert it.competitor == CompetingAllocator(9, 0.4, 1)
    assert request(it, A[6:12], 0.8) is None  # half a second after the response
    competing_response(it, 9, AllocationMessage(0, False, A[:12]), 0.9)
    assert [(each.partial, each.stage) for each in it.pending(1.0)] == [(A[:12].hex(), 2)]
    assert request(it, A[12:], 1.1) is None
    competing_response(it, 9, AllocationMessage(0, False, A), 1.2)
    assert [each.stage for each in it.pending(1.2)] == [3]
    competing_response(it, 9, AllocationMessage(77, False, A), 1.2)
    assert it.pending(1.2) == []
    assert table.recorded == []
    assert it.competitor == CompetingAllocator(9, 1.2, 4)
    assert caplog.messages == ["node 9 is a competing node ID allocator"]


@pytest.mark.parametrize(("own", "ignored"), [([127], 3), (list[int](), 3), ([124, 5], 6), ([119], 3)])
def test_it_returns_when_the_other_allocator_ignores_some_requests(
    own: list[int], ignored: int, caplog: pytest.LogCaptureFixture
) -> None:
    """Two of us have different limits, so that they do not resume at the same request."""
    it = allocator(own=frozenset(own))
    found, gone = list[CompetingAllocator](), list[CompetingAllocator]()
    it.on_competitor_found.append(found.append)
    it.on_competitor_gone.append(gone.append)
    for begin in (0.0, 100.0):
        competing_response(it, 9, AllocationMessage(0, False, A[:6]), begin)
        for n in range(ignored):
            assert request(it, A[:6], begin + 1 + n, first=True) is None
        assert len(gone) == len(found) - 1
        assert exchange(it, A, begin + 50) is not None
        assert it.state is AllocatorStatus.ON
    assert found == gone == [CompetingAllocator(9, begin, 1) for begin in (0.0, 100.0)]
    assert "node 9 no longer allocates node IDs" in caplog.messages


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
    it.own_id_shared = True
    it.resume()
    assert exchange(it, A, 1.0) == 125
    it.own_id_shared = True
    assert it.state is AllocatorStatus.STANDBY
