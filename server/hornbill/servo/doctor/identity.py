"""The doctor's findings on who is who: node ids and servo ids that more than one uses."""

from itertools import combinations
from typing import Final

from hornbill.domain.bus import Finding
from hornbill.domain.fields import Param
from hornbill.node.allocator import AllocatorStatus
from hornbill.node.guard import NEW_ACTUATOR
from hornbill.node.programs import MAKERS_PROGRAM
from hornbill.servo.device.servo import STATUS_PERIOD_S
from hornbill.servo.doctor.finding import count, nodes, ok
from hornbill.servo.doctor.record import Record
from hornbill.servo.doctor.watch import GAP_S, NodeWatch

OWN_ID_S: Final = 5.0
"""How long after its last message a stranger with our node id is still told of."""

NODE_STATUS_PERIOD_S: Final = 1.0

_LASTING_S: Final = 0.5
"""Two servos that swap their ids have the same one for a moment."""


def own_node_id(record: Record) -> list[Finding]:
    """Whether anybody else speaks with our node id, be it to other nodes only."""
    own, shared = record.participant.node_id, record.participant.shared_id
    at = shared.last_seen
    if at is None or record.now - at >= OWN_ID_S:
        text = f"Node id {own} is hornbill's alone"
        return [ok("own_node_id", text, f"{count(shared.frames, 'frame')} of others.", node=own, frames=shared.frames)]
    said = f"{count(shared.requests, 'request')} to other nodes" + (", and node ids given" if shared.allocates else "")
    evidence = f"{count(shared.frames, 'frame')} from node {own} that we did not send: {said}. {_gives(record)}"
    values: dict[str, Param] = {
        "node": own, "frames": shared.frames, "requests": shared.requests, "gives_ids": shared.allocates,
        "ours_gives_ids": record.allocator.state not in (AllocatorStatus.STANDBY, AllocatorStatus.OFF),
        "other_id": 126 if own != 126 else 127,
    }  # fmt: skip
    restart = f"start hornbill with another node ID, {values['other_id']}."
    if shared.is_makers_program:
        return [
            Finding(
                "makers_program",
                "failure",
                f"{MAKERS_PROGRAM} is on this bus, with hornbill's node id {own}",
                f"{evidence} It reads registers by name at priority 30, and says no NodeStatus.",
                f"Close one of the two programs: each takes the servos' answers to the other for its own. Or {restart}",
                node_ids=(own,),
                advice="close_program",
                params=values,
            )
        ]
    return [
        Finding(
            "own_node_id",
            "failure",
            f"Another node uses hornbill's node id {own}",
            evidence,
            f"Close the other program, or {restart}",
            node_ids=(own,),
            advice="change_own_node_id",
            params=values,
        )
    ]


def _gives(record: Record) -> str:
    if record.allocator.state is AllocatorStatus.STANDBY:
        return "hornbill gives no node ids until a minute after the last of them."
    return (
        "hornbill gives no node ids."
        if record.allocator.state is AllocatorStatus.OFF
        else "hornbill gives node ids too."
    )


def node_ids(record: Record) -> list[Finding]:
    """Whether each node id has one node."""
    here = record.here()
    found = [_two_nodes(record, node_id) for node_id, node in here.items() if is_doubled(record, node)]
    told = f"{count(len(here), 'node')} on the bus."
    return found or [ok("duplicate_node_id", "Every node id is used once", told, nodes=len(here))]


def is_doubled(record: Record, node: NodeWatch) -> bool:
    """Whether two nodes speak with this node id now."""
    now = record.now
    return node.node_statuses.doubled(now, NODE_STATUS_PERIOD_S) or node.statuses.doubled(now, STATUS_PERIOD_S)


def _two_nodes(record: Record, node_id: int) -> Finding:
    return Finding(
        "duplicate_node_id",
        "failure",
        f"Two nodes use node id {node_id}",
        f"The messages of node {node_id} carry two transfer counters in turn.",
        "Take one of them off the bus, set the other's node id to 0 (parameter 0x46), save it, and put the first back.",
        node_ids=(node_id,),
        uids=record.uids(node_id),
        advice="renumber_node",
        params={"node": node_id},
    )


def servo_ids(record: Record) -> list[Finding]:
    """Whether each servo id (parameter 0x45, told in Status) has one servo. 0 is that of new ones, and none."""
    users = _users(record)
    found = [
        _two_servos(record, servo_id, sharing)
        for servo_id, each in sorted(users.items())
        if servo_id and (sharing := _sharing(record, each))
    ]
    servos, new = sum(map(len, users.values())), len(users.get(0, ()))
    told = f"{count(servos, 'servo')}, of which {new} have none yet."
    return found or [ok("duplicate_servo_id", "Every servo id is used once", told, servos=servos, new=new)]


def new_servos(record: Record) -> list[Finding]:
    """Whether several servos without a servo id would move together when somebody commands 0."""
    new = _users(record).get(0, [])
    sharing = _sharing(record, new)
    if not sharing:
        alone = f"{count(len(new), 'servo')} without a servo id."
        return [ok("servos_without_id", "No servos share servo id 0", alone, servos=len(new))]
    commanding = sorted(node_id for node_id, one in record.commanding().items() if NEW_ACTUATOR in one.servo_ids)
    by = f" {nodes(commanding).capitalize()} commands it now." if commanding else " Nobody commands it now."
    return [
        Finding(
            "servos_without_id",
            "failure" if commanding else "notice",
            f"{len(sharing)} servos without a servo id move together when anybody commands id 0",
            f"Status of {nodes(sharing)} all say servo 0.{by} hornbill never sends commands to 0; PX4 and "
            f"{MAKERS_PROGRAM} do.",
            "Give each servo an id of its own, 1 to 254 (parameter 0x45), and save it.",
            node_ids=tuple(sharing),
            uids=record.uids(*sharing),
            advice="give_servo_ids",
            params={"count": len(sharing), "nodes": [*sharing], "commanders": [*commanding]},
        )
    ]


def _users(record: Record) -> dict[int, list[int]]:
    """The nodes that say each servo id in Status now."""
    users: dict[int, list[int]] = {}
    for node_id, node in record.here().items():
        if node.servo_id is not None and record.now - node.servo_id_at < GAP_S:
            users.setdefault(node.servo_id, []).append(node_id)
    return users


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
        "failure",
        f"{number} servos use servo id {servo_id}",
        f"Status of {nodes(node_ids)} all say servo {servo_id}: {names}. One command moves them all.",
        "Give all but one another servo id (parameter 0x45), and save it.",
        node_ids=tuple(node_ids),
        uids=record.uids(*node_ids),
        advice="renumber_servos",
        params={"count": len(node_ids), "servo_id": servo_id, "nodes": [*node_ids]},
    )
