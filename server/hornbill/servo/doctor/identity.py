"""Findings on duplicate node IDs and servo IDs."""

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
"""Time after its last message that a foreign node with our node ID is still reported."""

NODE_STATUS_PERIOD_S: Final = 1.0

_LASTING_S: Final = 0.5
"""Two servos that exchange IDs may briefly share one."""


def own_node_id(record: Record) -> list[Finding]:
    """Whether another node uses our node ID, even if only in messages to other nodes."""
    own, shared = record.participant.node_id, record.participant.shared_id
    at = shared.last_seen
    if at is None or record.now - at >= OWN_ID_S:
        text = f"Only hornbill uses node ID {own}"
        return [
            ok(
                "own_node_id",
                text,
                f"{count(shared.frames, 'frame')} from other nodes.",
                node=own,
                frames=shared.frames,
            )
        ]
    requests = f"{count(shared.requests, 'request')} to other nodes"
    what = requests + (", and node ID allocation" if shared.allocates else "")
    evidence = (
        f"{count(shared.frames, 'frame')} from node {own} that hornbill did not send: {what}. {_allocates(record)}"
    )
    values: dict[str, Param] = {
        "node": own, "frames": shared.frames, "requests": shared.requests, "allocates": shared.allocates,
        "ours_allocates": record.allocator.state not in (AllocatorStatus.STANDBY, AllocatorStatus.OFF),
        "other_id": 126 if own != 126 else 127,
    }  # fmt: skip
    restart = f"start hornbill with another node ID, {values['other_id']}."
    if shared.is_makers_program:
        return [
            Finding(
                "makers_program",
                "failure",
                f"{MAKERS_PROGRAM} uses hornbill's node ID {own} on this bus",
                f"{evidence} It reads registers by name at priority 30 and sends no NodeStatus.",
                f"Close one of the two programs, because each receives the responses to the other. Or {restart}",
                node_ids=(own,),
                advice="close_program",
                params=values,
            )
        ]
    return [
        Finding(
            "own_node_id",
            "failure",
            f"Another node uses hornbill's node ID {own}",
            evidence,
            f"Close the other program, or {restart}",
            node_ids=(own,),
            advice="change_own_node_id",
            params=values,
        )
    ]


def _allocates(record: Record) -> str:
    if record.allocator.state is AllocatorStatus.STANDBY:
        return "hornbill allocates no node IDs until one minute after the last of these frames."
    return (
        "hornbill allocates no node IDs."
        if record.allocator.state is AllocatorStatus.OFF
        else "hornbill allocates node IDs too."
    )


def node_ids(record: Record) -> list[Finding]:
    """Whether each node ID is used by one node only."""
    here = record.here()
    found = [_two_nodes(record, node_id) for node_id, node in here.items() if is_doubled(record, node)]
    evidence = f"{count(len(here), 'node')} on the bus."
    return found or [ok("duplicate_node_id", "No duplicate node IDs", evidence, nodes=len(here))]


def is_doubled(record: Record, node: NodeWatch) -> bool:
    """Whether two nodes use this node ID now."""
    now = record.now
    return node.node_statuses.doubled(now, NODE_STATUS_PERIOD_S) or node.statuses.doubled(now, STATUS_PERIOD_S)


def _two_nodes(record: Record, node_id: int) -> Finding:
    return Finding(
        "duplicate_node_id",
        "failure",
        f"Two nodes use node ID {node_id}",
        f"The messages of node {node_id} contain two alternating transfer counters.",
        "Disconnect one of them, set the node ID of the other to 0 (parameter 0x46), save it, and reconnect the first.",
        node_ids=(node_id,),
        uids=record.uids(node_id),
        advice="renumber_node",
        params={"node": node_id},
    )


def servo_ids(record: Record) -> list[Finding]:
    """Whether each servo ID (parameter 0x45, sent in Status) is used by one servo only. 0 means unassigned."""
    users = _users(record)
    found = [
        _two_servos(record, servo_id, sharing)
        for servo_id, each in sorted(users.items())
        if servo_id and (sharing := _sharing(record, each))
    ]
    servos, new = sum(map(len, users.values())), len(users.get(0, ()))
    evidence = f"{count(servos, 'servo')}, {new} of them without a servo ID."
    return found or [ok("duplicate_servo_id", "No duplicate servo IDs", evidence, servos=servos, new=new)]


def new_servos(record: Record) -> list[Finding]:
    """Whether several servos without a servo ID would move together at a command to 0."""
    new = _users(record).get(0, [])
    sharing = _sharing(record, new)
    if not sharing:
        evidence = f"{count(len(new), 'servo')} without a servo ID."
        return [ok("servos_without_id", "No servos share servo ID 0", evidence, servos=len(new))]
    commanding = sorted(node_id for node_id, one in record.commanding().items() if NEW_ACTUATOR in one.servo_ids)
    sends = "sends" if len(commanding) == 1 else "send"
    by = f" {nodes(commanding).capitalize()} {sends} commands to it now." if commanding else " No node commands it now."
    return [
        Finding(
            "servos_without_id",
            "failure" if commanding else "notice",
            f"{len(sharing)} servos without a servo ID move together at a command to ID 0",
            f"Status of {nodes(sharing)} contains servo ID 0.{by} hornbill never commands ID 0, but PX4 and "
            f"{MAKERS_PROGRAM} do.",
            "Assign a different ID from 1 to 254 to each servo (parameter 0x45), and save it.",
            node_ids=tuple(sharing),
            uids=record.uids(*sharing),
            advice="assign_servo_ids",
            params={"count": len(sharing), "nodes": [*sharing], "commanders": [*commanding]},
        )
    ]


def _users(record: Record) -> dict[int, list[int]]:
    """Nodes that currently send each servo ID in Status."""
    users: dict[int, list[int]] = {}
    for node_id, node in record.here().items():
        if node.servo_id is not None and record.now - node.servo_id_at < GAP_S:
            users.setdefault(node.servo_id, []).append(node_id)
    return users


def _sharing(record: Record, node_ids: list[int]) -> list[int]:
    """Nodes that have the same servo ID at the same time, not one after the other."""
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
        f"{number} servos use servo ID {servo_id}",
        f"Status of {nodes(node_ids)} contains servo ID {servo_id}: {names}. One command moves all of them.",
        "Assign a different servo ID (parameter 0x45) to all but one, and save it.",
        node_ids=tuple(node_ids),
        uids=record.uids(*node_ids),
        advice="renumber_servos",
        params={"count": len(node_ids), "servo_id": servo_id, "nodes": [*node_ids]},
    )
