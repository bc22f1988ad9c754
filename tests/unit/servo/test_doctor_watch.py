"""The tests of how the doctor tells two nodes with one node id, and lost answers, from what is well."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.servo.doctor.watch import MessageTimes, NodeWatch, RequestWatch, two_counters

IDS = st.integers(0, 31)


def counter(start: int, length: int) -> list[int]:
    return [(start + number) % 32 for number in range(length)]


@given(IDS)
def test_one_counter_is_one_node(start: int) -> None:
    assert not two_counters(counter(start, 8))


@given(IDS, IDS, st.integers(0, 8))
def test_a_node_that_starts_anew_is_one_node(before: int, after: int, where: int) -> None:
    assert not two_counters(counter(before, where) + counter(after, 8 - where))


@given(IDS, IDS)
def test_two_counters_in_turn_are_two_nodes(one: int, other: int) -> None:
    pairs = zip(counter(one, 4), counter(other, 4), strict=True)
    assert two_counters([each for pair in pairs for each in pair])


@given(IDS, st.lists(st.booleans(), min_size=24, max_size=24))
def test_one_counter_on_a_lossy_bus_is_one_node(start: int, lost: list[bool]) -> None:
    heard = [each for each, is_lost in zip(counter(start, 24), lost, strict=True) if not is_lost]
    assert not two_counters(heard[-8:])


@given(IDS, st.integers(0, 31))
def test_a_node_that_counts_in_steps_of_its_own_is_one_node(start: int, step: int) -> None:
    assert not two_counters([(start + step * number) % 32 for number in range(8)])


@given(st.lists(IDS, max_size=8))
def test_no_sequence_raises(ids: list[int]) -> None:
    two_counters(ids)


def test_a_stream_is_doubled_only_while_it_is_heard() -> None:
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


def test_an_answer_is_lost_only_when_the_node_goes_on_talking() -> None:
    questions = RequestWatch()
    questions.on_request(1, 10.0)
    questions.on_request(2, 10.1)
    questions.on_response(2)
    questions.on_other_message(10.25)
    assert questions.unanswered == 0
    questions.on_other_message(10.35)
    assert (questions.unanswered, questions.unanswered_since, list(questions.lost)) == (1, 10.0, [10.0])
    questions.on_request(3, 11.0)
    questions.on_response(3)
    assert (questions.unanswered, questions.unanswered_since, list(questions.lost)) == (0, None, [10.0])


def test_an_answer_that_comes_late_is_not_lost() -> None:
    questions = RequestWatch()
    for transfer_id in (1, 2):
        questions.on_request(transfer_id, 10.0 + transfer_id / 100)
    questions.on_other_message(10.5)
    questions.on_response(1)
    assert list(questions.lost) == [10.02]
    questions.on_response(1)
    assert list(questions.lost) == [10.02]


def test_what_was_asked_before_a_restart_is_not_lost() -> None:
    node = NodeWatch()
    node.on_node_status(0, 70, 100.0)
    node.registers.on_request(5, 100.1)
    node.on_node_status(0, 0, 100.6)
    node.on_node_status(1, 1, 101.6)
    assert list(node.registers.lost) == []


def test_what_was_asked_before_a_silence_is_not_lost() -> None:
    node = NodeWatch()
    node.on_status(0, 7, 100.0)
    node.registers.on_request(5, 100.05)
    node.on_status(1, 7, 103.0)
    assert list(node.registers.lost) == []
    assert node.servo_id_since == 103.0


@given(IDS, IDS, IDS, st.integers(1, 4), st.integers(1, 3))
def test_a_node_that_starts_anew_twice_is_one_node(one: int, two: int, three: int, first: int, second: int) -> None:
    assert not two_counters(counter(one, first) + counter(two, second) + counter(three, 8 - first - second))
