"""Foreign nodes: how often they are requested over hours, and which of them may be servos."""

from collections.abc import Callable
from itertools import pairwise
from operator import methodcaller

import pytest

from hornbill.node.directory import NodeRecord
from hornbill.servo.device.foreign_nodes import UNKNOWN_ACTUATOR, UNKNOWN_NODE, ForeignNodes
from hornbill.wire.messages import ActuatorStatus, Mode, NodeHealth, NodeStatus

NODE = 33
STATUS = ActuatorStatus(7, 0.5, float("nan"), float("nan"), 127)
Outcome = Callable[[ForeignNodes], None]


class Clock:
    """Stands still unless a test moves it."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def record(restarts: int = 0) -> NodeRecord:
    return NodeRecord(NODE, NodeStatus(1, NodeHealth.OK, Mode.OPERATIONAL), 0.0, 0.0, restarts=restarts)


def rounds(outcome: Outcome, hours: float = 10, *, actuator: bool = False) -> list[float]:
    """The times of the requests to a node with this behaviour, which sends NodeStatus once a second."""
    clock, requests = Clock(), list[float]()
    foreign_nodes = ForeignNodes(clock)
    for second in range(round(hours * 3600)):
        clock.now = second
        if actuator:
            foreign_nodes.on_status(NODE, STATUS)
        if foreign_nodes.due(record()):
            requests.append(second)
            outcome(foreign_nodes)
    return requests


no_node_info, no_parameters, refused = (
    methodcaller(name, NODE) for name in ("no_node_info", "no_parameters", "refused")
)


@pytest.mark.parametrize("outcome", [no_node_info, no_parameters])
def test_a_node_that_does_not_respond_is_requested_less_and_less_often(outcome: Outcome) -> None:
    requests = rounds(outcome)
    assert requests[:7] == [0, 2, 10, 42, 170, 682, 2730]
    pauses = [after - before for before, after in pairwise(requests)]
    assert pauses == sorted(pauses)
    assert set(pauses[6:]) == {3600}


def test_a_foreign_node_is_requested_four_times_only() -> None:
    assert rounds(refused) == [0, 2, 10, 42]


@pytest.mark.parametrize(("outcome", "longest"), [(no_node_info, 30), (no_parameters, 30), (refused, 300)])
def test_an_actuator_is_requested_without_end_as_it_may_be_a_servo(outcome: Outcome, longest: float) -> None:
    requests = rounds(outcome, 1, actuator=True)
    pauses = [after - before for before, after in pairwise(requests)]
    assert pauses == sorted(pauses)
    assert pauses[:3] == [1, 1, 2]
    assert pauses[-1] == longest


def test_an_actuator_may_be_a_servo_until_it_has_refused_five_times() -> None:
    foreign_nodes = ForeignNodes(Clock())
    assert not foreign_nodes.is_foreign(NODE)
    assert foreign_nodes.due(record())
    foreign_nodes.on_status(NODE, STATUS)
    for _ in range(4):
        foreign_nodes.refused(NODE)
        assert foreign_nodes.suspects() == [NODE]
        assert "Stop also writes torque off" in getattr(foreign_nodes.note(NODE), "text", "")
    foreign_nodes.refused(NODE)
    assert foreign_nodes.is_foreign(NODE)
    assert foreign_nodes.suspects() == []
    assert "Stop" not in getattr(foreign_nodes.note(NODE), "text", "")


def test_a_node_that_broadcasts_status_and_never_responds_may_be_a_servo() -> None:
    clock = Clock()
    foreign_nodes = ForeignNodes(clock)
    for second in range(100):
        clock.now = second
        foreign_nodes.on_status(NODE, STATUS)
        foreign_nodes.no_node_info(NODE)
        assert foreign_nodes.suspects() == [NODE]
    clock.now += 3.1
    assert foreign_nodes.suspects() == []


@pytest.mark.parametrize("outcome", [no_parameters, refused])
def test_without_status_a_node_is_foreign_after_one_round(outcome: Outcome) -> None:
    foreign_nodes = ForeignNodes(Clock())
    outcome(foreign_nodes)
    assert foreign_nodes.is_foreign(NODE)
    assert foreign_nodes.note(NODE)


def test_a_restarted_node_is_requested_at_once_and_has_no_history() -> None:
    clock = Clock()
    foreign_nodes = ForeignNodes(clock)
    assert foreign_nodes.due(record())
    foreign_nodes.refused(NODE)
    clock.now = 0.5
    assert not foreign_nodes.due(record())
    assert foreign_nodes.due(record(restarts=1))
    assert not foreign_nodes.is_foreign(NODE)
    assert foreign_nodes.note(NODE) is None


def test_the_first_status_of_an_actuator_ends_the_wait() -> None:
    clock = Clock()
    foreign_nodes = ForeignNodes(clock)
    assert foreign_nodes.due(record())
    assert foreign_nodes.retry_policy(NODE) == UNKNOWN_NODE
    for _ in range(4):
        foreign_nodes.refused(NODE)
    clock.now = 99.0
    assert not foreign_nodes.due(record())
    foreign_nodes.on_status(NODE, STATUS)
    assert foreign_nodes.due(record())
    assert foreign_nodes.retry_policy(NODE) == UNKNOWN_ACTUATOR


def test_retry_now_ends_the_wait_and_postpone_and_forget_change_it() -> None:
    clock = Clock()
    foreign_nodes = ForeignNodes(clock)
    foreign_nodes.retry_now(NODE)
    assert foreign_nodes.due(record())
    foreign_nodes.no_node_info(NODE)
    assert not foreign_nodes.due(record())
    foreign_nodes.retry_now(NODE)
    assert foreign_nodes.due(record())
    foreign_nodes.postpone(NODE, 5.0)
    clock.now = 4.9
    assert not foreign_nodes.due(record())
    foreign_nodes.on_status(NODE, STATUS)
    foreign_nodes.forget(NODE)
    assert foreign_nodes.due(record())
    assert foreign_nodes.suspects() == [], "as a servo it is no suspect any more"
