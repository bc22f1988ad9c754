"""Sections 2.3 and 4.38, node ID: its own from 0x46, or requested by rules A to E with the delays of table 2-2."""

from itertools import pairwise

import pytest

from hornbill.wire.messages import AllocationMessage
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import decode
from unit.sim.desk import QUIET, START, Desk

BOOT = 0.1


def requests(transfers: list[Transfer]) -> list[tuple[float, AllocationMessage]]:
    decoded = [(each.at, decode(each)) for each in transfers]
    return [(at, message) for at, message in decoded if isinstance(message, AllocationMessage)]


def next_request(desk: Desk, longest: float = 1.01) -> tuple[float, AllocationMessage]:
    """The next request and the time until it was sent."""
    began = desk.now
    while not (sent := requests(desk.wait(0.002))):
        assert desk.now - began < longest, "no request was sent"
    return sent[0][0] - began, sent[0][1]


def allocate(desk: Desk, node_id: int) -> None:
    """Grant a node ID, and check the three requests for it."""
    uid = desk.servo.uid
    assert next_request(desk)[1] == AllocationMessage(0, True, uid[:6])
    for known, part in ((6, uid[6:12]), (12, uid[12:])):
        desk.allocation(0, uid[:known])
        delay, message = next_request(desk, 0.41)
        assert message == AllocationMessage(0, False, part)
        assert 0.0 <= delay <= 0.401
    assert desk.servo.node_id == 0
    desk.allocation(node_id, uid)
    assert desk.servo.node_id == node_id


@pytest.mark.states("B04")
def test_the_first_request_is_sent_600_to_1000_ms_after_the_start_and_repeated() -> None:
    delays: set[float] = set()
    for seed in range(20):
        desk = Desk(node_id=0, seed=seed, up=False)
        desk.servo.power_on(START)
        transfers = desk.wait(5.0)
        assert {(each.source, each.priority) for each in transfers} == {(0, 24)}
        sent = requests(transfers)
        gaps = [sent[0][0] - START - BOOT, *(later[0] - earlier[0] for earlier, later in pairwise(sent))]
        assert all(0.6 <= gap <= 1.0 for gap in gaps)
        assert all(message == AllocationMessage(0, True, desk.servo.uid[:6]) for _, message in sent)
        delays.add(gaps[0])
    assert len(delays) == 20, "servos draw different delays"


@pytest.mark.states("B04")
def test_parts_of_6_6_and_4_bytes_lead_to_a_node_id_after_which_allocators_are_ignored() -> None:
    desk = Desk(node_id=0)
    allocate(desk, 125)
    sent = desk.wait(5.0)
    assert ({each.type_id for each in sent}, {each.source for each in sent}) == ({341, 1011}, {125})
    desk.allocation(44, desk.servo.uid)
    assert desk.servo.node_id == 125


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
@pytest.mark.parametrize(("known", "source"), [(b"other!", 126), (6, 0), (16, 126)])
def test_other_responses_assign_nothing(known: bytes | int, source: int) -> None:
    """For another servo; from a node that requests itself; the whole unique ID without a node ID."""
    desk = Desk(node_id=0)
    next_request(desk)
    desk.allocation(0, desk.servo.uid[:known] if isinstance(known, int) else known, source=source)
    assert desk.servo.node_id == 0
    assert next_request(desk)[1].first_part_of_unique_id


@pytest.mark.states("B03")
def test_without_a_node_id_it_neither_responds_nor_obeys() -> None:
    desk = Desk(node_id=0)
    assert desk.node_info() is None
    desk.array(255, 1, 0.5)
    desk.wait(0.3)
    assert desk.servo.register(0x00) == 0


@pytest.mark.states("B02")
@pytest.mark.parametrize("node_id", [1, 17, 127])
def test_a_static_node_id_is_used_immediately_and_never_requested(node_id: int) -> None:
    desk = Desk(node_id=node_id, up=False)
    desk.servo.power_on(START)
    sent = desk.wait(3.0)
    assert sent[0].at - START <= BOOT + 0.001
    assert {each.source for each in sent} == {node_id}
    assert requests(sent) == []
    assert desk.read("0x46") == node_id


@pytest.mark.states("B47", "B51")
@pytest.mark.parametrize("by", ["restart", "save"])
def test_a_restart_requests_a_node_id_again(by: str) -> None:
    desk = Desk(node_id=0)
    allocate(desk, 50)
    assert (desk.restart() if by == "restart" else desk.write("0x12", 1)) == 1
    desk.wait(0.3)
    assert desk.servo.node_id == 0
    allocate(desk, 51)


@pytest.mark.states("B02", "B96")
@pytest.mark.parametrize("saved", [False, True])
@pytest.mark.parametrize("node_id", [0, 50])
def test_a_new_node_id_is_used_from_the_next_start_on_if_saved(node_id: int, saved: bool) -> None:
    desk = Desk(rom=QUIET)
    assert desk.write("0x46", node_id) == node_id
    desk.wait(5.0)
    assert {each.source for each in desk.received} == {42}
    if saved:
        desk.save("opcode")
    else:
        desk.power_cycle()
    expected = node_id if saved else 42
    assert (desk.servo.node_id, desk.servo.register(0x46)) == (expected, expected)
    assert ({each.type_id for each in desk.wait(3.0)} == {1}) is (expected == 0)


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
