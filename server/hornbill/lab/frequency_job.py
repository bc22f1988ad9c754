"""A frequency response under a lease: commands on a fixed grid, and the angle sampled in between."""

import asyncio
from dataclasses import asdict, dataclass, replace
from typing import Final, cast

import numpy as np

from hornbill.domain.fields import known
from hornbill.domain.frequency_response import Excitation, FrequencyCurve
from hornbill.domain.set_up import SetUp
from hornbill.errors import DidNotMove, InvalidValue, NoResponse
from hornbill.lab import conditions, frequency
from hornbill.lab.excitation import SLOT_S, ExcitationPlan, offsets
from hornbill.lab.frequency import Curve
from hornbill.lab.horn import CommandedHorn
from hornbill.servo.device.requests import RetryPolicy, ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.motion import Motion
from hornbill.servo.runtime.jobs import Jobs, RunningJob, Step
from hornbill.servo.runtime.steps import Evidence
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.store import Store
from hornbill.store.tables import Json

PROCEDURE: Final = "frequency_response/1"

LARGEST_DEG: Final = 20.0
"""Largest amplitude, degrees, also of a ladder."""

LADDER: Final = (0.5, 1.0, 2.0)
"""Amplitudes of a ladder, as shares of the requested one."""

LEAST_PERIODS: Final = 5.0
"""Minimum duration, in periods of the lowest frequency."""

TRIP: Final = 6.0
TRIP_DEG: Final = 1.0
"""The test ends if the horn is further from its start than TRIP amplitudes (a resonance of 16 dB) plus TRIP_DEG."""

SAMPLE_S: Final = 0.0025
"""Minimum interval of samples: enough for 25 Hz, and leaves two thirds of the bus to others."""

SAMPLE: Final = RetryPolicy(priority=26, timeout_s=0.03, tries=1, kind="poll")
"""A lost sample is not repeated: the next one is as good."""

SETTLE_S: Final = 0.3
"""Rest before the first slot, so that the step to the start angle has decayed."""


@dataclass(frozen=True, slots=True)
class FrequencyPlan:
    """A frequency response about the present angle: one excitation, or with `ladder` three amplitudes of it."""

    excitation: Excitation
    amplitude_deg: float
    from_hz: float
    to_hz: float
    duration_s: float
    ladder: bool
    note: str
    set_up: SetUp

    @property
    def amplitudes(self) -> list[float]:
        """Amplitudes in order, °."""
        return [round(share * self.amplitude_deg, 3) for share in (LADDER if self.ladder else (1.0,))]


@dataclass(slots=True)
class _Record:
    """What was sent and measured at one amplitude: times of the event loop, s, and offsets from the start, °."""

    commands: list[tuple[float, float]]
    samples: list[tuple[float, float]]
    missed: int = 0


class FrequencyTests:
    """Measures frequency responses as jobs of kind frequency_response. Writes no parameters and moves only one horn.

    If a test ends early, the horn is commanded back to its start, if the lease and the servo still allow that;
    otherwise torque is off already.
    """

    def __init__(self, requests: ServoRequests, motion: Motion, base: TimeBase, jobs: Jobs, store: Store) -> None:
        self._requests = requests
        self._motion = motion
        self._base = base
        self._jobs = jobs
        self._store = store

    def begin(self, servo: Servo, lease_id: str | None, plan: FrequencyPlan) -> RunningJob:
        """Start a test. Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoResponse, InvalidValue before sending."""
        check(plan)
        self._motion.may_move(servo, lease_id)
        steps = [
            Step("check", "Check the servo and record conditions"),
            *(
                Step(f"measure {number}", f"Measure at ±{deg:g}°", params={"amplitude_deg": deg})
                for number, deg in enumerate(plan.amplitudes, 1)
            ),
            Step("evaluate", "Compute and store the response"),
        ]
        return self._jobs.start(
            "frequency_response", servo.uid, steps, lambda job: self._work(job, servo, lease_id, plan)
        )

    async def _work(
        self, job: RunningJob, servo: Servo, lease_id: str | None, plan: FrequencyPlan
    ) -> dict[str, object]:
        horn = CommandedHorn(self._requests, self._motion, self._base, servo, lease_id)
        job.begin("check")
        start_deg = await horn.angle()
        document = await conditions.record(self._requests, self._base, servo, plan.set_up, PROCEDURE)
        await self._motion.freshen(servo, "angle")
        lease = self._motion.may_move(servo, lease_id)
        reach = max(plan.amplitudes)
        for end in (start_deg - reach, start_deg + reach):  # both ends are permitted before anything moves
            self._motion.permit(servo, lease, "angle", end, clamp=False, confirm=())
        await horn.command(start_deg)
        supply = cast("float | None", document["voltage_v"])
        text = f"horn at {start_deg:+.1f}°, {supply} V, moves by up to ±{reach:g}°"
        values = known(angle_deg=start_deg, supply_v=supply, amplitude_deg=reach)
        job.done("check", Evidence("response_conditions", text, values))
        curves: list[tuple[Curve, FrequencyCurve]] = []
        try:
            for number, amplitude in enumerate(plan.amplitudes, 1):
                job.begin(f"measure {number}")
                record = await self._measure(horn, start_deg, plan, amplitude)
                job.done(f"measure {number}", _evidence(record))
                smoothing = servo.raw("smoothing") == 1
                curves.append(await asyncio.to_thread(_evaluate, record, plan, amplitude, loop=not smoothing))
        except BaseException:
            await horn.return_to(start_deg)
            raise
        await horn.return_to(start_deg)
        job.begin("evaluate")
        found = frequency.dependence([one for one, _ in curves], plan.amplitudes) if plan.ladder else None
        document |= {
            "warnings": await conditions.warnings(self._requests, servo),
            "excitation": plan.excitation,
            "amplitude_deg": plan.amplitude_deg,
            "from_hz": plan.from_hz,
            "to_hz": plan.to_hz,
            "duration_s": plan.duration_s,
            "start_deg": start_deg,
            "curves": cast("Json", [one.model_dump() for _, one in curves]),
            "dependence": None if found is None else cast("Json", asdict(found)),
        }
        run = await self._store.run(self._store.runs.add, servo.uid, plan.note, document, kind="frequency_response")
        middle = curves[len(curves) // 2][1]
        good = [hz for hz, reliable in zip(middle.frequency_hz, middle.reliable, strict=True) if reliable]
        text = f"run {run.id}: " + (f"reliable from {good[0]:.1f} to {good[-1]:.1f} Hz" if good else "not reliable")
        values = known(run=run.id, from_hz=good[0] if good else None, to_hz=good[-1] if good else None)
        job.done("evaluate", Evidence("response_stored", text, values))
        return {"run": run.id}

    async def _measure(self, horn: CommandedHorn, start_deg: float, plan: FrequencyPlan, amplitude: float) -> _Record:
        """One excitation: each slot is commanded when it is due, and the angle is sampled until the next one is."""
        await asyncio.sleep(SETTLE_S)
        shape = ExcitationPlan(plan.excitation, amplitude, plan.from_hz, plan.to_hz, plan.duration_s)
        slots = offsets(shape)
        record = _Record([], [])
        trips: list[float] = []
        begin, done = self._base.now(), 0
        while done < len(slots):
            due = int((self._base.now() - begin) / SLOT_S + 1e-6)  # the clock may be one rounding error short
            if due >= len(slots):
                record.missed += len(slots) - done
                break
            if due >= done:
                record.missed += due - done
                done = due + 1
                try:
                    record.commands.append((await horn.command(round(start_deg + slots[due], 1)), slots[due]))
                except NoResponse:
                    record.missed += 1  # the servo keeps the previous command
            await self._sample(horn, start_deg, amplitude, record, trips, begin + done * SLOT_S)
        half = float(np.median(trips)) / 2 if trips else 0.0
        # a response arrives half a round trip after the servo acted
        record.commands = [(at - half, offset) for at, offset in record.commands]
        return record

    async def _sample(
        self, horn: CommandedHorn, start_deg: float, amplitude: float, record: _Record, trips: list[float], until: float
    ) -> None:
        """Read the angle until the next slot is due. `trips`: round-trip times, s."""
        while (sent := self._base.now()) < until:
            found = await horn.sample(policy=SAMPLE)
            if found is None:
                continue
            now = self._base.now()
            trips.append(now - sent)
            at, offset = found[0], found[1] - start_deg
            if not record.samples or at > record.samples[-1][0]:
                record.samples.append((at, offset))
            if abs(offset) > TRIP * amplitude + TRIP_DEG:
                raise DidNotMove(
                    f"{horn.servo.title} swings too far: its horn is {abs(offset):.1f}° from its start at an amplitude "
                    f"of {amplitude:g}°. The test was ended. Lower the angle P gain or the amplitude.",
                    cause="swings_too_far",
                    servo=horn.servo.title,
                    away_deg=round(abs(offset), 1),
                    amplitude_deg=amplitude,
                )
            await asyncio.sleep(max(0.0, min(sent + SAMPLE_S, until) - now))


def check(plan: FrequencyPlan) -> None:
    """Check what no single field shows. Raises InvalidValue."""
    largest = max(plan.amplitudes)
    if largest > LARGEST_DEG:
        limit = LARGEST_DEG / max(LADDER) if plan.ladder else LARGEST_DEG
        raise InvalidValue(
            f"An amplitude of {plan.amplitude_deg:g}° is above the limit of {limit:g}°. Enter a smaller one.",
            cause="amplitude_out_of_range",
            amplitude_deg=plan.amplitude_deg,
            largest_deg=limit,
        )
    if plan.to_hz < 2 * plan.from_hz:
        raise InvalidValue(
            f"The highest frequency of {plan.to_hz:g} Hz must be at least twice the lowest of {plan.from_hz:g} Hz.",
            cause="frequencies_out_of_range",
            from_hz=plan.from_hz,
            to_hz=plan.to_hz,
        )
    least = LEAST_PERIODS / plan.from_hz
    if plan.duration_s < least:
        raise InvalidValue(
            f"{plan.duration_s:g} s is too short for {plan.from_hz:g} Hz. Enter at least {least:g} s, or a higher "
            "lowest frequency.",
            cause="duration_too_short",
            duration_s=plan.duration_s,
            least_s=round(least, 1),
            from_hz=plan.from_hz,
        )


def _evidence(record: _Record) -> Evidence:
    rate = _rate(record)
    slots = len(record.commands) + record.missed
    text = f"{len(record.samples)} samples, {rate:.0f}/s, {record.missed} of {slots} commands missed"
    values = {"samples": len(record.samples), "rate_hz": round(rate), "missed": record.missed, "slots": slots}
    return Evidence("response_measured", text, {**values})


def _rate(record: _Record) -> float:
    if len(record.samples) < 2:
        return 0.0
    return (len(record.samples) - 1) / (record.samples[-1][0] - record.samples[0][0])


def _evaluate(record: _Record, plan: FrequencyPlan, amplitude: float, *, loop: bool) -> tuple[Curve, FrequencyCurve]:
    """Curve and metrics of one record. With too few commands or samples nothing is reliable."""
    if len(record.commands) < 2 or len(record.samples) < 2:
        record = replace(record, commands=[(0.0, 0.0), (1.0, 0.0)], samples=[(0.0, 0.0), (1.0, 0.0)])
    chirp_deg = amplitude if plan.excitation == "chirp" else None
    curve = frequency.estimate(record.commands, record.samples, plan.from_hz, plan.to_hz, chirp_deg=chirp_deg)

    def rounded(values: np.ndarray, digits: int) -> list[float]:
        return [round(float(one), digits) for one in np.nan_to_num(values)]

    return curve, FrequencyCurve(
        amplitude_deg=amplitude,
        peak_deg=round(max(abs(offset) for _, offset in record.samples), 2),
        frequency_hz=rounded(curve.hz, 4),
        gain_db=rounded(curve.gain_db, 3),
        gain_error_db=rounded(curve.gain_error_db, 3),
        phase_deg=rounded(curve.phase_deg, 2),
        phase_error_deg=rounded(curve.phase_error_deg, 2),
        coherence=rounded(curve.coherence, 4),
        reliable=[bool(one) for one in curve.reliable],
        samples=len(record.samples),
        achieved_hz=round(_rate(record), 1),
        slots=len(record.commands) + record.missed,
        missed_slots=record.missed,
        metrics=frequency.metrics(curve, loop=loop),
    )
