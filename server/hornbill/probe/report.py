"""The report of a probe: the same as JSON for programs and as Markdown for people."""

import time
from dataclasses import asdict
from typing import Any

from hornbill.probe.asking import Probed


def as_object(probed: Probed) -> dict[str, Any]:
    """For JSON. `value` of an answer is null where the recording does not tell."""
    return {
        "servo": probed.servo,
        "began_at": probed.began,
        "done": probed.done,
        "left_out": probed.left_out,
        "answers": [asdict(one) for one in probed.answers],
    }


def as_markdown(probed: Probed) -> str:
    """For people, and to send to whoever keeps hornbill."""
    servo = probed.servo
    lines = [
        f"# Probe of {servo['label'] or servo['serial'] or servo['uid']}",
        "",
        time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(probed.began)),
        "",
        *(
            f"- {key.replace('_', ' ')}: {'not known' if value in (None, '') else value}"
            for key, value in servo.items()
        ),
        f"- done: {', '.join(probed.done)}",
        *(f"- left out: {name} ({why})" for name, why in probed.left_out.items()),
        "",
        "| question | answer | evidence |",
        "| --- | --- | --- |",
    ]
    for one in probed.answers:
        told = f"not told. {one.text}" if one.value is None else one.text
        lines.append("| " + " | ".join(_cell(text) for text in (one.question, told, one.evidence)) + " |")
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
