"""Improve: better gains for a servo and its load, kept only if measured better; otherwise everything is restored."""

import contextlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from statistics import median
from typing import Final, cast

import numpy as np

from hornbill.domain.fields import Param, known
from hornbill.domain.improve import Goal, ImproveBounds, ImprovePreview
from hornbill.domain.note import Note
from hornbill.domain.set_up import SetUp
from hornbill.domain.step_test import StepTrace
from hornbill.errors import (
    Busy,
    DidNotMove,
    HornbillError,
    InvalidValue,
    NoResponse,
    NotAvailable,
    NotInThisModel,
    UnexpectedResult,
)
from hornbill.lab import conditions, improvement
from hornbill.lab.horn import CommandedHorn
from hornbill.lab.improvement import Improvement, Measured, Plan, Stalled, Watch, measured
from hornbill.lab.model import SHAPING, Gains, Loop
from hornbill.lab.step import PROCEDURE
from hornbill.schema import scale
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import Value
from hornbill.servo.device import permission
from hornbill.servo.device.requests import READ, ServoRequests
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.device.temporary_values import TemporaryValues, not_restored, tightened
from hornbill.servo.motion.motion import Motion
from hornbill.servo.runtime.computing import Compute
from hornbill.servo.runtime.jobs import RunningJob, Step
from hornbill.servo.runtime.shielded import shielded
from hornbill.servo.runtime.steps import Evidence
from hornbill.store.audit import NewAuditEntry
from hornbill.store.store import Store
from hornbill.store.tables import Json
from hornbill.units import Instant, Raw

PACKAGE: Final = "scipy"
INSTALL: Final = "pip install 'hornbill[tune]'"

STEP_DEG: Final = 10.0
"""Largest step, °."""
LEAST_STEP_DEG: Final = 3.0
REACH_DEG: Final = 15.0
"""Range to either side of the present angle if none is given, °."""
ROOM: Final = 1.4
"""Room for a step and its overshoot, in steps."""
BEYOND_DEG: Final = 2.0
"""Angle beyond the range at which a step ends, °. A command is never beyond the range."""
DWELL_S: Final = 1.0
BAND_DEG: Final = 0.5
LEAST_HZ: Final = 100.0
"""Minimum samples per second."""
NOISE_DEG: Final = 0.2
"""Largest noise of a horn at rest, RMS, °."""
FULL_PCT: Final = 90
"""Share of the torque limit from which a horn that does not arrive is overloaded."""
REST_S: Final = 0.6
QUIET_S: Final = 1.0

STEPS: Final = {
    "check": "Checked; limits written",
    "baseline": "Present gains measured",
    "identify": "Horn and load identified",
    "search": "Better gains found on the model",
    "confirm": "Measured with the new gains",
    "finish": "Gains kept or restored, and verified",
}


@dataclass(frozen=True, slots=True)
class ImproveRequest:
    """What a client wants. `expert`: also change the speed loop, against the maker's advice."""

    goal: Goal
    bounds: ImproveBounds
    expert: bool = False
    note: str = ""
    set_up: SetUp | None = None


@dataclass(frozen=True, slots=True)
class _Prepared:
    """A request for one servo: range and step, °, and raw limits by key."""

    start_deg: float
    low_deg: float
    high_deg: float
    step_deg: float
    limits: dict[str, Raw]
    plan: Plan


class Improvements:
    """Improves servos as jobs of kind improve.

    Values are written as `TemporaryValues`: every ending except "kept" restores and verifies them. If a job ends by an
    error or is cancelled, torque goes off first.
    """

    def __init__(self, services: HostServices, motion: Motion, store: Store, compute: Compute) -> None:
        self._services = services
        self._motion = motion
        self._store = store
        self._compute = compute

    async def preview(self, servo: Servo, request: ImproveRequest) -> ImprovePreview:
        """What `begin` would do. Only reads. Raises as `begin`, and NoResponse, Refused, BusDisconnected."""
        check_package()
        permission.check_movable(servo)
        await _read(self._services.requests, servo)
        found = _prepared(servo, request)
        return ImprovePreview(
            uid=servo.uid, goal=request.goal, angle_deg=found.start_deg, from_deg=found.low_deg, to_deg=found.high_deg,
            step_deg=found.step_deg, steps=found.plan.most_steps, duration_s=request.bounds.time_s,
            changes=list(_changed(servo, request)),
            limits={key: raw / servo.registers[key].parameter.per_unit for key, raw in found.limits.items()},
        )  # fmt: skip

    def begin(self, servo: Servo, lease_id: str | None, request: ImproveRequest, *, by: str = "") -> RunningJob:
        """Start a job. Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoResponse, InvalidValue, NotAvailable."""
        check_package()
        permission.check_free(servo, self._services.jobs)
        lease = self._motion.may_move(servo, lease_id)
        steps = [Step(name, text) for name, text in STEPS.items()]
        return self._services.jobs.start(
            "improve", servo.uid, steps, lambda job: self._work(job, servo, lease.id, request, by or lease.holder)
        )

    def begin_all(self, servos: Sequence[Servo], lease_id: str | None, request: ImproveRequest) -> RunningJob:
        """Improve several servos in turn, each in a job of its own. Raises as `begin`."""
        check_package()
        if len({one.uid for one in servos}) != len(servos):
            raise InvalidValue("A servo is given twice. Give each once.", cause="duplicate_servo")
        for servo in servos:
            permission.check_free(servo, self._services.jobs)
            self._motion.may_move(servo, lease_id)
        steps = [
            Step(f"improve {number}", f"Improve {servo.title}", uid=servo.uid, params={"servo": servo.title})
            for number, servo in enumerate(servos, 1)
        ]
        return self._services.jobs.start(
            "improve", None, steps, lambda job: self._work_all(job, servos, lease_id, request)
        )

    async def _work_all(
        self, job: RunningJob, servos: Sequence[Servo], lease_id: str | None, request: ImproveRequest
    ) -> dict[str, object]:
        results: dict[str, dict[str, object]] = {}
        for number, servo in enumerate(servos, 1):
            name = f"improve {number}"
            job.begin(name)
            child = self.begin(servo, lease_id, request)
            try:
                await self._services.jobs.wait(child)
            except BaseException:
                await shielded(self._services.jobs.cancel(child.id))
                raise
            if child.error is not None or child.result is None:
                error = child.error or Busy("The improvement was cancelled.", cause="job_cancelled")
                job.fail(name, Evidence.of(error))
                self._motion.may_move(servo, lease_id)  # without control or after a stop, the others are not tried
                continue
            results[servo.uid] = child.result
            note = cast("dict[str, Param]", child.result["text_params"])
            code = "gains_kept" if child.result["outcome"] == "kept" else "gains_restored"
            job.done(name, Evidence(code, str(child.result["text"]), note))
        return {"results": results, **spread(results)}

    async def _work(
        self, job: RunningJob, servo: Servo, lease_id: str, request: ImproveRequest, by: str
    ) -> dict[str, object]:
        outcome, notes = "cancelled", ()
        try:
            async with servo.changing:
                run = _Run(self._services, self._motion, self._store, job, servo, lease_id, request)
                try:
                    result = await run.run(self._compute)
                except BaseException as error:
                    await shielded(run.end_badly(error))
                    raise
            outcome = str(result["outcome"])
            return result
        except HornbillError as error:
            outcome, notes = "failed", (Note.of(error),)
            raise
        finally:
            entry = NewAuditEntry(by, "improve", outcome, servo.uid, requested=request.goal, notes=notes, job=job.id)
            self._services.audit.note(entry)


async def _read(requests: ServoRequests, servo: Servo) -> None:
    keys = [*SHAPING, "angle_limit_cw", "angle_limit_ccw", "torque_mode", "command_angle", "current_voltage"]
    for key in (*keys, "current_angle"):
        if key in servo.registers:
            await requests.read(servo, servo.registers[key].parameter, READ)


def _prepared(servo: Servo, request: ImproveRequest) -> _Prepared:
    """Range, step and limits from rows that were just read. Raises InvalidValue, NotInThisModel."""
    if servo.model is None:
        raise NotInThisModel(
            f"The model of {servo.title} is unknown, so there is no model of its motion.",
            cause="unknown_series",
            servo=servo.title,
            series_number=servo.model_number or 0,
        )
    row, bounds = permission.row_for(servo, "angle"), request.bounds
    start = (servo.raw("current_angle") or 0) / servo.registers["current_angle"].parameter.per_unit
    lowest, highest = (limit / row.per_unit for limit in permission.bounds(servo, row))
    low = max(lowest, start - REACH_DEG if bounds.from_deg is None else bounds.from_deg)
    high = min(highest, start + REACH_DEG if bounds.to_deg is None else bounds.to_deg)
    up, down = (high - start) / ROOM, (start - low) / ROOM
    step = min(STEP_DEG, up) if up >= down else -min(STEP_DEG, down)
    if not low <= start <= high or abs(step) < LEAST_STEP_DEG:
        raise InvalidValue(
            f"The horn of {servo.title} is at {start:.1f}°, and {low:g}° to {high:g}° leave no room for a step of "
            f"{LEAST_STEP_DEG:g}° and its overshoot. Give a wider range, or move the horn into it.",
            cause="improve_range_too_small",
            servo=servo.title,
            angle_deg=start,
            minimum=low,
            maximum=high,
            least_deg=LEAST_STEP_DEG,
        )
    limits: dict[str, Raw] = {
        # a limit cannot be on the other side of 0°; commands and samples are checked against the range itself
        "angle_limit_cw": max(0, int(high * row.per_unit)),
        "angle_limit_ccw": min(0, -int(-low * row.per_unit)),
    }
    if servo.raw("speed_torque_control") == 1:
        limits |= tightened(servo, bounds.speed_rpm, bounds.torque_pct)
    band = max(BAND_DEG, servo.number("angle_dead_band") or 0.0)
    step = int(step * 10) / 10
    plan = Plan(request.goal, start, step, DWELL_S, min(band, abs(step) / 4), request.expert)
    return _Prepared(start, low, high, step, {key: raw for key, raw in limits.items() if servo.raw(key) != raw}, plan)


def _changed(servo: Servo, request: ImproveRequest) -> Sequence[str]:
    """Rows that may be changed: D gain has an effect only with 0x25, the speed loop only as an expert."""
    keys = ["angle_p_gain", "angle_dead_band", "angle_boost"]
    if servo.raw("speed_torque_control") == 1:
        keys += ["angle_d_gain", *(("speed_p_gain", "speed_i_gain") if request.expert else ())]
    return [key for key in keys if key in servo.registers]


def package_installed() -> bool:
    """Whether the package that identification needs is installed."""
    return find_spec(PACKAGE) is not None


def check_package() -> None:
    """Raises NotAvailable without the package that identification needs."""
    if not package_installed():
        raise NotAvailable(
            f"Improve needs the package {PACKAGE}. Install it with: {INSTALL}",
            cause="package_missing",
            package=PACKAGE,
            install=INSTALL,
        )


class _Run:
    """One improvement of one servo. Also the `Subject` of `improvement`."""

    def __init__(
        self,
        services: HostServices,
        motion: Motion,
        store: Store,
        job: RunningJob,
        servo: Servo,
        lease_id: str,
        request: ImproveRequest,
    ) -> None:
        self._requests = services.requests
        self._base = services.base
        self._motion = motion
        self._store = store
        self._job = job
        self._servo = servo
        self._lease_id = lease_id
        self._request = request
        self._horn = CommandedHorn(services.requests, motion, services.base, servo, lease_id)
        self._temporary = TemporaryValues(services.owed, services.requests, servo)
        self._until: Instant = self._base.now() + request.bounds.time_s
        self._torque_pct = 0
        self._phase = "check"
        self._prepared: _Prepared

    async def run(self, compute: Compute) -> dict[str, object]:
        """Improve, and return the job's result. `compute` runs fits and searches."""
        job, servo = self._job, self._servo
        job.begin("check")
        await _read(self._requests, servo)
        found = self._prepared = _prepared(servo, self._request)
        set_up = self._request.set_up or conditions.set_up_of(self._store.servos.get(servo.uid))
        document = await conditions.record(self._requests, self._base, servo, set_up, PROCEDURE)
        before = self._values()
        await self._motion.command(servo, self._lease_id, "angle", found.start_deg, clamp=False)
        await self._temporary.set(found.limits)
        assert servo.model is not None
        rows = {key: raw for key in SHAPING if (raw := servo.raw(key)) is not None}
        loop = Loop.of(servo.model, rows, servo.number("current_voltage") or servo.model.nominal_v)
        text = (
            f"horn at {found.start_deg:+.1f}°, steps of up to {abs(found.step_deg):g}° within {found.low_deg:g}° to "
            f"{found.high_deg:g}°"
        )
        values = known(
            angle_deg=found.start_deg, step_deg=abs(found.step_deg), from_deg=found.low_deg, to_deg=found.high_deg
        )
        job.done("check", Evidence("improve_conditions", text, values))
        plan = found.plan
        try:
            made = await improvement.improve(self, loop, plan, compute, self._tell)
        except Stalled as stalled:
            raise self._stalled(stalled.trace) from None
        self._check_baseline(made)
        self._finish_phases(made)
        job.begin("finish")
        gains = made.kept
        if gains is not None:
            await self.write(gains)
        await self.home()
        await self._temporary.restore_all(but=gains or ())
        after_values = await self._read_back(before, gains)
        runs = [await self._stored(document, made.baseline, before)]
        if made.confirmed and made.predicted is not None:
            trial = {**before, **self._shown(made.predicted.gains)}
            runs.append(await self._stored(document, made.confirmed, trial))
        result = self._result(made, before, after_values, runs)
        self._temporary.keep(gains or ())  # nothing can fail after this
        code = "gains_kept" if gains is not None else "gains_restored"
        job.done("finish", Evidence(code, str(result["text"]), cast("dict[str, Param]", result["text_params"])))
        return result

    async def end_badly(self, error: BaseException) -> None:
        """Switch torque off, unless a stop or the end of the lease does so, and restore all rows."""
        servo = self._servo
        if self._motion.is_commanded(servo.uid):
            with contextlib.suppress(HornbillError):  # torque off is then pending and repeated until acknowledged
                await self._motion.disable_torque(servo, "off")
        elif self._motion.stop.latched or self._motion.torque_off.pending(servo.uid):
            await self._motion.torque_off.acknowledged(QUIET_S)
        left = await self._temporary.restore()
        if left and isinstance(error, HornbillError):
            text = f" Not restored yet: {', '.join(left)}. They follow as soon as the servo responds."
            error.extend(after=text, also="not_restored_yet", servo=servo.title, not_restored=left)

    # Subject

    async def write(self, gains: Gains) -> None:
        """Write gains, temporarily."""
        self._motion.may_move(self._servo, self._lease_id)
        await self._temporary.set(gains)

    async def home(self) -> None:
        """Command the start and wait until the horn is at rest."""
        start_deg = self._prepared.start_deg
        target = await self._motion.command(self._servo, self._lease_id, "angle", start_deg, clamp=False)
        until = self._base.now() + REST_S
        while self._base.now() < until:
            self._motion.check_command(self._servo, self._lease_id, target)
            await self._horn.sample()

    async def step(self, to_deg: float, dwell_s: float) -> Measured:
        """Command an angle and sample the horn as fast as the servo responds."""
        servo, found = self._servo, self._prepared
        if self._base.now() > self._until:
            raise UnexpectedResult(
                f"The improvement of {servo.title} took longer than {self._request.bounds.time_s:g} s. "
                "Allow more time.",
                cause="improve_timeout",
                servo=servo.title,
                time_s=self._request.bounds.time_s,
            )
        begin = await self._horn.angle()
        watch = Watch(begin, to_deg, found.plan.band_deg)
        commanded = await self._horn.command(to_deg)
        t, angles, ended = [0.0], [begin], None
        while t[-1] < dwell_s and ended is None:
            sample = await self._horn.sample()
            if sample is None:
                self._check_rate(len(t), self._base.now() - commanded)
                continue
            at, angle = sample[0] - commanded, sample[1]
            if at <= t[-1]:
                continue
            t.append(round(at, 6))
            angles.append(angle)
            ended = watch.add(angle)
            if not found.low_deg - BEYOND_DEG <= angle <= found.high_deg + BEYOND_DEG:
                ended = "away"
        self._check_rate(len(t), t[-1])
        if ended is None:
            self._check_noise(angles[2 * len(angles) // 3 :])
        self._torque_pct = await self._requests.read(servo, servo.registers["current_torque"].parameter, READ)
        direction = "back" if to_deg == round(found.start_deg, 1) else "there"
        return measured(direction, to_deg, t, angles, ended, found.plan.band_deg)

    # checks

    def _check_rate(self, samples: int, seconds: float) -> None:
        if seconds > 0.3 and samples / seconds < LEAST_HZ:
            raise NoResponse(
                f"Only {samples / seconds:.0f} readings per second of {self._servo.title} were answered; Improve needs "
                f"{LEAST_HZ:.0f}. Check the wiring for lost frames, and the load of the bus.",
                cause="improve_too_few_samples",
                servo=self._servo.title,
                rate_hz=round(samples / seconds),
                least_hz=round(LEAST_HZ),
            )

    def _check_noise(self, tail: Sequence[float]) -> None:
        """Noise differs from hunting by neighbouring readings that are unrelated."""
        rest = np.asarray(tail) - np.mean(tail)
        power = float(np.square(rest).mean())
        related = float((rest[1:] * rest[:-1]).mean()) / power if power > 0 else 1.0
        if power > NOISE_DEG**2 and related < 0.3:
            raise UnexpectedResult(
                f"The angle readings of {self._servo.title} have a noise of {power**0.5:.2f}° RMS at rest, at most "
                f"{NOISE_DEG:g}° are usable. Check the sensor, its magnet and the supply.",
                cause="improve_noisy",
                servo=self._servo.title,
                noise_deg=round(power**0.5, 2),
                most_deg=NOISE_DEG,
            )

    def _stalled(self, trace: StepTrace) -> DidNotMove:
        servo, facts = (
            self._servo,
            {"servo": self._servo.title, "angle_deg": trace.angle_deg[-1], "to_deg": trace.to_deg},
        )
        if abs(self._torque_pct) >= self._limit_pct() * FULL_PCT / 100:
            return DidNotMove(
                f"{servo.title} is overloaded or blocked: at {abs(self._torque_pct)} % torque its horn is at "
                f"{trace.angle_deg[-1]:+.1f}° instead of {trace.to_deg:+.1f}°. Relieve it, or raise its torque limits.",
                cause="improve_saturated", torque_pct=abs(self._torque_pct), **facts,
            )  # fmt: skip
        return DidNotMove(
            f"The horn of {servo.title} is at {trace.angle_deg[-1]:+.1f}° instead of {trace.to_deg:+.1f}°. Check "
            "whether it is blocked, or raise the angle P gain.",
            cause="improve_stalled", **facts,
        )  # fmt: skip

    def _limit_pct(self) -> float:
        if self._servo.raw("speed_torque_control") != 1:
            return 100.0
        return min(abs(self._servo.number(key) or 100.0) for key in ("torque_limit_cw", "torque_limit_ccw"))

    def _check_baseline(self, made: Improvement) -> None:
        """Raises DidNotMove if one end of the travel is not reached, although the other is."""
        ends = [one for one in made.baseline if not one.hunts]
        errors = {one.trace.to_deg: abs(float(np.median(one.trace.angle_deg[-20:])) - one.trace.to_deg) for one in ends}
        far = [deg for deg, error in errors.items() if error > abs(self._prepared.step_deg) * improvement.LARGEST_ERROR]
        if len(errors) > 1 and len(far) == 1:
            raise DidNotMove(
                f"{self._servo.title} binds: its horn reaches one end of the step, but stops {errors[far[0]]:.1f}° "
                f"short of {far[0]:+.1f}°. Check the linkage for friction and end stops there.",
                cause="improve_binding",
                servo=self._servo.title,
                angle_deg=far[0],
                away_deg=round(errors[far[0]], 1),
            )

    # steps of the job

    def _tell(self, phase: str, made: Improvement) -> None:
        """Begin a phase. Phases of later rounds belong to the step that already runs."""
        names = list(STEPS)
        if names.index(phase) <= names.index(self._phase):
            return
        if phase == "identify":
            self._check_baseline(made)
        self._done(made)
        self._phase = phase
        self._job.begin(phase)

    def _done(self, made: Improvement) -> None:
        if self._phase != "check":
            self._job.done(self._phase, _evidence(self._phase, made))

    def _finish_phases(self, made: Improvement) -> None:
        self._done(made)
        names = list(STEPS)
        for name in names[names.index(self._phase) + 1 : names.index("finish")]:
            self._job.skip(name, Evidence("nothing_better", "no better gains were found on the model"))

    # values

    def _values(self) -> dict[str, Value]:
        """Engineering values of all rows stored in ROM, as configured."""
        values = self._servo.raws()
        return {
            key: scale.to_value(one.parameter, raw, values)
            for key, one in self._servo.registers.items()
            if one.parameter.rom and (raw := self._servo.configured(key)) is not None
        }

    def _shown(self, gains: Gains) -> dict[str, Value]:
        return {key: scale.to_value(self._row(key), raw, self._servo.raws()) for key, raw in gains.items()}

    def _row(self, key: str) -> Parameter:
        return self._servo.registers[key].parameter

    async def _read_back(self, before: dict[str, Value], gains: Gains | None) -> dict[str, Value]:
        """Read all rows that were written. Raises UnexpectedResult if one differs from what it must be."""
        servo, wanted = self._servo, {**before, **({} if gains is None else self._shown(gains))}
        keys = [*self._prepared.limits, *(key for key in SHAPING if key in servo.registers)]
        wrong: list[str] = []
        for key in keys:
            raw = await self._requests.read(servo, self._row(key), READ)
            if key in wanted and scale.to_value(self._row(key), raw, servo.raws()) != wanted[key]:
                wrong.append(key)
        if wrong:
            raise not_restored(servo, wrong)
        return wanted

    async def _stored(self, document: dict[str, Json], steps: Sequence[Measured], parameters: dict[str, Value]) -> int:
        """Store steps as a run of a step test. Returns its ID."""
        traces = [one.trace for one in steps]
        seconds = sum(one.t[-1] for one in traces)
        start = self._prepared.start_deg
        # a servo that hunts is measured with small steps only
        step = max((one.to_deg - start for one in traces), key=abs)
        whole = {
            **document,
            "parameters": cast("Json", parameters),
            "warnings": await conditions.warnings(self._requests, self._servo),
            "step_deg": round(step, 1),
            "band_deg": self._prepared.plan.band_deg,
            "achieved_hz": round(sum(len(one.t) for one in traces) / max(seconds, 0.001), 1),
            "steps": cast("Json", [one.model_dump() for one in traces]),
        }
        run = await self._store.run(self._store.runs.add, self._servo.uid, self._request.note, whole)
        return run.id

    def _result(
        self, made: Improvement, before: dict[str, Value], after: dict[str, Value], runs: list[int]
    ) -> dict[str, object]:
        servo, keys = self._servo, list(_changed(self._servo, self._request))
        was, now, found = made.before, made.after, made.identified
        assert was is not None
        kept = made.kept is not None
        settled_ms = None if now is None or now.settling_s is None else round(now.settling_s * 1000)
        was_ms = None if was.settling_s is None else round(was.settling_s * 1000)
        predicted = None if made.predicted is None else made.predicted.predicted.settling_s
        values = {key: after.get(key) for key in keys}
        params = known(
            servo=servo.title, goal=self._request.goal, before_ms=was_ms, after_ms=settled_ms,
            hunted=was.hunting == "hunting", p_gain=cast("Param", values.get("angle_p_gain")),
            d_gain=cast("Param", values.get("angle_d_gain")),
        )  # fmt: skip
        return {
            "outcome": "kept" if kept else "not_better",
            "text": _text(servo.title, was_ms, settled_ms, kept=kept, hunted=was.hunting == "hunting"),
            "text_code": "improved" if kept else "not_better",
            "text_params": params,
            "goal": self._request.goal,
            "before": {key: before.get(key) for key in keys},
            "after": values,
            "runs": runs,
            "before_run": runs[0],
            "after_run": runs[1] if len(runs) > 1 else None,
            "measured_before": asdict(was),
            "measured_after": None if now is None else asdict(now),
            "predicted_settling_s": predicted,
            "phase_margin_deg": None if made.predicted is None else made.predicted.margin_deg,
            "plant": None if found is None else asdict(found.constants),
            "intervals": {} if found is None else {name: list(one) for name, one in found.intervals.items()},
            "tried": [
                {"gains": self._shown(one.proposal.gains), "predicted": asdict(one.proposal.predicted),
                 "measured": None if one.score is None else asdict(one.score), "ended": one.ended}
                for one in made.trials
            ],
        }  # fmt: skip


def _text(title: str, before_ms: int | None, after_ms: int | None, *, kept: bool, hunted: bool) -> str:
    was = "hunted" if hunted else "did not settle" if before_ms is None else f"settled in {before_ms} ms"
    if not kept:
        return f"No gains were measured better, so {title} has its previous ones. It {was}."
    now = "is calm" if after_ms is None else f"settles in {after_ms} ms"
    return f"{title} {was} and now {now}. The gains are in RAM: save them to keep them."


def _evidence(phase: str, made: Improvement) -> Evidence:
    """What a completed phase found."""
    if phase == "baseline" and made.before is not None:
        one = made.before
        text = "hunts" if one.hunting == "hunting" else _settles(one.settling_s)
        values = known(
            hunts=one.hunting == "hunting", settling_s=one.settling_s, overshoot_pct=round(one.overshoot_pct, 1)
        )
        return Evidence("baseline_measured", f"{text}, overshoot {one.overshoot_pct:.0f} %", values)
    if phase == "identify" and made.identified is not None:
        found = made.identified.constants
        text = (
            f"inertia {found.inertia:.1f}, friction {found.coulomb * 100:.1f} %, backlash {found.backlash_deg:.2f}°, "
            f"load {found.load_pct:+.0f} %"
        )
        values = known(
            inertia=round(found.inertia, 2), friction_pct=round(found.coulomb * 100, 1),
            backlash_deg=round(found.backlash_deg, 2), load_pct=round(found.load_pct, 1),
        )  # fmt: skip
        return Evidence("horn_identified", text, values)
    if phase == "search" and made.trials:
        one = made.trials[0].proposal
        text = f"{one.tried} sets compared; predicted: {_settles(one.predicted.settling_s)}"
        return Evidence("gains_found", text, known(tried=one.tried, settling_s=one.predicted.settling_s))
    if phase == "confirm" and made.after is not None:
        one = made.after
        text = f"{_settles(one.settling_s)}, overshoot {one.overshoot_pct:.0f} %, {len(made.trials)} sets tried"
        values = known(settling_s=one.settling_s, overshoot_pct=round(one.overshoot_pct, 1), tried=len(made.trials))
        return Evidence("gains_measured", text, values)
    return Evidence("nothing_better", "no better gains were found on the model")


def _settles(settling_s: float | None) -> str:
    return "does not settle" if settling_s is None else f"settles in {settling_s * 1000:.0f} ms"


def spread(results: dict[str, dict[str, object]]) -> dict[str, object]:
    """Spread of gains and settling times of several servos, and the UID of the outlier, if there is one.

    Outlier: the inertia, friction or settling time that is furthest from the median, by more than half of it.
    """
    gains: dict[str, list[float]] = {}
    figures: dict[str, dict[str, float]] = {}
    for uid, one in results.items():
        for key, value in cast("dict[str, Value]", one["after"]).items():
            if isinstance(value, int | float):
                gains.setdefault(key, []).append(float(value))
        plant, after = (
            cast("dict[str, float] | None", one["plant"]),
            cast("dict[str, float | None] | None", one["measured_after"]),
        )
        figures[uid] = {} if plant is None else {"inertia": 1 + plant["inertia"], "friction": plant["coulomb"]}
        if after is not None and (settling := after["settling_s"]) is not None:
            figures[uid]["settling_s"] = settling
    far: list[tuple[float, str, str]] = []
    for name in ("inertia", "friction", "settling_s"):
        known_ones = {uid: one[name] for uid, one in figures.items() if name in one}
        if len(known_ones) >= 3:
            middle = median(known_ones.values())
            far += [(abs(value / middle - 1.0), uid, name) for uid, value in known_ones.items() if middle > 0]
    worst = max(far, default=None)
    return {
        "spread": {key: {"least": min(values), "most": max(values)} for key, values in gains.items()},
        "outlier": None if worst is None or worst[0] <= 0.5 else {"uid": worst[1], "because": worst[2]},
    }
