"""Order of requests: priority, then nodes in turn, then order of arrival."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.node.backlog import Backlog
from hornbill.node.lanes import Lanes
from hornbill.wire.port import PortStatistics


def drain(lanes: Lanes[str]) -> list[str]:
    """Take all items, freeing each node at once."""
    taken: list[str] = []
    while (item := lanes.take()) is not None:
        taken.append(item)
        lanes.free(int(item[0]))
    return taken


@pytest.mark.parametrize(
    ("items", "order"),
    [
        ("1a24 1b24 1c24 2a24 2b24 3a24", ["1a", "2a", "3a", "1b", "2b", "1c"]),
        ("1a24 2a24 3a20 1b17 2b24", ["1b", "3a", "2a", "1a", "2b"]),
    ],
    ids=["nodes take turns, each in its order", "higher priority first, within a node and among nodes"],
)
def test_the_order_of_items(items: str, order: list[str]) -> None:
    lanes = Lanes[str]()
    for item in items.split():
        lanes.put(int(item[0]), int(item[2:]), item[:2])
    assert drain(lanes) == order


def test_an_item_is_preempted_only_by_higher_priority_and_returns_before_its_equals() -> None:
    lanes = Lanes[str]()
    for item, priority in (("1a", 24), ("1b", 24), ("2a", 20)):
        lanes.put(int(item[0]), priority, item)
    assert lanes.take() == "2a"
    assert lanes.take() == "1a"
    assert not lanes.preempt(1, 24, "1a")
    assert lanes.take() is None
    for item in ("1c", "1d"):
        lanes.put(1, 17, item)
    assert lanes.preempt(1, 24, "1a")
    lanes.free(2)
    assert drain(lanes) == ["1c", "1d", "1a", "1b"]


def test_a_busy_node_gets_nothing_until_it_is_free_even_if_its_items_are_dropped() -> None:
    lanes = Lanes[str]()
    for item in ("1a", "1b", "2a"):
        lanes.put(int(item[0]), 24, item)
    assert [lanes.take(), lanes.take(), lanes.take()] == ["1a", "2a", None]
    assert not lanes
    lanes.free(1)
    assert lanes
    assert lanes.take() == "1b"
    lanes.put(2, 24, "2b")
    lanes.clear()
    for node in (1, 2):
        lanes.free(node)
        assert not lanes
    lanes.put(1, 24, "1c")
    assert lanes.take() == "1c"


@given(st.lists(st.tuples(st.integers(1, 4), st.integers(16, 19)), max_size=40), st.randoms())
def test_every_item_is_taken_once_and_never_two_for_one_node(puts: list[tuple[int, int]], random: Random) -> None:
    lanes = Lanes[tuple[int, int, int]]()
    under_way: dict[int, tuple[int, int, int]] = {}
    taken: list[tuple[int, int, int]] = []
    pending = [(node, priority, number) for number, (node, priority) in enumerate(puts)]
    while pending or lanes or under_way:
        if pending and random.random() < 0.5:
            item = pending.pop(0)
            lanes.put(item[0], item[1], item)
        elif (item := lanes.take()) is not None:
            assert item[0] not in under_way
            under_way[item[0]] = item
            taken.append(item)
        elif under_way:
            node, _ = under_way.popitem()
            lanes.free(node)
    assert sorted(taken) == sorted((node, priority, number) for number, (node, priority) in enumerate(puts))


def test_a_backlog_is_empty_when_the_port_sent_everything() -> None:
    statistics, now = PortStatistics(tx_frames=100), 1.002
    backlog = Backlog(statistics, lambda: now)
    assert backlog.is_empty()
    backlog.queue(3, 1.0)
    backlog.queue(1, 1.001)
    statistics.tx_frames = 103
    assert not backlog.is_empty()
    statistics.tx_frames = 104
    assert backlog.is_empty()


def test_dropped_frames_do_not_block_the_backlog() -> None:
    statistics, now = PortStatistics(), 1.004
    backlog = Backlog(statistics, lambda: now)
    backlog.queue(3, 1.0)
    assert not backlog.is_empty()
    now = 1.006
    assert backlog.is_empty()
    statistics.tx_frames, now = 10, 2.0  # another sender on the same port
    backlog.queue(1, 2.0)
    assert not backlog.is_empty()
    statistics.tx_frames = 11
    assert backlog.is_empty()
