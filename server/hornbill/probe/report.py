"""Report of a probe, as JSON and as Markdown."""

import time
from dataclasses import asdict
from typing import Any

from hornbill.probe.steps import ProbeResult


def as_object(result: ProbeResult) -> dict[str, Any]:
    """Report for JSON. `value` of an answer is null if unknown."""
    return {
        "servo": result.servo,
        "started_at": result.started_at,
        "completed": result.completed,
        "skipped": result.skipped,
        "answers": [asdict(one) for one in result.answers],
    }


def as_markdown(result: ProbeResult) -> str:
    """Report for users, and to send to the maintainers of hornbill."""
    servo = result.servo
    lines = [
        f"# Probe of {servo['label'] or servo['serial'] or servo['uid']}",
        "",
        time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(result.started_at)),
        "",
        *(f"- {key.replace('_', ' ')}: {'unknown' if value in (None, '') else value}" for key, value in servo.items()),
        f"- completed: {', '.join(result.completed)}",
        *(f"- skipped: {name} ({why})" for name, why in result.skipped.items()),
        "",
        "| question | answer | evidence |",
        "| --- | --- | --- |",
    ]
    for one in result.answers:
        text = f"Unknown. {one.text}" if one.value is None else one.text
        lines.append("| " + " | ".join(_cell(cell) for cell in (one.question, text, one.evidence)) + " |")
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
