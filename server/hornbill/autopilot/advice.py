"""Advice on a plan: what commonly goes wrong between an autopilot and these servos."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

from pydantic import Field

from hornbill.autopilot.plan import Plan
from hornbill.autopilot.scale import STEP_DEG
from hornbill.domain.fields import Model

AdviceCode = Literal[
    "servo_id_zero", "status_not_received", "throw_beyond_limits", "step_above_deadband", "silent_when_unarmed",
    "node_id_dynamic_range", "position_in_log",
]  # fmt: skip

_PX4_STATUS_IDS: Final = 8
_HOLD: Final = 0


@dataclass(frozen=True, slots=True)
class OutputFacts:
    """What is known of the servo of an output; None if unknown."""

    fixed_node_id: int | None = None
    """Parameter 0x46; 0 for dynamic allocation."""
    low_deg: float | None = None
    high_deg: float | None = None
    deadband_deg: float | None = None
    timeout_action: int | None = None
    timeout_s: float | None = None


class AdviceItem(Model):
    """One point to check before the first flight."""

    code: AdviceCode = Field(description="Code for programs. Stable.")
    text: str = Field(description="One sentence for users.")
    output: int | None = Field(description="Output it concerns. Null if all.")


def advice(plan: Plan, servos: dict[int, OutputFacts]) -> Iterator[AdviceItem]:
    """Points to check for a plan. `servos`: by servo ID."""
    for one in plan.outputs:
        facts = servos.get(one.servo_id, OutputFacts())
        if one.servo_id == 0:
            text = "Servo ID 0 is that of every new servo: all of them obey this output. Connect no other new servo."
            yield AdviceItem(code="servo_id_zero", text=text, output=one.output)
        if plan.program == "px4" and one.servo_id > _PX4_STATUS_IDS:
            text = f"PX4 receives Status for servo IDs 0 to {_PX4_STATUS_IDS} only, so it does not log this servo."
            yield AdviceItem(code="status_not_received", text=text, output=one.output)
        low, high = facts.low_deg, facts.high_deg
        if low is not None and high is not None and (one.low_deg < low or one.high_deg > high):
            text = (
                f"The autopilot commands {one.low_deg:+.1f}° to {one.high_deg:+.1f}°, but the servo stops at its "
                f"limits of {low:+.1f}° and {high:+.1f}°. Reduce the throw."
            )
            yield AdviceItem(code="throw_beyond_limits", text=text, output=one.output)
        if facts.deadband_deg is not None and facts.deadband_deg < STEP_DEG:
            text = f"One step of the autopilot is {STEP_DEG}°, more than the deadband of {facts.deadband_deg:g}°."
            yield AdviceItem(code="step_above_deadband", text=text, output=one.output)
        if plan.program == "ardupilot" and facts.timeout_action not in (None, _HOLD) and facts.timeout_s is not None:
            text = (
                "With the safety switch on, ArduPilot sends no commands: the servo switches its output off or brakes "
                f"after {facts.timeout_s:g} s (0x26, 0x27)."
            )
            yield AdviceItem(code="silent_when_unarmed", text=text, output=one.output)
        if facts.fixed_node_id:
            text = (
                f"Its node ID {facts.fixed_node_id} is static, within the range that the autopilot allocates. Set 0x46 "
                "to 0, or make sure that the autopilot never assigns this ID."
            )
            yield AdviceItem(code="node_id_dynamic_range", text=text, output=one.output)
    log = "CSRV.Pos of ArduPilot" if plan.program == "ardupilot" else "the position of PX4"
    text = f"In logs, {log} × 100 is the angle in degrees: a servo reports 100° as 1.0."
    yield AdviceItem(code="position_in_log", text=text, output=None)
