"""The doctor's findings on node-id allocation: a second allocator, and nodes that wait for an id in vain."""

from typing import Final

from hornbill.domain.bus import Finding
from hornbill.domain.fields import Param, known
from hornbill.node.allocator import AllocatorStatus
from hornbill.node.programs import MAKERS_PROGRAM
from hornbill.node.waiting import AllocationRequest
from hornbill.servo.doctor.finding import count, ok
from hornbill.servo.doctor.record import HERE_S, Grant, Record

ASKING_S: Final = 5.0
"""A node that asks does so every 0.6 to 1 s, and later when others ask as well."""

STUCK_ATTEMPTS: Final = 4
OFF_ATTEMPTS: Final = 3
GIVEN_IN_VAIN: Final = 3
_MAKERS_ID: Final = 127
"""Of the maker's program, which says no NodeStatus."""

COMPETITOR_S: Final = 10.0
"""How long after its last answer an allocator that says no NodeStatus is taken for there."""


def allocators(record: Record) -> list[Finding]:
    """Whether ours is the only allocator, unless somebody chose another."""
    allocator, competitor, now = record.allocator, record.allocator.competitor, record.now
    seconds = round(now - record.since)
    if competitor is None:
        own = record.participant.node_id
        return [
            ok(
                "second_allocator",
                "One allocator",
                f"Ours, node {own}. No other in {seconds} s.",
                own=own,
                over_s=seconds,
            )
        ]
    heard = record.participant.last_seen.get(competitor.node_id, float("-inf"))
    if now - heard >= HERE_S and now - competitor.last_seen >= COMPETITOR_S:
        text = f"Node {competitor.node_id} was another, and has gone."
        return [ok("second_allocator", "One allocator", text, node=competitor.node_id)]
    evidence = f"Node {competitor.node_id} gave {count(competitor.responses, 'answer')}, the last {now - competitor.last_seen:.0f} s ago."
    given = known(node=competitor.node_id, answers=competitor.responses, ago_s=round(now - competitor.last_seen))
    if allocator.state is AllocatorStatus.OFF:
        return [ok("second_allocator", "One allocator", f"{evidence} Ours is off.", **given)]
    both = allocator.state is AllocatorStatus.ON
    program = record.program(competitor.node_id)
    if program is None and competitor.node_id == _MAKERS_ID and competitor.node_id not in record.directory.records:
        program = f"probably {MAKERS_PROGRAM}"
    return [
        Finding(
            "second_allocator",
            "failure" if both else "warning",
            f"Node {competitor.node_id} gives node ids too" + (f": {program}" if program else ""),
            f"{evidence} Ours {'answers beside it: two nodes may get one id' if both else 'stands down for it'}.",
            f"Keep one of the two: switch off that of node {competitor.node_id}, or ours.",
            node_ids=(competitor.node_id,),
            advice="keep_one_allocator",
            params=known(**given, ours_answers=both, program=program),
        )
    ]


def waiting(record: Record) -> list[Finding]:
    """Whether nodes wait for a node id longer than they should."""
    asking = [one for one in record.allocator.pending(record.now) if record.now - one.last_seen < ASKING_S]
    found = [told for one in asking if (told := _in_vain(record, one)) is not None]
    found += [
        _not_taken(node_id, grant)
        for node_id, grant in record.grants.items()
        if grant.times >= GIVEN_IN_VAIN and record.now - grant.last < ASKING_S
    ]
    return found or [
        ok(
            "allocation_stuck",
            "Nobody waits in vain for a node id",
            f"{len(asking)} ask for one now.",
            requests=len(asking),
        )
    ]


def _in_vain(record: Record, one: AllocationRequest) -> Finding | None:
    """Why a node that asks gets no id; None while it may get one."""
    state = record.allocator.state
    since: dict[str, Param] = {
        "uid": _shown(one.partial),
        "times": one.attempts,
        "over_s": round(record.now - one.first_seen),
    }
    asked = f"{_shown(one.partial)} has asked {count(one.attempts, 'time')} in {record.now - one.first_seen:.0f} s"
    if state is AllocatorStatus.OFF and one.attempts >= OFF_ATTEMPTS and not _competitor_responds(record):
        return Finding(
            "allocator_off",
            "warning",
            "A node waits for a node id, and the allocator is off",
            f"{asked}.",
            "Switch it on.",
            uids=(one.partial,),
            advice="turn_allocator_on",
            params=since,
        )
    if state is not AllocatorStatus.ON:
        return None
    if one.refused is not None:
        return Finding(
            "allocation_refused",
            "failure",
            "A node cannot be given a node id",
            f"{asked}. {one.refused.text}",
            "Free the ID of a node that is gone.",
            uids=(one.partial,),
            advice="free_node_id",
            params={**since, **one.refused.params, "refusal": one.refused.code},
        )
    if one.stage < 3 and one.attempts >= STUCK_ATTEMPTS:
        parts = "1 part" if one.stage == 1 else f"{one.stage} parts"
        return Finding(
            "allocation_stuck",
            "warning",
            "A node is stuck waiting for a node id",
            f"{asked}: {parts} of 3 of its unique id came, part {one.stage + 1} never.",
            "It does not hear our answers, or its own are lost: check its wiring and the termination, 120 Ω at both "
            "ends. Then restart it.",
            uids=(one.partial,),
            advice="check_node_and_restart",
            params={**since, "parts": one.stage},
        )
    return None


def _not_taken(node_id: int, grant: Grant) -> Finding:
    return Finding(
        "allocation_stuck",
        "warning",
        "A node does not take the node id it is given",
        f"{_shown(grant.uid)} was given node id {node_id} {grant.times} times, and nobody was heard on it.",
        "It does not hear our last answer: check its wiring and the termination, 120 Ω at both ends.",
        node_ids=(node_id,),
        uids=(grant.uid,),
        advice="check_node",
        params={"uid": _shown(grant.uid), "node": node_id, "times": grant.times},
    )


def _competitor_responds(record: Record) -> bool:
    competitor = record.allocator.competitor
    return competitor is not None and record.now - competitor.last_seen < COMPETITOR_S


def _shown(partial: str) -> str:
    """A unique id as far as it is known, short."""
    return f"{partial[:4]}…{partial[-4:]}" if len(partial) > 12 else f"{partial}…"
