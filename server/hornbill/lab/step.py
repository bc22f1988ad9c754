"""A small, safe step out and back under a lease, sampled as fast as the servo responds."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Final, Literal, cast

from hornbill.domain.fields import known
from hornbill.domain.set_up import SetUp
from hornbill.domain.step_test import StepMetrics, StepTrace
from hornbill.errors import DidNotMove, InvalidValue
from hornbill.lab import conditions, metrics
from hornbill.lab.horn import CommandedHorn
from hornbill.servo.device.requests import ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.motion import Motion
from hornbill.servo.runtime.jobs import Jobs, RunningJob, Step
from hornbill.servo.runtime.steps import Evidence
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.store import Store
from hornbill.store.tables import Json

LARGEST_DEG: Final = 45.0
"""Largest step, degrees: a step test is a small movement next to a person."""

TRIP: Final = 2.0
"""The test ends if the horn is more than this many steps beyond its target: it does not follow."""

MIN_TRAVEL: Final = 0.5
"""Minimum share of the step that the horn must have moved before a step back can be measured."""

PROCEDURE: Final = "step/1"
"""Runs of another version cannot be compared: raise it if the motion, the sampling or a metric changes."""

STEPS: Final = {
    "check": "Check the servo and record conditions",
    "measure": "Measure steps out and back",
    "evaluate": "Compute and store metrics",
}


@dataclass(frozen=True, slots=True)
class StepPlan:
    """A step test: `step_deg` from the present angle and back, `runs` times, each recorded for `dwell_s`.

    `band_deg` is the settling band. None: 0.5° or the deadband of the servo (0x2E), whichever is larger.
    """

    step_deg: float
    runs: int
    dwell_s: float
    band_deg: float | None
    note: str
    set_up: SetUp


class StepTests:
    """Runs step tests as jobs of kind step_test. A test writes no parameters and moves only one horn.

    If a test ends early (cancelled, an error, a horn that does not follow), the horn is commanded back to its start, if
    the lease and the servo still allow that; otherwise torque is off already.
    """

    def __init__(self, requests: ServoRequests, motion: Motion, base: TimeBase, jobs: Jobs, store: Store) -> None:
        self._requests = requests
        self._motion = motion
        self._base = base
        self._jobs = jobs
        self._store = store

    def begin(self, servo: Servo, lease_id: str | None, plan: StepPlan) -> RunningJob:
        """Start a test. Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoResponse, InvalidValue before sending."""
        if not 0 < abs(plan.step_deg) <= LARGEST_DEG:
            raise InvalidValue(
                f"A step of {plan.step_deg:g}° is not possible. Enter up to ±{LARGEST_DEG:g}°, not 0.",
                cause="step_out_of_range",
                step_deg=plan.step_deg,
                largest_deg=LARGEST_DEG,
            )
        self._motion.may_move(servo, lease_id)
        steps = [Step(name, text) for name, text in STEPS.items()]
        return self._jobs.start("step_test", servo.uid, steps, lambda job: self._work(job, servo, lease_id, plan))

    async def _work(self, job: RunningJob, servo: Servo, lease_id: str | None, plan: StepPlan) -> dict[str, object]:
        horn = CommandedHorn(self._requests, self._motion, self._base, servo, lease_id)
        job.begin("check")
        start_deg = await horn.angle()
        document = await conditions.record(self._requests, self._base, servo, plan.set_up, PROCEDURE)
        band = plan.band_deg or max(0.5, _number(document["parameters"], "angle_dead_band"))
        await horn.command(start_deg)  # this command checks the target
        supply = cast("float | None", document["voltage_v"])
        text = f"horn at {start_deg:+.1f}°, {supply} V, band ±{band:g}°"
        job.done("check", Evidence("test_conditions", text, known(angle_deg=start_deg, supply_v=supply, band_deg=band)))
        job.begin("measure")
        traces: list[StepTrace] = []
        try:
            for _ in range(plan.runs):
                there = start_deg + plan.step_deg
                traces.append(await _step(horn, "there", start_deg, there, plan.dwell_s, band))
                traces.append(await _step(horn, "back", there, start_deg, plan.dwell_s, band))
        except BaseException:
            await horn.return_to(start_deg)
            raise
        samples = sum(len(one.t) for one in traces)
        rate = samples / sum(one.t[-1] for one in traces)
        text = f"{len(traces)} steps, {samples} samples, {rate:.0f}/s"
        values = {"steps": len(traces), "samples": samples, "rate_hz": round(rate)}
        job.done("measure", Evidence("samples", text, values))
        job.begin("evaluate")
        document |= {"step_deg": plan.step_deg, "band_deg": band, "achieved_hz": round(rate, 1)}
        document["warnings"] = await conditions.warnings(self._requests, servo)
        document["steps"] = cast("Json", [one.model_dump() for one in traces])
        run = await self._store.run(self._store.runs.add, servo.uid, plan.note, document)
        first = traces[0].metrics
        text = f"run {run.id}: {_metrics_text(first)}"
        values = known(run=run.id, rise_s=first.rise_s, overshoot_pct=first.overshoot_pct, settling_s=first.settling_s)
        job.done("evaluate", Evidence("run_stored", text, {**values, "sample_s": first.sample_s}))
        return {"run": run.id, "metrics": asdict(first)}


async def _step(
    horn: CommandedHorn, direction: Literal["there", "back"], start: float, to: float, dwell_s: float, band: float
) -> StepTrace:
    servo, begin = horn.servo, await horn.angle()
    if abs(begin - to) < abs(start - to) * MIN_TRAVEL:
        raise DidNotMove(
            f"{servo.title} did not complete the previous step: its horn is at {begin:+.1f}°. "
            "Check whether it is blocked, or stopped by a limit.",
            cause="step_path_differs",
            servo=servo.title,
            angle_deg=begin,
        )
    commanded = await horn.command(round(to, 1))
    t, angles = [0.0], [begin]
    while t[-1] < dwell_s:
        found = await horn.sample()
        if found is None or found[0] - commanded <= t[-1]:
            continue  # a gap reduces the accuracy of the times around it
        angle = found[1]
        t.append(round(found[0] - commanded, 6))
        angles.append(angle)
        if abs(angle - to) > abs(to - start) * (1 + TRIP):
            raise DidNotMove(
                f"{servo.title} does not follow: its horn is at {angle:+.1f}°, {abs(angle - to):.1f}° from its "
                "target. The test was ended. Check for a loose load, or lower the angle P gain.",
                cause="not_following",
                servo=servo.title,
                angle_deg=angle,
                away_deg=abs(angle - to),
            )
    return StepTrace(
        direction=direction, from_deg=begin, to_deg=to, t=t, angle_deg=angles,
        metrics=metrics.of_step(t, angles, begin, to, band_deg=band),
    )  # fmt: skip


def _number(parameters: object, key: str) -> float:
    value = parameters.get(key) if isinstance(parameters, Mapping) else None  # pyright: ignore[reportUnknownVariableType, reportUnknownMemberType]
    return float(value) if isinstance(value, int | float) else 0.0


def _unsettled(one: StepMetrics) -> str:
    if one.hunting == "none":
        return "not settled"
    rate = "" if one.hunting_hz is None else f" at {one.hunting_hz:.1f} Hz"
    return f"not settled: hunting{rate}, {one.hunting_rms_deg or 0.0:.2f}° RMS"


def _metrics_text(one: StepMetrics) -> str:
    rise = "no rise" if one.rise_s is None else f"rise {one.rise_s * 1000:.0f} ms"
    over = "target not reached" if one.overshoot_pct is None else f"overshoot {one.overshoot_pct:.1f} %"
    settled = _unsettled(one) if one.settling_s is None else f"settled after {one.settling_s * 1000:.0f} ms"
    return f"{rise}, {over}, {settled}, ± {one.sample_s * 1000:.1f} ms"
