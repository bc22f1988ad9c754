"""The cautions before a move: what is worth saying, and what must be confirmed. Reads and changes nothing."""

import math
from collections.abc import Collection, Sequence
from typing import Any

from hornbill.domain.motion import Caution
from hornbill.errors import Cause, NeedsConfirmation
from hornbill.schema import scale
from hornbill.schema.parameter import Parameter
from hornbill.servo.device.permission import ROW_OF
from hornbill.servo.device.servo import Servo
from hornbill.units import Raw

TURN_DEG = 360

SMALL_DEG = 45
"""A move of up to this goes the short way whatever became of the turn count."""


def cautions(servo: Servo, kind: str, raw: Raw, here: Collection[Raw], shortest_s: float) -> list[Caution]:
    """What to say before `kind` (angle, speed, torque) is commanded to `raw` (0.1°, rpm, %).

    `here`: where the horn may be, raw as 0x08 counts (4.4); empty where nobody knows. `shortest_s`: the shortest
    timeout that can be kept from expiring. That a speed or torque turns without end is what it is for, so it is said
    and not asked; 0 of either is a way to stop.
    """
    found: list[Caution] = []
    row = servo.catalog.by_key[ROW_OF[kind]]
    if kind == "angle":
        far_deg = max((raw - angle for angle in here), key=abs, default=0) / row.per_unit
        if abs(far_deg) > TURN_DEG:
            found.append(_turns(servo, raw / row.per_unit, far_deg))
        if servo.turns_lost_deg is not None and not (here and abs(far_deg) <= SMALL_DEG):
            found.append(_turn_count(servo, servo.turns_lost_deg))
    elif raw != 0:
        found.append(_endless(servo, kind))
        if row.smallest is not None and abs(raw) < row.smallest:
            found.append(_too_small(servo, row, raw))
        if servo.raw("timeout_action") == 0:
            found.append(_held(servo, kind))
    if servo.model is not None and servo.model.pwm:
        found.append(_pwm(servo))
    time_out = servo.raw("timeout_time") or 1000
    if needs_feeding(servo) and time_out < shortest_s * 1000:
        found.append(_too_short(servo, time_out, math.ceil(shortest_s * 1000)))
    return found


def require(servo: Servo, said: Sequence[Caution], confirmed: Collection[str]) -> None:
    """Raises NeedsConfirmation with all the words that are missing; its fact `confirm` is the first of them."""
    missing = [one for one in said if one.confirm is not None and one.confirm not in confirmed]
    if missing:
        words: list[Cause] = [one.confirm for one in missing if one.confirm is not None]
        facts: dict[str, Any] = {name: value for one in missing for name, value in one.params.items()}
        raise NeedsConfirmation(
            " ".join(one.text for one in missing),
            confirm=words[0], words=words, cause=words[0], also=words[1:], servo=servo.title,
            **facts,
        )  # fmt: skip


def _turns(servo: Servo, to_deg: float, far_deg: float) -> Caution:
    side = "clockwise" if far_deg > 0 else "counter-clockwise"
    text = (
        f"{servo.title} would turn {abs(far_deg) / TURN_DEG:.1f} times {side} to reach {to_deg:g}°: "
        "it counts turns, and goes all of them (4.17)."
    )
    params = {"turns": round(far_deg / TURN_DEG, 2), "to_deg": to_deg}
    return Caution("warning", "turns", text, "turns", params)


def _turn_count(servo: Servo, before_deg: float) -> Caution:
    text = (
        f"{servo.title} restarted at {before_deg:.1f}° and lost its turn count: angles beyond ±180° are counted and "
        "not sensed (4.1). The next move may go the other way round."
    )
    return Caution("warning", "turn_count", text, "turn_count", {"before_deg": round(before_deg, 1)})


def _endless(servo: Servo, kind: str) -> Caution:
    text = f"{servo.title} does not heed its angle limits under a {kind} command: it turns without end (4.31)."
    return Caution("warning", "endless", text, None, {})


def _too_small(servo: Servo, row: Parameter, raw: Raw) -> Caution:
    assert row.smallest is not None
    least = scale.with_unit(scale.number(row.smallest, row.per_unit), row.unit)
    text = (
        f"{servo.title} may not follow {scale.to_text(row, raw)}: between 0 and ±{least} it is not usable, and "
        f"Futaba's own program takes no such value. Command 0, or at least ±{least}."
    )
    return Caution("warning", "too_small", text, None, {"value": raw / row.per_unit, "smallest": row.smallest})


def _held(servo: Servo, kind: str) -> Caution:
    text = (
        f"{servo.title} keeps its last command when nobody talks to it (0x26 is hold): if hornbill or its cable fails, "
        f"this {kind} goes on for ever. Set timeout_action to off or brake first (4.19)."
    )
    return Caution("failure", "held", text, None, {})


def _pwm(servo: Servo) -> Caution:
    time_out = servo.raw("timeout_time") or 1000
    text = f"{servo.title} has a PWM input: {time_out} ms after the last command by CAN it obeys that (4.30)."
    return Caution("warning", "pwm", text, None, {"timeout_ms": time_out})


def _too_short(servo: Servo, time_out: Raw, shortest_ms: int) -> Caution:
    text = (
        f"{servo.title} times out {time_out} ms after a command (0x27), and hornbill needs at least {shortest_ms} ms "
        f"to repeat it in time: output will drop. Set timeout_time to {shortest_ms} ms or more (4.19)."
    )
    return Caution("warning", "timeout_too_short", text, None, {"timeout_ms": time_out, "shortest_ms": shortest_ms})


def needs_feeding(servo: Servo) -> bool:
    """Whether silence changes what the servo does: with 0x26 "hold" it does not, unless PWM input takes over (4.30)."""
    return servo.raw("timeout_action") != 0 or bool(servo.model is not None and servo.model.pwm)
