"""Findings on other programs that command servos on this bus."""

from hornbill.domain.bus import Finding
from hornbill.domain.fields import known
from hornbill.servo.doctor.finding import count, ok
from hornbill.servo.doctor.record import Commander, Record

_SHOWN = 8


def commanders(record: Record) -> list[Finding]:
    """Whether another node commands servos, and its program."""
    found = [_commander(record, node_id, one) for node_id, one in sorted(record.commanding().items())]
    return found or [ok("other_commands", "No other node commands servos", "No recent ArrayCommand from other nodes.")]


def _commander(record: Record, node_id: int, one: Commander) -> Finding:
    program = record.program(node_id)
    servo_ids = sorted(one.servo_ids)
    shown = ", ".join(map(str, servo_ids[:_SHOWN])) + (" and more" if len(servo_ids) > _SHOWN else "")
    took = max(record.now - one.since, 0.1)
    return Finding(
        "other_commands",
        "notice",
        f"Node {node_id} commands servos" + (f": {program}" if program else ""),
        f"{count(one.messages, 'ArrayCommand')} in {took:.0f} s, to servo IDs {shown or 'none'}.",
        "Turn its outputs off before you move or configure servos here: the last command counts, from any node.",
        node_ids=(node_id,),
        advice="turn_off_commander",
        params=known(
            node=node_id, program=program, messages=one.messages, over_s=round(took), servo_ids=[*servo_ids[:_SHOWN]]
        ),
    )
