"""How often nodes that are no servos are asked, over hours, and which of them may be servos."""

from collections.abc import Callable
from itertools import pairwise

import pytest

from hornbill.node.directory import NodeRecord
from hornbill.servo.device.foreign_nodes import CURIOUS, POLITE, ForeignNodes
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus

NODE = 33
Outcome = Callable[[ForeignNodes], None]


class Clock:
    """Stands still unless a test moves it."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def record(restarts: int = 0) -> NodeRecord:
    return NodeRecord(NODE, NodeStatus(1, NodeHealth.OK, Mode.OPERATIONAL), 0.0, 0.0, restarts=restarts)


def rounds(outcome: Outcome, hours: float = 10, *, actuator: bool = False) -> list[float]:
    """The instants at which a node is asked that always behaves the same; it says NodeStatus once a second."""
    clock, asked = Clock(), list[float]()
    strangers = ForeignNodes(clock)
    for second in range(round(hours * 3600)):
        clock.now = second
        if actuator:
            strangers.heard_status(NODE)
        if strangers.due(record()):
            asked.append(second)
            outcome(strangers)
    return asked


def silent(strangers: ForeignNodes) -> None:
    strangers.silent(NODE)


def deaf(strangers: ForeignNodes) -> None:
    strangers.deaf(NODE)


def refused(strangers: ForeignNodes) -> None:
    strangers.refused(NODE)


@pytest.mark.parametrize("outcome", [silent, deaf])
def test_a_node_that_does_not_answer_is_asked_ever_more_rarely(outcome: Outcome) -> None:
    asked = rounds(outcome)
    assert asked[:7] == [0, 2, 10, 42, 170, 682, 2730]
    pauses = [after - before for before, after in pairwise(asked)]
    assert pauses == sorted(pauses)
    assert set(pauses[6:]) == {3600}


def test_a_foreign_node_is_asked_four_times_and_never_again() -> None:
    assert rounds(refused) == [0, 2, 10, 42]


@pytest.mark.parametrize(("outcome", "longest"), [(silent, 30), (deaf, 30), (refused, 300)])
def test_an_actuator_is_asked_for_ever_for_it_may_be_a_servo(outcome: Outcome, longest: float) -> None:
    asked = rounds(outcome, 1, actuator=True)
    pauses = [after - before for before, after in pairwise(asked)]
    assert pauses == sorted(pauses)
    assert pauses[:3] == [1, 1, 2]
    assert pauses[-1] == longest


def test_an_actuator_may_be_a_servo_until_it_refused_five_times() -> None:
    strangers = ForeignNodes(Clock())
    assert not strangers.is_foreign(NODE)
    assert strangers.due(record())
    strangers.heard_status(NODE)
    for _ in range(4):
        strangers.refused(NODE)
        assert strangers.suspects() == [NODE]
        assert "stop writes torque off" in getattr(strangers.note(NODE), "text", "")
    strangers.refused(NODE)
    assert strangers.is_foreign(NODE)
    assert strangers.suspects() == []
    assert "stop" not in getattr(strangers.note(NODE), "text", "")


def test_what_never_answers_and_broadcasts_status_may_always_be_a_servo() -> None:
    clock = Clock()
    strangers = ForeignNodes(clock)
    for second in range(100):
        clock.now = second
        strangers.heard_status(NODE)
        strangers.silent(NODE)
        assert strangers.suspects() == [NODE]
    clock.now += 3.1
    assert strangers.suspects() == []


@pytest.mark.parametrize("outcome", [deaf, refused])
def test_without_status_a_node_is_foreign_after_one_round(outcome: Outcome) -> None:
    strangers = ForeignNodes(Clock())
    outcome(strangers)
    assert strangers.is_foreign(NODE)
    assert strangers.note(NODE)


def test_a_node_that_starts_anew_is_asked_at_once_and_knows_no_past() -> None:
    clock = Clock()
    strangers = ForeignNodes(clock)
    assert strangers.due(record())
    strangers.refused(NODE)
    clock.now = 0.5
    assert not strangers.due(record())
    assert strangers.due(record(restarts=1))
    assert not strangers.is_foreign(NODE)
    assert strangers.note(NODE) is None


def test_the_first_status_of_an_actuator_ends_the_wait() -> None:
    clock = Clock()
    strangers = ForeignNodes(clock)
    assert strangers.due(record())
    assert strangers.patience(NODE) == POLITE
    for _ in range(4):
        strangers.refused(NODE)
    clock.now = 99.0
    assert not strangers.due(record())
    strangers.heard_status(NODE)
    assert strangers.due(record())
    assert strangers.patience(NODE) == CURIOUS


def test_somebody_who_needs_to_know_does_not_wait() -> None:
    clock = Clock()
    strangers = ForeignNodes(clock)
    strangers.hurry(NODE)
    assert strangers.due(record())
    strangers.silent(NODE)
    assert not strangers.due(record())
    strangers.hurry(NODE)
    assert strangers.due(record())
    strangers.wait(NODE, 5.0)
    clock.now = 4.9
    assert not strangers.due(record())
    strangers.heard_status(NODE)
    strangers.forget(NODE)
    assert strangers.due(record())
    assert strangers.suspects() == [], "as a servo it is no suspect any more"
