"""VerifyOutputs: compares what an autopilot sends on the bus with what was exported, output by output."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Literal, TypeAlias

from hornbill.autopilot.plan import Plan, PlanOutput
from hornbill.autopilot.scale import SCALES, travel
from hornbill.errors import InvalidValue, Unknown
from hornbill.units import Instant
from hornbill.wire.messages import ArrayCommand, CommandType, unitless_degrees
from hornbill.wire.transfer import Transfer

Result: TypeAlias = Literal[
    "matches", "reversed", "swapped", "missing", "throw_too_small", "throw_too_large", "wrong_type", "not_moved",
]  # fmt: skip
StepKind: TypeAlias = Literal["neutral", "positive"]

HOLD_S: Final = 3.0
"""Time for which a control is held in a step."""

STEADY_DEG: Final = 2.0
"""Maximum range of an output while its control is held."""

TOLERANCE_DEG: Final = 0.5
"""Tolerance of an end: one step of the autopilot and the rounding of the servo."""

MOVED_SHARE: Final = 0.3
"""Share of the travel from neutral to an end above which an output has moved."""

PRESENT_S: Final = 1.0
"""An output is missing if ArrayCommand had no entry for it for this time."""


@dataclass(slots=True)
class VerifiedOutput:
    """One output: exported ends and what was seen, °."""

    output: PlanOutput
    low_deg: float
    high_deg: float
    neutral_deg: float
    seen_at: Instant | None = None
    last_deg: float | None = None
    seen_low_deg: float | None = None
    seen_high_deg: float | None = None
    wrong_type: bool = False
    held_deg: float | None = None
    """Mean angle of the last step for this output."""
    swapped_with: int | None = None
    result: Result = "not_moved"
    samples: deque[tuple[Instant, float]] = field(default_factory=lambda: deque[tuple[Instant, float]](maxlen=1500))

    @property
    def positive_deg(self) -> float:
        """The end that a positive demand must reach."""
        return self.low_deg if self.output.reversed else self.high_deg

    def moved(self, degrees: float) -> bool:
        """Whether an angle is clearly away from neutral."""
        end = self.high_deg if degrees > self.neutral_deg else self.low_deg
        return abs(degrees - self.neutral_deg) >= MOVED_SHARE * abs(end - self.neutral_deg)


@dataclass(slots=True)
class ActiveStep:
    """The step in progress: hold all controls at neutral, or that of one output fully positive."""

    kind: StepKind
    output: int | None
    began: Instant


class VerifyOutputs:
    """One verification at a time. Sends nothing."""

    def __init__(self, now: Callable[[], Instant]) -> None:
        self._now = now
        self.plan: Plan | None = None
        self.rows: list[VerifiedOutput] = []
        self.step: ActiveStep | None = None

    def begin(self, plan: Plan) -> None:
        """Start to compare with a checked plan, in place of an earlier one."""
        scale = SCALES[plan.program]
        self.plan, self.step, self.rows = plan, None, []
        for one in sorted(plan.outputs, key=lambda output: output.output):
            found = travel(plan.program, one)
            self.rows.append(
                VerifiedOutput(one, scale.degrees(found.low), scale.degrees(found.high), scale.degrees(found.neutral))
            )

    def end(self) -> None:
        """End the verification. Idempotent."""
        self.plan, self.rows, self.step = None, [], None

    def begin_step(self, kind: StepKind, output: int | None) -> None:
        """Start a step of HOLD_S seconds, in place of an unfinished one. Raises Unknown and InvalidValue."""
        self.require()
        if kind == "positive" and output not in {row.output.output for row in self.rows}:
            raise InvalidValue(
                f"The plan has no output {output}. Its outputs: "
                f"{', '.join(str(row.output.output) for row in self.rows)}.",
                cause="autopilot_output_range", output=output or 0,
            )  # fmt: skip
        self.step = ActiveStep(kind, output if kind == "positive" else None, self._now())

    def left_s(self) -> float | None:
        """Time left of the step, s. None if no step is in progress."""
        return None if self.step is None else max(0.0, self.step.began + HOLD_S - self._now())

    def on_array_command(self, transfer: Transfer, message: ArrayCommand) -> None:
        """Process an ArrayCommand of the autopilot."""
        if self.plan is None:
            return
        entries = {one.actuator_id: one for one in message.commands}
        for row in self.rows:
            entry = entries.get(row.output.servo_id)
            if entry is None:
                continue
            row.seen_at = transfer.at
            row.wrong_type = entry.command_type != CommandType.UNITLESS
            if row.wrong_type or not math.isfinite(entry.command_value):
                continue
            degrees = unitless_degrees(entry.command_value)
            row.last_deg = degrees
            row.seen_low_deg = degrees if row.seen_low_deg is None else min(row.seen_low_deg, degrees)
            row.seen_high_deg = degrees if row.seen_high_deg is None else max(row.seen_high_deg, degrees)
            row.samples.append((transfer.at, degrees))

    def tick(self) -> None:
        """End a step in time, and find missing outputs. Call several times a second."""
        now = self._now()
        for row in self.rows:
            missing = row.seen_at is None or now - row.seen_at > PRESENT_S
            if missing and any(other.seen_at is not None for other in self.rows):
                row.result = "missing"
            elif row.wrong_type:
                row.result = "wrong_type"
            elif row.result in ("missing", "wrong_type"):
                row.result = "not_moved"
        step = self.step
        if step is not None and now - step.began >= HOLD_S:
            self.step = None
            self._judge(step, now)

    def _judge(self, step: ActiveStep, now: Instant) -> None:
        held = {row.output.output: self._held(row, now) for row in self.rows}
        if step.kind == "neutral":
            for row in self.rows:
                degrees = held[row.output.output]
                if degrees is not None:
                    row.held_deg = degrees
                    if abs(degrees - row.neutral_deg) > TOLERANCE_DEG:
                        row.result = _beyond(row, degrees)
            return
        target = next(row for row in self.rows if row.output.output == step.output)
        moved = [row for row in self.rows if (at := held[row.output.output]) is not None and row.moved(at)]
        if target not in moved and target.result not in ("missing", "wrong_type"):
            others = [row for row in moved if row.result != "matches"]
            target.result, target.swapped_with = "not_moved", None
            if len(others) == 1:  # its servo ID is that of the other output
                target.result, target.swapped_with = "swapped", others[0].output.output
            return
        for row in moved:
            degrees = held[row.output.output]
            assert degrees is not None
            row.held_deg, row.swapped_with = degrees, None
            row.result = _result(row, degrees)

    @staticmethod
    def _held(row: VerifiedOutput, now: Instant) -> float | None:
        """Mean of the second half of the step. None if the output was not steady."""
        found = [degrees for at, degrees in row.samples if now - at <= HOLD_S / 2]
        if not found or max(found) - min(found) > STEADY_DEG:
            return None
        return round(sum(found) / len(found), 1)

    def require(self) -> Plan:
        """The plan. Raises Unknown(no_verification) without one."""
        if self.plan is None:
            raise Unknown("no_verification", "No verification is running. Start one first.", cause="no_verification")
        return self.plan


def _result(row: VerifiedOutput, degrees: float) -> Result:
    """Result of a control held fully positive, which moved this output to `degrees`."""
    positive = row.positive_deg - row.neutral_deg
    if (degrees - row.neutral_deg) * positive < 0:
        return "reversed"
    excess = abs(degrees - row.neutral_deg) - abs(positive)
    if abs(excess) <= TOLERANCE_DEG:
        return "matches"
    return "throw_too_large" if excess > 0 else "throw_too_small"


def _beyond(row: VerifiedOutput, degrees: float) -> Result:
    """Result of a neutral position that is not the exported one: an end or the trim differs."""
    return "throw_too_large" if not row.low_deg <= degrees <= row.high_deg else "throw_too_small"
