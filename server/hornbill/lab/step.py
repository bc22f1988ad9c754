"""A small safe step there and back under a lease, sampled as fast as the servo answers."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Final, Literal, cast

from hornbill.domain.fields import known
from hornbill.domain.step_test import StepMetrics, StepTrace
from hornbill.errors import DidNotMove, HornbillError, InvalidValue, NoResponse
from hornbill.lab import metrics
from hornbill.schema.scale import Value
from hornbill.servo.device.identification import read_rows
from hornbill.servo.device.reading import readings
from hornbill.servo.device.requests import POLL, ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.motion import Motion
from hornbill.servo.runtime.jobs import Jobs, RunningJob, Step
from hornbill.servo.runtime.steps import Evidence
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.store import Store

LARGEST_DEG: Final = 45.0
"""A step test is a small move beside a person; what a large one needs is a program of its own."""

TRIP: Final = 2.0
"""The test ends when the horn is farther than this many steps beyond where it should be: it does not follow."""

STANDS: Final = 0.5
"""With less than this share of the step behind it a horn has not gone there, and a step back measures nothing."""

UNDER: Final = ("current_voltage", "current_temperature")

STEPS: Final = {
    "check": "Ready, and what it is measured under recorded",
    "measure": "Steps out and back",
    "evaluate": "Numbers made and kept",
}


@dataclass(frozen=True, slots=True)
class StepPlan:
    """What to do: `step_deg` from where the horn stands and back, `runs` times, each side watched for `dwell_s`.

    `band_deg` is the settling band; None takes 0.5° or the servo's own dead band (0x2E), whichever is larger.
    """

    step_deg: float
    runs: int
    dwell_s: float
    band_deg: float | None
    note: str


class StepTests:
    """Runs step tests as jobs of kind step_test. A test writes no parameter; all it moves is the one horn.

    Whatever ends it early (cancelled, an error, a horn that does not follow) commands the horn back to where it
    was, if the lease and the servo still allow that; where they do not, torque is off already.
    """

    def __init__(self, requests: ServoRequests, motion: Motion, base: TimeBase, jobs: Jobs, store: Store) -> None:
        self._requests = requests
        self._motion = motion
        self._base = base
        self._jobs = jobs
        self._store = store

    def begin(self, servo: Servo, lease_id: str | None, wish: StepPlan) -> RunningJob:
        """Start a test. Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoResponse, InvalidValue; nothing was sent."""
        if not 0 < abs(wish.step_deg) <= LARGEST_DEG:
            raise InvalidValue(
                f"A step of {wish.step_deg:g}° is no step test. Enter up to ±{LARGEST_DEG:g}°, not 0.",
                cause="step_out_of_range",
                step_deg=wish.step_deg,
                largest_deg=LARGEST_DEG,
            )
        self._motion.may_move(servo, lease_id)
        steps = [Step(name, text) for name, text in STEPS.items()]
        return self._jobs.start("step_test", servo.uid, steps, lambda job: self._work(job, servo, lease_id, wish))

    async def _work(self, job: RunningJob, servo: Servo, lease_id: str | None, wish: StepPlan) -> dict[str, object]:
        job.begin("check")
        home = await self._angle(servo)
        under = await self._record(servo)
        band = wish.band_deg or max(0.5, _number(under["parameters"], "angle_dead_band"))
        await self._motion.command(servo, lease_id, "angle", home, clamp=False)  # its own command decides what is legal
        supply = cast("float | None", under["voltage_v"])
        text = f"horn at {home:+.1f}°, {supply} V, band ±{band:g}°"
        job.done("check", Evidence("test_conditions", text, known(angle_deg=home, supply_v=supply, band_deg=band)))
        job.begin("measure")
        traces: list[StepTrace] = []
        try:
            for _ in range(wish.runs):
                traces.append(
                    await self._step(servo, lease_id, "there", home, home + wish.step_deg, wish.dwell_s, band)
                )
                traces.append(await self._step(servo, lease_id, "back", home + wish.step_deg, home, wish.dwell_s, band))
        except BaseException:
            await self._go_home(servo, lease_id, home)
            raise
        samples = sum(len(one.t) for one in traces)
        rate = samples / sum(one.t[-1] for one in traces)
        text = f"{len(traces)} steps, {samples} samples, {rate:.0f} a second"
        values = {"steps": len(traces), "samples": samples, "rate_hz": round(rate)}
        job.done("measure", Evidence("samples", text, values))
        job.begin("evaluate")
        under["warnings"] = [*_warnings(servo), *await self._touched(servo)]
        document = {**under, "step_deg": wish.step_deg, "band_deg": band, "achieved_hz": round(rate, 1)}
        document["steps"] = [one.model_dump() for one in traces]
        run = await self._store.run(self._store.runs.add, servo.uid, wish.note, document)  # pyright: ignore[reportArgumentType] - plain JSON
        first = traces[0].metrics
        text = f"run {run.id}: {_in_words(first)}"
        values = known(run=run.id, rise_s=first.rise_s, overshoot_pct=first.overshoot_pct, settling_s=first.settling_s)
        job.done("evaluate", Evidence("run_stored", text, {**values, "sample_s": first.sample_s}))
        return {"run": run.id, "metrics": asdict(first)}

    async def _step(
        self,
        servo: Servo,
        lease_id: str | None,
        direction: Literal["there", "back"],
        start: float,
        to: float,
        dwell_s: float,
        band: float,
    ) -> StepTrace:
        begin = await self._angle(servo)
        if abs(begin - to) < abs(start - to) * STANDS:
            raise DidNotMove(
                f"{servo.title} did not go the way the step went before: its horn is at {begin:+.1f}°. "
                "Look whether it is blocked, or held by a limit.",
                cause="step_path_differs",
                servo=servo.title,
                angle_deg=begin,
            )
        await self._motion.command(servo, lease_id, "angle", round(to, 1), clamp=False)
        commanded = servo.registers["command_angle"].at
        assert commanded is not None  # it has just been answered
        t, angles = [0.0], [begin]
        while t[-1] < dwell_s:
            self._motion.may_move(servo, lease_id)
            asked = self._base.now()
            try:
                angle = await self._angle(servo)
            except NoResponse:
                continue  # a gap is a gap: it widens the error of the times around it
            at = (asked + self._base.now()) / 2 - commanded
            if at <= t[-1]:
                continue
            t.append(round(at, 6))
            angles.append(angle)
            if abs(angle - to) > abs(to - start) * (1 + TRIP):
                raise DidNotMove(
                    f"{servo.title} does not follow: its horn is at {angle:+.1f}°, {abs(angle - to):.1f}° from its "
                    "target. The test was ended. Look for a loose load, or lower the angle P gain.",
                    cause="not_following",
                    servo=servo.title,
                    angle_deg=angle,
                    away_deg=abs(angle - to),
                )
        return StepTrace(
            direction=direction, from_deg=begin, to_deg=to, t=t, angle_deg=angles,
            metrics=metrics.of_step(t, angles, begin, to, band_deg=band),
        )  # fmt: skip

    async def _angle(self, servo: Servo) -> float:
        row = servo.registers["current_angle"].parameter
        return await self._requests.read(servo, row, POLL) / row.per_unit

    async def _record(self, servo: Servo) -> dict[str, object]:
        """What the numbers depend on: every row that ROM keeps, supply and temperature."""
        unknown = [key for key, one in servo.registers.items() if one.parameter.rom and one.at is None]
        await read_rows(self._requests, servo, [*unknown, *(key for key in UNDER if key in servo.registers)])
        shown = readings(servo, self._base)
        kept: dict[str, Value] = {key: one.value for key, one in shown.items() if servo.registers[key].parameter.rom}
        return {
            "model": None if servo.model is None else servo.model.name,
            "firmware": servo.firmware_text,
            "voltage_v": shown["current_voltage"].value,
            "temperature_c": shown["current_temperature"].value,
            "parameters": kept,
        }

    async def _touched(self, servo: Servo) -> list[str]:
        """Whether a limit of the servo acted: then the numbers are those of the limit, not of the loop."""
        try:
            bits = await self._requests.read(servo, servo.registers["fault_notification"].parameter, POLL)
        except HornbillError:
            return ["Whether a limit acted is not known: the notifications could not be read."]
        limits = sum(
            bit.mask for bit in servo.catalog.faults_of(pwm=False) if bit.level == "notification" and bit.limit
        )
        return ["A limit of the servo acted, so these are its numbers, not the loop's."] if bits & limits else []

    async def _go_home(self, servo: Servo, lease_id: str | None, home: float) -> None:
        try:
            await self._motion.command(servo, lease_id, "angle", home, clamp=False)
        except HornbillError:
            pass  # stopped, or without a lease: torque is off or on its way there


def _warnings(servo: Servo) -> list[str]:
    found: list[str] = []
    if servo.raw("smoothing") == 1:
        found.append("Smoothing (0x22) is on: this measures the smoother (section 4.15).")
    return found


def _number(parameters: object, key: str) -> float:
    value = parameters.get(key) if isinstance(parameters, Mapping) else None  # pyright: ignore[reportUnknownVariableType, reportUnknownMemberType]
    return float(value) if isinstance(value, int | float) else 0.0


def _unsettled(one: StepMetrics) -> str:
    if one.hunting == "none":
        return "not settled"
    rate = "" if one.hunting_hz is None else f" at {one.hunting_hz:.1f} Hz"
    return f"not settled: it hunts{rate}, {one.hunting_rms_deg or 0.0:.2f}° RMS"


def _in_words(one: StepMetrics) -> str:
    rise = "no rise" if one.rise_s is None else f"rise {one.rise_s * 1000:.0f} ms"
    over = "target not reached" if one.overshoot_pct is None else f"overshoot {one.overshoot_pct:.1f} %"
    settled = _unsettled(one) if one.settling_s is None else f"settled after {one.settling_s * 1000:.0f} ms"
    return f"{rise}, {over}, {settled}, ± {one.sample_s * 1000:.1f} ms"
