"""Cautions before a move: warnings, and what must be confirmed. Reads and changes nothing."""

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
"""A move up to this angle takes the short way regardless of the turn count."""


def cautions(servo: Servo, kind: str, raw: Raw, here: Collection[Raw], shortest_s: float) -> list[Caution]:
    """Cautions before commanding `kind` (angle, speed, torque) to `raw` (0.1°, rpm, %).

    `here`: possible current angles, raw as in 0x08 (4.4); empty if unknown. `shortest_s`: the shortest timeout that can
    be prevented from expiring. Continuous rotation under speed or torque is intended, so it needs no confirmation; 0
    stops the servo.
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
        found.append(_continuous(servo, kind))
        if row.smallest is not None and abs(raw) < row.smallest:
            found.append(_too_small(servo, row, raw))
        if servo.raw("timeout_action") == 0:
            found.append(_held(servo, kind))
    if servo.model is not None and servo.model.pwm:
        found.append(_pwm(servo))
    timeout_ms = servo.raw("timeout_time") or 1000
    if needs_feeding(servo) and timeout_ms < shortest_s * 1000:
        found.append(_too_short(servo, timeout_ms, math.ceil(shortest_s * 1000)))
    return found


def require(servo: Servo, found: Sequence[Caution], confirmed: Collection[str]) -> None:
    """Raises NeedsConfirmation with all missing confirmation codes; its fact `confirm` is the first."""
    missing = [one for one in found if one.confirm is not None and one.confirm not in confirmed]
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
        f"{servo.title} would make {abs(far_deg) / TURN_DEG:.1f} turns {side} to reach {to_deg:g}°, "
        "because multi-turn angles are absolute (4.17)."
    )
    params = {"turns": round(far_deg / TURN_DEG, 2), "to_deg": to_deg}
    return Caution("warning", "turns", text, "turns", params)


def _turn_count(servo: Servo, before_deg: float) -> Caution:
    text = (
        f"{servo.title} restarted at {before_deg:.1f}° and lost its turn count: angles beyond ±180° are counted, "
        "not measured (4.1). The next move may go in the opposite direction."
    )
    return Caution("warning", "turn_count", text, "turn_count", {"before_deg": round(before_deg, 1)})


def _continuous(servo: Servo, kind: str) -> Caution:
    text = f"{servo.title} rotates continuously under a {kind} command. Angle limits do not apply (4.31)."
    return Caution("warning", "continuous_rotation", text, None, {})


def _too_small(servo: Servo, row: Parameter, raw: Raw) -> Caution:
    assert row.smallest is not None
    least = scale.with_unit(scale.number(row.smallest, row.per_unit), row.unit)
    text = (
        f"{servo.title} may not follow {scale.to_text(row, raw)}: values between 0 and ±{least} are unreliable, and "
        f"Futaba's own program rejects them. Command 0, or at least ±{least}."
    )
    return Caution("warning", "below_minimum", text, None, {"value": raw / row.per_unit, "smallest": row.smallest})


def _held(servo: Servo, kind: str) -> Caution:
    text = (
        f"{servo.title} keeps executing its last command without communication (0x26 is hold). If hornbill or its "
        f"cable fails, this {kind} continues indefinitely. Set timeout_action to off or brake first (4.19)."
    )
    return Caution("failure", "timeout_hold", text, None, {})


def _pwm(servo: Servo) -> Caution:
    timeout_ms = servo.raw("timeout_time") or 1000
    text = f"{servo.title} has a PWM input, which takes over {timeout_ms} ms after the last CAN command (4.30)."
    return Caution("warning", "pwm", text, None, {"timeout_ms": timeout_ms})


def _too_short(servo: Servo, timeout_ms: Raw, shortest_ms: int) -> Caution:
    text = (
        f"{servo.title} times out {timeout_ms} ms after a command (0x27), but hornbill needs {shortest_ms} ms to "
        f"repeat it reliably, so output will drop. Set timeout_time to {shortest_ms} ms or more (4.19)."
    )
    return Caution("warning", "timeout_too_short", text, None, {"timeout_ms": timeout_ms, "shortest_ms": shortest_ms})


def needs_feeding(servo: Servo) -> bool:
    """Whether the servo acts on a timeout. With 0x26 at hold it does not, unless PWM input takes over (4.30)."""
    return servo.raw("timeout_action") != 0 or bool(servo.model is not None and servo.model.pwm)
