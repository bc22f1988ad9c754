"""Owns the cautions before a move: what is worth saying, and what must be confirmed. Asks and changes nothing."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

from hornbill.errors import NeedsConfirmation
from hornbill.servo.servo import Servo
from hornbill.units import Raw

Word = Literal["turns", "turn_count"]

TURN: Raw = 3600
HALF_TURN_DEG = 180.0

SMALL: Raw = 450
"""A move of up to 45° goes the short way whatever became of the turn count."""


@dataclass(frozen=True, slots=True)
class Caution:
    """One sentence about a move. `confirm`: the word without which it is not made, None for a mere warning."""

    level: Literal["warning", "failure"]
    text: str
    confirm: Word | None = None


def cautions(servo: Servo, kind: str, raw: Raw, here: Collection[Raw]) -> list[Caution]:
    """What to say before `kind` (angle, speed, torque) is commanded to `raw` (0.1°, rpm, %).

    `here`: where the horn may be, in 0.1° as 0x08 counts (4.4); empty where nobody knows. That a speed or torque turns
    without end is what it is for, so it is said and not asked; 0 of either is a way to stop.
    """
    found: list[Caution] = []
    if kind == "angle":
        far = max((raw - angle for angle in here), key=abs, default=0)
        if abs(far) > TURN:
            found.append(_turns(servo, raw, far))
        if servo.turns_lost_deg is not None and not (here and abs(far) <= SMALL):
            found.append(_turn_count(servo, servo.turns_lost_deg))
    elif raw != 0:
        found.append(_endless(servo, kind))
        if servo.raw("timeout_action") == 0:
            found.append(_held(servo, kind))
    if servo.model is not None and servo.model.pwm:
        found.append(_pwm(servo))
    return found


def require(said: Sequence[Caution], confirmed: Collection[str]) -> None:
    """Raises NeedsConfirmation with all the words that are missing; its fact `confirm` is the first of them."""
    missing = [one for one in said if one.confirm is not None and one.confirm not in confirmed]
    if missing:
        words = [str(one.confirm) for one in missing]
        listed = ", ".join(f'"{word}"' for word in words)
        raise NeedsConfirmation(
            f"{' '.join(one.text for one in missing)} To do it, send it again with confirm: [{listed}].",
            confirm=words[0], words=words,
        )  # fmt: skip


def _turns(servo: Servo, raw: Raw, far: Raw) -> Caution:
    side = "clockwise" if far > 0 else "counter-clockwise"
    text = (
        f"{servo.title} would turn {abs(far) / TURN:.1f} times {side} to reach {raw / 10:g}°: "
        "it counts turns, and goes all of them (4.17)."
    )
    return Caution("warning", text, "turns")


def _turn_count(servo: Servo, before_deg: float) -> Caution:
    text = (
        f"{servo.title} restarted at {before_deg:.1f}° and lost its turn count: angles beyond ±180° are counted and "
        "not sensed (4.1). The next move may go the other way round."
    )
    return Caution("warning", text, "turn_count")


def _endless(servo: Servo, kind: str) -> Caution:
    text = f"{servo.title} does not heed its angle limits under a {kind} command: it turns without end (4.31)."
    return Caution("warning", text)


def _held(servo: Servo, kind: str) -> Caution:
    text = (
        f"{servo.title} keeps its last command when nobody talks to it (0x26 is hold): if hornbill or its cable fails, "
        f"this {kind} goes on for ever. Set timeout_action to off or brake first (4.19)."
    )
    return Caution("failure", text)


def _pwm(servo: Servo) -> Caution:
    time_out = servo.raw("timeout_time") or 1000
    text = f"{servo.title} has a PWM input: {time_out} ms after the last command by CAN it obeys that (4.30)."
    return Caution("warning", text)
