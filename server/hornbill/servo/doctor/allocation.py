"""Owns the doctor's findings on node-id allocation: a second allocator, and nodes that wait for an id in vain."""

from typing import Final

from hornbill.node.allocator import AllocatorState
from hornbill.node.waiting import Pending
from hornbill.servo.doctor.finding import Finding, Severity, count, ok
from hornbill.servo.doctor.record import HERE_S, Grant, Record

ASKING_S: Final = 5.0
"""A node that asks does so every 0.6 to 1 s, and later when others ask as well."""

STUCK_ATTEMPTS: Final = 4
OFF_ATTEMPTS: Final = 3
GIVEN_IN_VAIN: Final = 3
RIVAL_S: Final = 10.0
"""How long after its last answer an allocator that says no NodeStatus is taken for there."""


def allocators(record: Record) -> list[Finding]:
    """Whether ours is the only allocator, unless somebody chose another."""
    allocator, rival, now = record.allocator, record.allocator.rival, record.now
    since = f"in {now - record.since:.0f} s"
    if rival is None:
        return [ok("second_allocator", "One allocator", f"Ours, node {record.participant.node_id}. No other {since}.")]
    heard = record.participant.heard.get(rival.node_id, float("-inf"))
    if now - heard >= HERE_S and now - rival.heard >= RIVAL_S:
        return [ok("second_allocator", "One allocator", f"Node {rival.node_id} was another, and has gone.")]
    evidence = f"Node {rival.node_id} gave {count(rival.answers, 'answer')}, the last {now - rival.heard:.0f} s ago."
    if allocator.state is AllocatorState.OFF:
        return [ok("second_allocator", "One allocator", f"{evidence} Ours is off.")]
    both = allocator.state is AllocatorState.ON
    return [
        Finding(
            "second_allocator",
            Severity.FAILURE if both else Severity.WARNING,
            f"Node {rival.node_id} gives node ids too",
            f"{evidence} Ours {'answers beside it: two nodes may get one id' if both else 'stands down for it'}.",
            f"Keep one of the two: switch off that of node {rival.node_id}, or ours with "
            'PUT /api/v1/bus/allocator {"mode": "off"}.',
            node_ids=(rival.node_id,),
        )
    ]


def waiting(record: Record) -> list[Finding]:
    """Whether nodes wait for a node id longer than they should."""
    asking = [one for one in record.allocator.pending(record.now) if record.now - one.last_heard < ASKING_S]
    found = [told for one in asking if (told := _in_vain(record, one)) is not None]
    found += [
        _not_taken(node_id, grant)
        for node_id, grant in record.grants.items()
        if grant.times >= GIVEN_IN_VAIN and record.now - grant.last < ASKING_S
    ]
    return found or [ok("allocation_stuck", "Nobody waits in vain for a node id", f"{len(asking)} ask for one now.")]


def _in_vain(record: Record, one: Pending) -> Finding | None:
    """Why a node that asks gets no id; None while it may get one."""
    state = record.allocator.state
    asked = f"{_shown(one.partial)} has asked {count(one.attempts, 'time')} in {record.now - one.first_heard:.0f} s"
    if state is AllocatorState.OFF and one.attempts >= OFF_ATTEMPTS and not _rival_serves(record):
        return Finding(
            "allocator_off",
            Severity.WARNING,
            "A node waits for a node id, and the allocator is off",
            f"{asked}.",
            'Switch it on: PUT /api/v1/bus/allocator {"mode": "on"}.',
            uids=(one.partial,),
        )
    if state is not AllocatorState.ON:
        return None
    if one.refusal is not None:
        return Finding(
            "allocation_refused",
            Severity.FAILURE,
            "A node cannot be given a node id",
            f"{asked}. {one.refusal}",
            "See who has which: GET /api/v1/allocations. DELETE /api/v1/allocations/{uid} frees an id.",
            uids=(one.partial,),
        )
    if one.stage < 3 and one.attempts >= STUCK_ATTEMPTS:
        parts = "1 part" if one.stage == 1 else f"{one.stage} parts"
        return Finding(
            "allocation_stuck",
            Severity.WARNING,
            "A node is stuck waiting for a node id",
            f"{asked}: {parts} of 3 of its unique id came, part {one.stage + 1} never.",
            "It does not hear our answers, or its own are lost: check its wiring and the termination, 120 Ω at both "
            "ends. Then restart it.",
            uids=(one.partial,),
        )
    return None


def _not_taken(node_id: int, grant: Grant) -> Finding:
    return Finding(
        "allocation_stuck",
        Severity.WARNING,
        "A node does not take the node id it is given",
        f"{_shown(grant.uid)} was given node id {node_id} {grant.times} times, and nobody was heard on it.",
        "It does not hear our last answer: check its wiring and the termination, 120 Ω at both ends.",
        node_ids=(node_id,),
        uids=(grant.uid,),
    )


def _rival_serves(record: Record) -> bool:
    rival = record.allocator.rival
    return rival is not None and record.now - rival.heard < RIVAL_S


def _shown(partial: str) -> str:
    """A unique id as far as it is known, short."""
    return f"{partial[:4]}…{partial[-4:]}" if len(partial) > 12 else f"{partial}…"
