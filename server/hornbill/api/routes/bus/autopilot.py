"""Routes for servos commanded by an autopilot: parameter files, live verification and failsafe."""

from typing import Annotated, Literal

from fastapi import Query
from pydantic import Field

from hornbill.api.dependencies import TheHost, TheServo
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.autopilot import files
from hornbill.autopilot.advice import AdviceItem, OutputFacts, advice
from hornbill.autopilot.plan import FIRST_ID, OUTPUTS, Bound, Plan, PlanOutput, check
from hornbill.domain.autopilot import Program
from hornbill.domain.fields import Model
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host
from hornbill.servo.monitoring.verify_outputs import HOLD_S, VerifiedOutput

routes = Routes("autopilot")


class ParameterFile(Model):
    """A parameter file for an autopilot."""

    name: str = Field(description="File name.")
    text: str = Field(description="Content, with comments.")
    advice: list[AdviceItem] = Field(description="Points to check.")


class ParameterFileText(Model):
    """A parameter file of an autopilot."""

    program: Program = Field(description="Autopilot that wrote it.")
    text: str = Field(max_length=2_000_000, description="Content.")


class ImportedPlan(Model):
    """Outputs of a parameter file."""

    plan: Plan = Field(description="Outputs on DroneCAN.")
    advice: list[AdviceItem] = Field(description="Points to check.")


class VerifyRow(Model):
    """One output: what was exported, and what is on the bus."""

    output: int = Field(description="Output number.")
    servo_id: int = Field(description="Servo ID it commands.")
    label: str = Field(description="Name of the servo. Empty if none.")
    low_deg: float = Field(description="Exported counterclockwise end, °.")
    high_deg: float = Field(description="Exported clockwise end, °.")
    neutral_deg: float = Field(description="Exported neutral, °.")
    positive_deg: float = Field(description="Exported end of a positive demand, °.")
    last_deg: float | None = Field(description="Last commanded angle, °. Null if none.")
    seen_low_deg: float | None = Field(description="Lowest commanded angle so far, °. Null if none.")
    seen_high_deg: float | None = Field(description="Highest commanded angle so far, °. Null if none.")
    held_deg: float | None = Field(description="Commanded angle while its control was held, °. Null if not yet.")
    result: Literal[
        "matches", "reversed", "swapped", "missing", "throw_too_small", "throw_too_large", "wrong_type", "not_moved"
    ] = Field(
        description="matches: within 0.5° at the positive end. reversed: moved to the other end. swapped: another "
        "output moved. missing: ArrayCommand has no entry for it. throw_too_small, throw_too_large: the end differs. "
        "wrong_type: not UNITLESS. not_moved: not moved enough yet."
    )
    swapped_with: int | None = Field(description="Output that moved instead. Null unless swapped.")


class Verification(Model):
    """State of the live verification."""

    program: Program = Field(description="Autopilot of the plan.")
    step: Literal["neutral", "positive"] | None = Field(description="Step in progress. Null if none.")
    output: int | None = Field(description="Output of the step. Null for all.")
    left_s: float | None = Field(description="Time left of the step, s. Null without a step.")
    hold_s: float = Field(description="Duration of a step, s.")
    rows: list[VerifyRow] = Field(description="Outputs of the plan.")


class VerifyStep(Model):
    """Step of a verification: the user holds the control for 3 s."""

    kind: Literal["neutral", "positive"] = Field(
        description="neutral: all controls centred. positive: the control of `output` fully in its positive direction."
    )
    output: int | None = Field(default=None, ge=1, le=32, description="Output of a positive step.")


class MeasuredGap(Model):
    """The last gap of commands that was longer than the timeout."""

    node_id: int = Field(description="Node that stopped commanding.")
    at: float = Field(description="Time of its last command, seconds since 1970 UTC.")
    gap_s: float | None = Field(description="Duration of the gap, s. Null while it lasts.")
    torque_pct: float | None = Field(description="Torque read after the timeout, %. Null if not read.")


class Failsafe(Model):
    """What a servo does when commands stop (0x26, 0x27)."""

    action: Literal["hold", "off", "brake"] | None = Field(description="Timeout action (0x26). Null if unknown.")
    after_s: float | None = Field(description="Timeout (0x27), s. Null if unknown.")
    text: str = Field(description="What it does, one sentence.")
    confirmed: MeasuredGap | None = Field(description="Last measured gap. Null if none was seen.")


@routes.get("/autopilot/plan", Role.VIEW)
async def get_autopilot_plan(
    host: TheHost, program: Annotated[Program, Query(description="Autopilot of the plan.")] = "ardupilot"
) -> list[PlanOutput]:
    """Get outputs proposed for the connected servos: ends are their angle limits, at most ±45° from neutral 0°.

    Servos whose ID the autopilot cannot address are left out.
    """
    first, found = FIRST_ID[program], list[PlanOutput]()
    for servo in host.fleet.all():
        n = None if servo.servo_id is None else servo.servo_id + 1 - first
        if n is None or not 1 <= n <= OUTPUTS[program] or not servo.online or any(one.output == n for one in found):
            continue
        low, high = _limits(servo)
        found.append(
            PlanOutput(
                output=n, servo_id=n - 1 + first, label=servo.title[:40],
                low_deg=max(-45.0, min(-1.0, -45.0 if low is None else low)),
                high_deg=min(45.0, max(1.0, 45.0 if high is None else high)),
            )
        )  # fmt: skip
    return sorted(found, key=lambda one: one.output)


@routes.post("/autopilot/export", Role.VIEW, "invalid_value", "out_of_range")
async def export_autopilot_parameters(host: TheHost, body: Plan) -> ParameterFile:
    """Write the parameter file of an autopilot. Refused if a linkage could not take it. Sends nothing."""
    _check(host, body)
    name = "hornbill.param" if body.program == "ardupilot" else "hornbill.params"
    return ParameterFile(name=name, text=files.write(body), advice=_advice(host, body))


@routes.post("/autopilot/import", Role.VIEW, "invalid_value")
async def import_autopilot_parameters(host: TheHost, body: ParameterFileText) -> ImportedPlan:
    """Read a parameter file of an autopilot. Parameters that do not concern servos are skipped."""
    plan = files.read(body.text, body.program)
    return ImportedPlan(plan=plan, advice=_advice(host, plan))


@routes.put("/autopilot/verification", Role.OPERATE, "invalid_value", "out_of_range", "bus_disconnected")
async def begin_verification(host: TheHost, body: Plan) -> Verification:
    """Start to compare the ArrayCommand messages on the bus with a plan. Sends nothing."""
    host.connected()
    _check(host, body, limits=False)
    host.verify_outputs.begin(body)
    return _verification(host)


@routes.get("/autopilot/verification", Role.VIEW, "no_verification")
async def get_verification(host: TheHost) -> Verification:
    """Get the state of the verification."""
    return _verification(host)


@routes.post("/autopilot/verification/steps", Role.OPERATE, "no_verification", "invalid_value")
async def begin_verification_step(host: TheHost, body: VerifyStep) -> Verification:
    """Start a step: the user holds all controls centred, or one fully positive, for 3 s."""
    host.verify_outputs.begin_step(body.kind, body.output)
    return _verification(host)


@routes.delete("/autopilot/verification", Role.OPERATE, status_code=204)
async def end_verification(host: TheHost) -> None:
    """End the verification. Idempotent."""
    host.verify_outputs.end()


@routes.get("/servos/{uid}/failsafe", Role.VIEW, "unknown_servo")
async def get_failsafe(host: TheHost, servo: TheServo) -> Failsafe:
    """Get what the servo does when commands stop, and the last gap that confirmed it."""
    action, timeout = servo.raw("timeout_action"), servo.raw("timeout_time")
    after = None if timeout is None else timeout / 1000
    word = {0: "hold", 1: "off", 2: "brake"}.get(-1 if action is None else action)
    gap = host.commanders.last_gap(servo.uid)
    measured = None
    if gap is not None:
        measured = MeasuredGap(
            node_id=gap.node_id, at=host.base.utc(gap.at), gap_s=None if gap.gap_s is None else round(gap.gap_s, 3),
            torque_pct=gap.torque_pct,
        )  # fmt: skip
    return Failsafe(
        action=word,  # pyright: ignore[reportArgumentType] - one of these words
        after_s=after, text=_failsafe_text(word, after), confirmed=measured,
    )  # fmt: skip


def _failsafe_text(action: str | None, after_s: float | None) -> str:
    match action:
        case "hold":
            return "If commands stop, it holds its last command indefinitely."
        case "off":
            return f"If commands stop for {after_s:g} s, it switches its output off: the horn can be moved freely."
        case "brake":
            return f"If commands stop for {after_s:g} s, it brakes: the horn resists weakly."
        case _:
            return "What it does if commands stop is not known yet: 0x26 and 0x27 have not been read."


def _limits(servo: Servo) -> tuple[Bound, Bound]:
    """Angle limits of a servo, °, as last read."""
    return servo.number("angle_limit_ccw"), servo.number("angle_limit_cw")


def _by_id(host: Host) -> dict[int, Servo]:
    return {servo.servo_id: servo for servo in host.fleet.all() if servo.online and servo.servo_id is not None}


def _check(host: Host, plan: Plan, *, limits: bool = True) -> None:
    known = {servo_id: _limits(servo) for servo_id, servo in _by_id(host).items()} if limits else {}
    check(plan, known)


def _advice(host: Host, plan: Plan) -> list[AdviceItem]:
    facts: dict[int, OutputFacts] = {}
    for servo_id, servo in _by_id(host).items():
        low, high = _limits(servo)
        timeout = servo.raw("timeout_time")
        facts[servo_id] = OutputFacts(
            fixed_node_id=servo.raw("node_id"), low_deg=low, high_deg=high,
            deadband_deg=servo.number("angle_dead_band"), timeout_action=servo.raw("timeout_action"),
            timeout_s=None if timeout is None else timeout / 1000,
        )  # fmt: skip
    return list(advice(plan, facts))


def _verification(host: Host) -> Verification:
    verify = host.verify_outputs
    plan, step, left = verify.require(), verify.step, verify.left_s()
    return Verification(
        program=plan.program,
        step=None if step is None else step.kind,
        output=None if step is None else step.output,
        left_s=None if left is None else round(left, 2),
        hold_s=HOLD_S,
        rows=[_row(one) for one in verify.rows],
    )


def _row(one: VerifiedOutput) -> VerifyRow:
    return VerifyRow(
        output=one.output.output, servo_id=one.output.servo_id, label=one.output.label,
        low_deg=round(one.low_deg, 1), high_deg=round(one.high_deg, 1), neutral_deg=round(one.neutral_deg, 1),
        positive_deg=round(one.positive_deg, 1), last_deg=one.last_deg, seen_low_deg=one.seen_low_deg,
        seen_high_deg=one.seen_high_deg, held_deg=one.held_deg, result=one.result, swapped_with=one.swapped_with,
    )  # fmt: skip
