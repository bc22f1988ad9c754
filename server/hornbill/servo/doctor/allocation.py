"""Findings on node ID allocation: a second allocator, and requests that remain without a node ID."""

from typing import Final

from hornbill.domain.bus import Finding
from hornbill.domain.fields import Param, known
from hornbill.node.allocator import AllocatorStatus
from hornbill.node.programs import MAKERS_PROGRAM
from hornbill.node.waiting import AllocationRequest
from hornbill.servo.doctor.finding import count, ok
from hornbill.servo.doctor.record import HERE_S, Grant, Record

REQUESTING_S: Final = 5.0
"""Maximum age of a pending request. A node repeats it every 0.6 to 1 s, or less often while others request too."""

STUCK_ATTEMPTS: Final = 4
OFF_ATTEMPTS: Final = 3
UNUSED_GRANTS: Final = 3
_MAKERS_ID: Final = 127
"""Node ID of the maker's program, which sends no NodeStatus."""

COMPETITOR_S: Final = 10.0
"""Time after its last response that an allocator without NodeStatus counts as present."""


def allocators(record: Record) -> list[Finding]:
    """Whether ours is the only allocator, or the selected one."""
    allocator, competitor, now = record.allocator, record.allocator.competitor, record.now
    seconds = round(now - record.since)
    if competitor is None:
        own = record.participant.node_id
        return [
            ok(
                "second_allocator",
                "One allocator",
                f"This server, node {own}. No other in {seconds} s.",
                own=own,
                over_s=seconds,
            )
        ]
    status_at = record.participant.last_seen.get(competitor.node_id, float("-inf"))
    if now - status_at >= HERE_S and now - competitor.last_seen >= COMPETITOR_S:
        text = f"Node {competitor.node_id} was a second allocator, but is gone."
        return [ok("second_allocator", "One allocator", text, node=competitor.node_id)]
    ago = now - competitor.last_seen
    evidence = f"Node {competitor.node_id} responded {count(competitor.responses, 'time')}, last {ago:.0f} s ago."
    given = known(node=competitor.node_id, responses=competitor.responses, ago_s=round(ago))
    if allocator.state is AllocatorStatus.OFF:
        return [ok("second_allocator", "One allocator", f"{evidence} hornbill's allocator is off.", **given)]
    both = allocator.state is AllocatorStatus.ON
    program = record.program(competitor.node_id)
    if program is None and competitor.node_id == _MAKERS_ID and competitor.node_id not in record.directory.records:
        program = f"probably {MAKERS_PROGRAM}"
    return [
        Finding(
            "second_allocator",
            "failure" if both else "warning",
            f"Second node ID allocator: node {competitor.node_id}" + (f", {program}" if program else ""),
            f"{evidence} hornbill's allocator "
            f"{'responds too, so two nodes may get the same node ID' if both else 'is on standby'}.",
            f"Use only one allocator: turn off that of node {competitor.node_id} or that of hornbill.",
            node_ids=(competitor.node_id,),
            advice="keep_one_allocator",
            params=known(**given, ours_responds=both, program=program),
        )
    ]


def waiting(record: Record) -> list[Finding]:
    """Whether nodes wait too long for a node ID."""
    requesting = [one for one in record.allocator.pending(record.now) if record.now - one.last_seen < REQUESTING_S]
    found = [finding for one in requesting if (finding := _unanswered(record, one)) is not None]
    found += [
        _not_used(node_id, grant)
        for node_id, grant in record.grants.items()
        if grant.times >= UNUSED_GRANTS and record.now - grant.last < REQUESTING_S
    ]
    return found or [
        ok(
            "allocation_stuck",
            "All node ID requests answered",
            f"{len(requesting)} pending.",
            requests=len(requesting),
        )
    ]


def _unanswered(record: Record, one: AllocationRequest) -> Finding | None:
    """Finding for a request without a node ID. None while it may still get one."""
    state = record.allocator.state
    since: dict[str, Param] = {
        "uid": _shown(one.partial),
        "times": one.attempts,
        "over_s": round(record.now - one.first_seen),
    }
    seconds = record.now - one.first_seen
    evidence = f"{_shown(one.partial)}: {count(one.attempts, 'request')} in {seconds:.0f} s"
    if state is AllocatorStatus.OFF and one.attempts >= OFF_ATTEMPTS and not _competitor_responds(record):
        return Finding(
            "allocator_off",
            "warning",
            "A node requests a node ID, but the allocator is off",
            f"{evidence}.",
            "Turn the allocator on.",
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
            "No node ID can be allocated to a node",
            f"{evidence}. {one.refused.text}",
            "Free the node ID of a node that is no longer used.",
            uids=(one.partial,),
            advice="free_node_id",
            params={**since, **one.refused.params, "refusal": one.refused.code},
        )
    if one.stage < 3 and one.attempts >= STUCK_ATTEMPTS:
        parts = "1 part" if one.stage == 1 else f"{one.stage} parts"
        return Finding(
            "allocation_stuck",
            "warning",
            "A node cannot complete its node ID request",
            f"{evidence}: received {parts} of 3 of its unique ID, never part {one.stage + 1}.",
            "It does not receive the responses, or its frames are lost. Check its wiring and the termination (120 Ω at "
            "both ends), then restart it.",
            uids=(one.partial,),
            advice="check_node_and_restart",
            params={**since, "parts": one.stage},
        )
    return None


def _not_used(node_id: int, grant: Grant) -> Finding:
    return Finding(
        "allocation_stuck",
        "warning",
        "A node does not use its allocated node ID",
        f"Node ID {node_id} was allocated to {_shown(grant.uid)} {grant.times} times, but no node was seen on it.",
        "It does not receive the last response. Check its wiring and the termination (120 Ω at both ends).",
        node_ids=(node_id,),
        uids=(grant.uid,),
        advice="check_node",
        params={"uid": _shown(grant.uid), "node": node_id, "times": grant.times},
    )


def _competitor_responds(record: Record) -> bool:
    competitor = record.allocator.competitor
    return competitor is not None and record.now - competitor.last_seen < COMPETITOR_S


def _shown(partial: str) -> str:
    """Known part of a unique ID, shortened."""
    return f"{partial[:4]}…{partial[-4:]}" if len(partial) > 12 else f"{partial}…"
