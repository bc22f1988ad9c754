"""Findings on responses: nodes that never respond, lost or slow responses, offline servos."""

from statistics import median
from typing import Final

from hornbill.domain.bus import Finding
from hornbill.domain.fields import known
from hornbill.servo.device.servo import Servo
from hornbill.servo.doctor.finding import count, ok, percent
from hornbill.servo.doctor.identity import is_doubled
from hornbill.servo.doctor.record import HERE_S, Record
from hornbill.servo.doctor.watch import NodeWatch, RequestWatch

SILENT_REQUESTS: Final = 5
SILENT_S: Final = 2.5
"""A node that keeps sending counts as not responding after this many requests over this time without a response."""

RECENT_S: Final = 10.0
LOST_SHARE: Final = 0.02
LOST_AT_LEAST: Final = 5

SLOW_S: Final = 0.05
SLOW_RESPONSES: Final = 10

ALLOCATING_S: Final = 3.0
BACK_WITHIN_S: Final = 30.0
"""Maximum time that servos that lost their node IDs may wait for new ones: about 1.1 s each."""


def silent_nodes(record: Record) -> list[Finding]:
    """Nodes that send NodeStatus but never respond. "No such parameter" counts as a response."""
    found = [
        _silent(record, node_id, node, requests)
        for node_id, node in record.here().items()
        if (requests := _unanswered(record, node_id, node)) is not None
    ]
    evidence = f"{count(len(record.here()), 'node')} on the bus."
    return found or [ok("silent_node", "All requested nodes respond", evidence, nodes=len(record.here()))]


def _unanswered(record: Record, node_id: int, node: NodeWatch) -> RequestWatch | None:
    servo = record.servo(node_id)
    if (servo is not None and servo.busy is not None) or is_doubled(record, node):
        return None
    is_servo = servo is not None or record.now - node.servo_id_at < HERE_S
    for requests in (node.registers,) if is_servo else (node.info,):
        since = requests.unanswered_since
        if since is not None and requests.unanswered >= SILENT_REQUESTS and record.now - since > SILENT_S:
            return requests
    # registers are not requested from a node without GetNodeInfo response
    if is_servo and not node.registers.unanswered and node.info.unanswered >= SILENT_REQUESTS:
        since = node.info.unanswered_since
        return node.info if since is not None and record.now - since > SILENT_S else None
    return None


def _silent(record: Record, node_id: int, node: NodeWatch, requests: RequestWatch) -> Finding:
    seconds = record.now - (requests.unanswered_since or record.now)
    what = "parameters" if requests is node.registers else "GetNodeInfo"
    name = record.name(node_id)
    return Finding(
        "silent_node",
        "warning",
        f"{name[0].upper()}{name[1:]} does not respond",
        f"Last seen {record.now - node.last_seen:.1f} s ago; {requests.unanswered} requests for {what} in "
        f"{seconds:.0f} s without a response.",
        "It sends but does not receive, or is not a servo. Check its cable, then turn its supply off and on.",
        node_ids=(node_id,),
        uids=record.uids(node_id),
        advice="check_cable_and_restart",
        params=known(
            node=node_id,
            servo=record.title(node_id),
            last_seen_s=round(record.now - node.last_seen, 1),
            requests=requests.unanswered,
            over_s=round(seconds),
        ),
    )


def lost_responses(record: Record) -> list[Finding]:
    """Whether requests were repeated to nodes that are present and respond to others."""
    tries = record.counts.over(RECENT_S).tries
    begin = record.now - RECENT_S
    lost = {
        node_id: missing
        for node_id, node in record.here().items()
        if node.registers.responded and _unanswered(record, node_id, node) is None
        if (missing := sum(at > begin for at in node.registers.lost))
    }
    total = sum(lost.values())
    share = total / tries if tries else 0.0
    evidence = f"{total} of {count(tries, 'request')} in {RECENT_S:.0f} s without a response"
    values = {"lost": total, "requests": tries, "over_s": RECENT_S}
    if total < LOST_AT_LEAST or share <= LOST_SHARE:
        return [ok("responses_lost", "Responses received", f"{evidence}.", **values)]
    worst = sorted(lost, key=lambda node_id: -lost[node_id])
    names = ", ".join(f"{lost[node_id]} of {record.name(node_id)}" for node_id in worst[:3])
    return [
        Finding(
            "responses_lost",
            "warning",
            "Responses are lost",
            f"{evidence} ({percent(share)}): {names}.",
            "Check the connectors and the cable of the first of them, then the termination (120 Ω at both ends).",
            node_ids=tuple(sorted(lost)),
            uids=record.uids(*sorted(lost)),
            advice="check_worst_cable",
            params={**values, "lost_pct": round(100 * share), "nodes": [*worst[:3]]},
        )
    ]


def slow_responses(record: Record) -> list[Finding]:
    """Whether responses take much longer than the 1 ms that a servo needs."""
    begin = record.now - RECENT_S
    times = {
        node_id: [seconds for at, seconds in node.round_trips if at > begin] for node_id, node in record.here().items()
    }
    slow = {
        node_id: middle
        for node_id, each in times.items()
        if len(each) >= SLOW_RESPONSES and (middle := median(each)) > SLOW_S
    }
    every = [seconds for each in times.values() for seconds in each]
    if not every:
        return []
    slowest = max((max(each), node_id) for node_id, each in times.items() if each)
    evidence = (
        f"Median {1000 * median(every):.1f} ms, slowest {1000 * slowest[0]:.1f} ms ({record.name(slowest[1])}), "
        f"{count(len(every), 'response')} in {RECENT_S:.0f} s."
    )
    values = {
        "median_ms": round(1000 * median(every), 1), "slowest_ms": round(1000 * slowest[0], 1), "node": slowest[1],
"responses": len(every), "over_s": RECENT_S,
    }  # fmt: skip
    if not slow:
        return [ok("responses_slow", "Servos respond in time", evidence, **values)]
    return [
        Finding(
            "responses_slow",
            "warning",
            "Responses are slow",
            f"{evidence} Median above {1000 * SLOW_S:.0f} ms: {', '.join(map(record.name, sorted(slow)))}.",
            "Check whether the adapter or this computer is busy, and the bus load.",
            node_ids=tuple(sorted(slow)),
            uids=record.uids(*sorted(slow)),
            advice="check_computer",
            params={**values, "limit_ms": 1000 * SLOW_S, "nodes": sorted(slow)},
        )
    ]


def offline_servos(record: Record) -> list[Finding]:
    """Servos that went offline while others are online."""
    servos = record.servos()
    gone = [one for one in servos if _is_gone(record, one)]
    return [_offline(record, one) for one in gone] or [
        ok(
            "servo_offline",
            "All servos online",
            f"{count(len(servos), 'servo')} since connecting.",
            servos=len(servos),
        )
    ]


def _is_gone(record: Record, servo: Servo) -> bool:
    if servo.online or servo.busy is not None or servo.status_at is None:
        return False
    away = record.now - servo.status_at
    allocating = record.allocation_at is not None and record.now - record.allocation_at < ALLOCATING_S
    return away > HERE_S and not (allocating and away < BACK_WITHIN_S)


def _offline(record: Record, servo: Servo) -> Finding:
    assert servo.status_at is not None
    where = "" if servo.node_id is None else f" on node {servo.node_id}"
    return Finding(
        "servo_offline",
        "warning",
        f"{servo.title} is offline",
        f"Last seen {record.now - servo.status_at:.0f} s ago{where}; other nodes are online.",
        "Check its supply, then its cable.",
        node_ids=() if servo.node_id is None else (servo.node_id,),
        uids=(servo.uid,),
        advice="check_supply",
        params=known(servo=servo.title, last_seen_s=round(record.now - servo.status_at), node=servo.node_id),
    )
