"""Section 2.3, dynamic node id: rules A to E of the public type and the delays of table 2-2."""

from itertools import pairwise
from random import Random

import pytest

from hornbill.sim.allocation import Allocatee
from hornbill.wire.messages import AllocationMessage
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import decode
from unit.sim.desk import START, Desk

BOOT = 0.1


def requests(transfers: list[Transfer]) -> list[tuple[float, AllocationMessage]]:
    decoded = [(each.at, decode(each)) for each in transfers]
    return [(at, message) for at, message in decoded if isinstance(message, AllocationMessage)]


def next_request(desk: Desk, longest: float = 1.01) -> tuple[float, AllocationMessage]:
    """The next request, and how long it was in coming."""
    began = desk.now
    while not (sent := requests(desk.wait(0.002))):
        assert desk.now - began < longest, "no request came"
    return sent[0][0] - began, sent[0][1]


def allocate(desk: Desk, node_id: int) -> None:
    uid = desk.servo.uid
    next_request(desk)
    for known in (6, 12):
        desk.allocation(0, uid[:known])
        next_request(desk, 0.41)
    desk.allocation(node_id, uid)


@pytest.mark.states("B04")
def test_the_first_request_comes_600_to_1000_ms_after_the_start_and_is_repeated() -> None:
    for seed in range(20):
        desk = Desk(node_id=0, seed=seed, up=False)
        desk.servo.power_on(START)
        sent = requests(desk.wait(5.0))
        gaps = [
            sent[0][0] - START - BOOT,
            *(later[0] - earlier[0] for earlier, later in pairwise(sent)),
        ]
        assert all(0.6 <= gap <= 1.0 for gap in gaps)
        assert all(message == AllocationMessage(0, True, desk.servo.uid[:6]) for _, message in sent)


@pytest.mark.states("B04")
def test_requests_are_anonymous_with_priority_24() -> None:
    desk = Desk(node_id=0)
    assert {(each.source, each.priority) for each in desk.wait(3.0)} == {(0, 24)}


@pytest.mark.states("B04")
def test_parts_of_6_6_and_4_bytes_lead_to_a_node_id() -> None:
    desk = Desk(node_id=0)
    uid = desk.servo.uid
    _, first = next_request(desk)
    assert first == AllocationMessage(0, True, uid[:6])
    desk.allocation(0, uid[:6])
    delay, second = next_request(desk, 0.41)
    assert second == AllocationMessage(0, False, uid[6:12])
    assert 0.0 <= delay <= 0.401
    desk.allocation(0, uid[:12])
    delay, third = next_request(desk, 0.41)
    assert third == AllocationMessage(0, False, uid[12:])
    assert 0.0 <= delay <= 0.401
    assert desk.servo.node_id == 0
    desk.allocation(125, uid)
    assert desk.servo.node_id == 125
    heard = desk.wait(0.01)
    assert {each.type_id for each in heard} == {341, 1011}
    assert {each.source for each in heard} == {125}


@pytest.mark.states("B04")
def test_with_an_id_it_asks_no_more_and_hears_no_allocator() -> None:
    desk = Desk(node_id=0)
    allocate(desk, 33)
    assert requests(desk.wait(5.0)) == []
    desk.allocation(44, desk.servo.uid)
    assert desk.servo.node_id == 33


@pytest.mark.states("B04")
def test_every_allocation_message_restarts_the_timer() -> None:
    desk = Desk(node_id=0)
    for _ in range(10):
        assert requests(desk.wait(0.55)) == []
        desk.allocation(0, b"other!", source=0)


@pytest.mark.states("B04")
def test_a_message_during_the_follow_up_delay_ends_that_attempt() -> None:
    desk = Desk(node_id=0)
    next_request(desk)
    desk.allocation(0, desk.servo.uid[:6])
    desk.allocation(0, b"other!", source=0)
    delay, message = next_request(desk)
    assert message.first_part_of_unique_id
    assert delay >= 0.599


@pytest.mark.states("B04")
def test_an_answer_to_somebody_else_or_from_another_node_that_asks_is_not_for_it() -> None:
    for message, source in ((b"other!", 126), (None, 0)):
        desk = Desk(node_id=0)
        next_request(desk)
        desk.allocation(0, message or desk.servo.uid[:6], source=source)
        assert next_request(desk)[1].first_part_of_unique_id


@pytest.mark.states("B04")
def test_the_whole_id_without_a_node_id_assigns_nothing() -> None:
    desk = Desk(node_id=0)
    next_request(desk)
    desk.allocation(0, desk.servo.uid)
    assert desk.servo.node_id == 0
    assert next_request(desk)[1].first_part_of_unique_id


@pytest.mark.states("B03")
def test_without_an_id_no_request_is_answered_and_no_command_obeyed() -> None:
    desk = Desk(node_id=0)
    assert desk.node_info() is None
    desk.array(255, 1, 0.5)
    desk.wait(0.3)
    assert desk.servo.register(0x00) == 0


@pytest.mark.states("B02")
def test_a_static_id_is_used_at_once_and_never_asked_for() -> None:
    desk = Desk(node_id=17, up=False)
    desk.servo.power_on(START)
    heard = desk.wait(3.0)
    assert heard[0].at - START <= BOOT + 0.001
    assert {each.source for each in heard} == {17}
    assert requests(heard) == []


@pytest.mark.states("B47", "B51")
def test_a_restart_asks_anew() -> None:
    desk = Desk(node_id=0)
    allocate(desk, 50)
    assert desk.restart() is True
    assert desk.servo.node_id == 0
    desk.wait(0.2)
    allocate(desk, 51)
    assert desk.servo.node_id == 51


def test_the_discriminator_changes_between_requests() -> None:
    desk = Desk(node_id=0)
    ids: list[int] = []
    for _ in range(8):
        while not (frames := desk.servo.take_outbox()):
            desk.now += 0.01
            desk.servo.advance(desk.now)
        ids += [frame.id for frame in frames]
    assert len(set(ids)) == 8
    assert {each & 0x7F for each in ids} == {0}


def test_two_servos_draw_different_delays() -> None:
    firsts = set[float]()
    for seed in range(10):
        allocatee = Allocatee(bytes(16), Random(seed))
        allocatee.begin(0.0)
        firsts.add(allocatee.due)
    assert len(firsts) == 10
