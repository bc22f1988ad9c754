"""Detection of two nodes with one node ID, and of lost responses."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.servo.doctor.watch import MessageTimes, NodeWatch, RequestWatch, two_counters

IDS = st.integers(0, 31)


def counter(start: int, length: int) -> list[int]:
    return [(start + number) % 32 for number in range(length)]


@given(IDS, IDS)
def test_two_counters_in_turn_are_two_nodes(one: int, other: int) -> None:
    pairs = zip(counter(one, 4), counter(other, 4), strict=True)
    assert two_counters([each for pair in pairs for each in pair])


@given(IDS, st.lists(st.booleans(), min_size=24, max_size=24))
def test_one_counter_on_a_lossy_bus_is_one_node(start: int, lost: list[bool]) -> None:
    received = [each for each, is_lost in zip(counter(start, 24), lost, strict=True) if not is_lost]
    assert not two_counters(received[-8:])


@given(IDS, st.integers(0, 31))
def test_a_node_that_counts_in_other_steps_is_one_node(start: int, step: int) -> None:
    assert not two_counters([(start + step * number) % 32 for number in range(8)])


@given(st.lists(IDS, max_size=8))
def test_no_sequence_raises(ids: list[int]) -> None:
    two_counters(ids)


def test_a_stream_is_doubled_only_while_it_is_received() -> None:
    stream = MessageTimes()
    for number in range(8):
        stream.take(number // 2 + (17 if number % 2 else 0), 100.0 + number / 2)
    assert stream.doubled(104.0, 1.0)
    assert not stream.doubled(106.6, 1.0)
    for number in range(4):
        stream.take((21 + number) % 32, 107.0 + number)
    assert not stream.doubled(110.0, 1.0)


@pytest.mark.parametrize("loss", [0.1, 0.3, 0.5])
def test_a_lossy_stream_of_a_thousand_messages_is_never_doubled(loss: float) -> None:
    stream, chance = MessageTimes(), Random(7)
    for number in range(1000):
        if chance.random() >= loss:
            stream.take(number % 32, number / 10)
            assert not stream.doubled(number / 10, 0.1)


def test_a_response_is_lost_only_if_the_node_sends_other_messages() -> None:
    requests = RequestWatch()
    requests.on_request(1, 10.0)
    requests.on_request(2, 10.1)
    requests.on_response(2)
    requests.on_other_message(10.25)
    assert requests.unanswered == 0
    requests.on_other_message(10.35)
    assert (requests.unanswered, requests.unanswered_since, list(requests.lost)) == (1, 10.0, [10.0])
    requests.on_request(3, 11.0)
    requests.on_response(3)
    assert (requests.unanswered, requests.unanswered_since, list(requests.lost)) == (0, None, [10.0])


def test_a_late_response_is_not_lost() -> None:
    requests = RequestWatch()
    for transfer_id in (1, 2):
        requests.on_request(transfer_id, 10.0 + transfer_id / 100)
    requests.on_other_message(10.5)
    requests.on_response(1)
    assert list(requests.lost) == [10.02]
    requests.on_response(1)
    assert list(requests.lost) == [10.02]


def test_a_request_before_a_restart_is_not_lost() -> None:
    node = NodeWatch()
    node.on_node_status(0, 70, 100.0)
    node.registers.on_request(5, 100.1)
    node.on_node_status(0, 0, 100.6)
    node.on_node_status(1, 1, 101.6)
    assert list(node.registers.lost) == []


def test_a_request_before_a_silence_is_not_lost() -> None:
    node = NodeWatch()
    node.on_status(0, 7, 100.0)
    node.registers.on_request(5, 100.05)
    node.on_status(1, 7, 103.0)
    assert list(node.registers.lost) == []
    assert node.servo_id_since == 103.0


@given(IDS, IDS, IDS, st.integers(1, 4), st.integers(1, 3))
def test_a_node_that_restarts_twice_is_one_node(one: int, two: int, three: int, first: int, second: int) -> None:
    assert not two_counters(counter(one, first) + counter(two, second) + counter(three, 8 - first - second))
