"""Owns the doctor's findings on who is who: node ids and servo ids that more than one uses."""

from itertools import combinations
from typing import Final

from hornbill.servo.doctor.finding import Finding, Severity, count, nodes, ok
from hornbill.servo.doctor.record import Record
from hornbill.servo.doctor.watch import GAP_S, NodeWatch
from hornbill.servo.servo import STATUS_PERIOD_S

OWN_ID_S: Final = 5.0
"""How long after its last message a stranger with our node id is still told of."""

NODE_STATUS_PERIOD_S: Final = 1.0

_LASTING_S: Final = 0.5
"""Two servos that swap their ids have the same one for a moment."""


def own_node_id(record: Record) -> list[Finding]:
    """Whether anybody else speaks with our node id."""
    own, counters = record.participant.node_id, record.participant.counters
    at = counters.own_id_heard_at
    if at is None or record.now - at >= OWN_ID_S:
        return [ok("own_node_id", f"Node id {own} is hornbill's alone", f"{counters.own_id_heard} messages of others.")]
    return [
        Finding(
            "own_node_id",
            Severity.FAILURE,
            f"Another node uses hornbill's node id {own}",
            f"{count(counters.own_id_heard, 'message')} from node {own} that we did not send.",
            f"Give one of them another id: HORNBILL_NODE_ID={126 if own != 126 else 127} hornbill serve.",
            node_ids=(own,),
        )
    ]


def node_ids(record: Record) -> list[Finding]:
    """Whether each node id has one node."""
    here = record.here()
    found = [_two_nodes(record, node_id) for node_id, node in here.items() if is_doubled(record, node)]
    return found or [ok("duplicate_node_id", "Every node id is used once", f"{count(len(here), 'node')} on the bus.")]


def is_doubled(record: Record, node: NodeWatch) -> bool:
    """Whether two nodes speak with this node id now."""
    now = record.now
    return node.node_statuses.doubled(now, NODE_STATUS_PERIOD_S) or node.statuses.doubled(now, STATUS_PERIOD_S)


def _two_nodes(record: Record, node_id: int) -> Finding:
    return Finding(
        "duplicate_node_id",
        Severity.FAILURE,
        f"Two nodes use node id {node_id}",
        f"The messages of node {node_id} carry two transfer counters in turn.",
        "Take one of them off the bus, set the other's node id to 0 (parameter 0x46), save it, and put the first back.",
        node_ids=(node_id,),
        uids=record.uids(node_id),
    )


def servo_ids(record: Record) -> list[Finding]:
    """Whether each servo id (parameter 0x45, told in Status) has one servo. 0 is that of new ones, and none."""
    now = record.now
    users: dict[int, list[int]] = {}
    new = 0
    for node_id, node in record.here().items():
        if node.servo_id is not None and now - node.servo_id_at < GAP_S:
            new += node.servo_id == 0
            users.setdefault(node.servo_id, []).append(node_id)
    found = [
        _two_servos(record, servo_id, sharing)
        for servo_id, each in sorted(users.items())
        if servo_id and (sharing := _sharing(record, each))
    ]
    told = f"{count(sum(map(len, users.values())), 'servo')}, of which {new} have none yet."
    return found or [ok("duplicate_servo_id", "Every servo id is used once", told)]


def _sharing(record: Record, node_ids: list[int]) -> list[int]:
    """Those of the nodes that have the same servo id at the same time, and not one after the other."""
    sharing: set[int] = set()
    for one, other in combinations(node_ids, 2):
        first, second = record.nodes[one], record.nodes[other]
        together = first.servo_id_at > second.servo_id_since and second.servo_id_at > first.servo_id_since
        if together and record.now - max(first.servo_id_since, second.servo_id_since) > _LASTING_S:
            sharing |= {one, other}
    return sorted(sharing)


def _two_servos(record: Record, servo_id: int, node_ids: list[int]) -> Finding:
    names = ", ".join(record.name(each) for each in node_ids)
    number = "Two" if len(node_ids) == 2 else str(len(node_ids))
    return Finding(
        "duplicate_servo_id",
        Severity.FAILURE,
        f"{number} servos use servo id {servo_id}",
        f"Status of {nodes(node_ids)} all say servo {servo_id}: {names}. One command moves them all.",
        "Give all but one another servo id (parameter 0x45), and save it.",
        node_ids=tuple(node_ids),
        uids=record.uids(*node_ids),
    )
