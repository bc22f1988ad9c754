"""Findings of the doctor on other programs: who else commands servos on this bus."""

from hornbill.domain.bus import Finding
from hornbill.domain.fields import known
from hornbill.servo.doctor.finding import count, ok
from hornbill.servo.doctor.record import Commander, Record

_SHOWN = 8


def commanders(record: Record) -> list[Finding]:
    """Whether another node commands servos, and which program that is."""
    found = [_commander(record, node_id, one) for node_id, one in sorted(record.commanding().items())]
    return found or [ok("other_commands", "Nobody else commands servos", "0 ArrayCommands of others lately.")]


def _commander(record: Record, node_id: int, one: Commander) -> Finding:
    program = record.program(node_id)
    servo_ids = sorted(one.servo_ids)
    shown = ", ".join(map(str, servo_ids[:_SHOWN])) + (" and more" if len(servo_ids) > _SHOWN else "")
    took = max(record.now - one.since, 0.1)
    return Finding(
        "other_commands",
        "notice",
        f"Node {node_id} commands servos" + (f": {program}" if program else ""),
        f"{count(one.messages, 'ArrayCommand')} in {took:.0f} s, for servo ids {shown or 'none'}.",
        "Switch its outputs off before servos are moved or set up from here: the last command counts, whoever sent it.",
        node_ids=(node_id,),
        advice="silence_commander",
        params=known(
            node=node_id, program=program, messages=one.messages, over_s=round(took), servo_ids=[*servo_ids[:_SHOWN]]
        ),
    )
