"""Run of a test plan: targets with counts and exceeded limits, and the position at which it resumes."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar, Final, cast

from hornbill.domain.fields import Param, known
from hornbill.domain.plan import PlanQuantity, PlanStep, RunPlan
from hornbill.domain.profile import Profile
from hornbill.errors import BusDisconnected, HornbillError, LeaseHeld, LeaseRequired, Stopped, UnexpectedResult
from hornbill.servo.device.permission import Target
from hornbill.servo.device.servo import Servo
from hornbill.servo.runs.fleet_run import FleetJob, RunTarget
from hornbill.servo.runtime.leases import HeldLease
from hornbill.servo.runtime.steps import Evidence, Step
from hornbill.units import Instant, Uid

STORED_EXCEEDED: Final = 20
"""Exceeded limits stored for each servo. Later ones are only counted."""

SHOWN_S: Final = 1.0
"""Interval at which the progress is published and stored, with up to SMALL rows of results; longer with more."""
SMALL: Final = 50

UNITS: Final[Mapping[PlanQuantity, str]] = {
    "position_error_deg": "°", "temperature_c": "°C", "torque_pct": "%", "voltage_min_v": "V", "voltage_max_v": "V",
    "faults": "",
}  # fmt: skip

_WORDS: Final[Mapping[PlanQuantity, str]] = {
    "position_error_deg": "position error", "temperature_c": "temperature", "torque_pct": "torque",
    "voltage_min_v": "supply", "voltage_max_v": "supply", "faults": "fault",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """A plan with what it needs to be resumed: servos by name, and a copy of the profile. Stored with the job."""

    plan: RunPlan
    uids: Mapping[str, Uid]
    profile: Profile | None
    confirm: tuple[str, ...]
    by: str

    def document(self) -> dict[str, object]:
        """The request as JSON."""
        return {
            "plan": self.plan.model_dump(), "uids": dict(self.uids),
            "profile": None if self.profile is None else asdict(self.profile), "confirm": list(self.confirm),
            "by": self.by,
        }  # fmt: skip

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> "PlanRequest":
        """The request from stored JSON."""
        profile = document["profile"]
        return cls(
            RunPlan.model_validate(document["plan"]), document["uids"],
            None if profile is None else Profile(**profile), tuple(document["confirm"]), document["by"],
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Exceeded:
    """An exceeded limit. `value`: what was measured, or the key of the fault bit. `at`: seconds since 1970 UTC."""

    cycle: int
    step: int
    quantity: PlanQuantity
    value: float | str
    limit: float | None
    at: float

    @property
    def text(self) -> str:
        """The limit in English, such as "temperature 82 °C, limit 80 °C"."""
        unit = UNITS[self.quantity]
        unit = unit if unit in ("", "°") else f" {unit}"
        if self.limit is None:
            return f"{_WORDS[self.quantity]} {self.value}"
        return f"{_WORDS[self.quantity]} {self.value:g}{unit}, limit {self.limit:g}{unit}"

    def problem(self, target: "PlanTarget") -> UnexpectedResult:
        """The problem of its servo."""
        return UnexpectedResult(
            f"{target.title} exceeded a limit in cycle {self.cycle}, step {self.step}: {self.text}.",
            cause="plan_limit_exceeded", servo=target.title,
            **known(
                cycle=self.cycle, step=self.step, quantity=self.quantity, value=self.value, limit=self.limit,
                unit=UNITS[self.quantity],
            ),
        )  # fmt: skip


@dataclass(slots=True, kw_only=True)
class StepCount:
    """Results of one step of one servo over all cycles. `arrived`: number of moves with a settling time."""

    step: int
    do: str
    runs: int = 0
    exceeded: int = 0
    arrived: int = 0
    settle_s_mean: float | None = None
    settle_s_max: float | None = None
    error_deg_max: float | None = None

    def settled(self, time_s: float) -> None:
        """Add a settling time."""
        self.arrived += 1
        mean = self.settle_s_mean or 0.0
        self.settle_s_mean = round(mean + (time_s - mean) / self.arrived, 6)
        self.settle_s_max = max(self.settle_s_max or 0.0, time_s)

    def error(self, deg: float) -> None:
        """Add a distance from the target, °."""
        self.error_deg_max = max(self.error_deg_max or 0.0, round(deg, 3))

    @property
    def evidence(self) -> Evidence:
        """The results as evidence of the step."""
        text = f"{self.runs - self.exceeded} of {self.runs} within limits"
        if self.error_deg_max is not None:
            text += f", error up to {self.error_deg_max:g}°"
        if self.settle_s_max is not None:
            text += f", settled after {self.settle_s_mean:.3f} s on average, {self.settle_s_max:.3f} s at most"
        values = known(
            runs=self.runs, within=self.runs - self.exceeded, error_deg=self.error_deg_max,
            mean_s=self.settle_s_mean, most_s=self.settle_s_max,
        )  # fmt: skip
        return Evidence("plan_step", text, values)


@dataclass(slots=True, kw_only=True)
class PlanTarget(RunTarget):
    """One servo of a run. `goal`: target that it holds after a move. `had`: fault bits set at the start."""

    name: str
    servo: Servo
    counts: list[StepCount]
    exceeded: list[Exceeded] = field(default_factory=list[Exceeded])
    exceeded_total: int = 0
    measured: dict[str, float] = field(default_factory=dict[str, float])
    dropped: bool = False
    energised: bool = False
    goal: Target | None = None
    had: set[str] = field(default_factory=set[str])
    now_exceeded: set[PlanQuantity] = field(default_factory=set[PlanQuantity])
    """Limits exceeded in the running step."""

    def measure(self, name: str, value: float, *, least: bool = False) -> None:
        """Update the maximum (or minimum) measured value of that name."""
        before = self.measured.get(name)
        self.measured[name] = value if before is None else min(before, value) if least else max(before, value)

    def note(self, one: Exceeded) -> None:
        """Record an exceeded limit. A step counts once, however many of its limits are exceeded."""
        self.exceeded_total += 1
        self.counts[one.step - 1].exceeded += not self.now_exceeded
        self.now_exceeded.add(one.quantity)
        if len(self.exceeded) < STORED_EXCEEDED:
            self.exceeded.append(one)
        if self.problem is None:
            self.fail(one.problem(self))

    def close(self) -> None:
        """Complete the record. A servo that has moved in a run that can be resumed is not finished."""
        if not any(one.runs for one in self.counts):
            RunTarget.close(self)

    def shown(self) -> dict[str, object]:
        """The target in the result of the job, as JSON."""
        return {
            **self.record.document(), "name": self.name, "dropped": self.dropped, "measured": dict(self.measured),
            "steps": [asdict(one) for one in self.counts], "exceeded": [asdict(one) for one in self.exceeded],
            "exceeded_total": self.exceeded_total,
        }  # fmt: skip

    def restore(self, stored: Mapping[str, Any]) -> None:
        """Continue the counts of an earlier run of the job."""
        self.counts = [StepCount(**one) for one in stored["steps"]]
        self.exceeded = [Exceeded(**one) for one in stored["exceeded"]]
        self.exceeded_total, self.measured = stored["exceeded_total"], dict(stored["measured"])

    def plan_step_name(self, number: int) -> str:
        """Name of the job's step for a step of the plan, number from 1."""
        return f"{self.counts[number - 1].do} {self.place}.{number}"


@dataclass(slots=True, kw_only=True)
class PlanRun(FleetJob[PlanTarget]):
    """One run of a plan's job. `cycle` and `step`, from 1: the step that is done next."""

    ENDS: ClassVar[tuple[type[HornbillError], ...]] = (Stopped, BusDisconnected, LeaseRequired, LeaseHeld)
    FAILED = "servos did not complete the plan"
    SHOWS_RESULT = True

    request: PlanRequest
    lease: HeldLease
    cycle: int = 1
    step_number: int = 1
    ran_s: float = 0.0
    _shown_at: Instant = float("-inf")

    @property
    def plan(self) -> RunPlan:
        """The plan."""
        return self.request.plan

    @property
    def ended(self) -> bool:
        """Whether nothing remains to be done: all cycles are complete, or the time of the plan is over."""
        after_s = self.plan.stop.after_s
        return self.cycle > self.plan.cycles or (after_s is not None and self.ran_s >= after_s)

    def advance(self) -> None:
        """Go to the next step."""
        self.step_number += 1
        if self.step_number > len(self.plan.steps):
            self.cycle, self.step_number = self.cycle + 1, 1

    def taking_part(self, step: PlanStep) -> list[PlanTarget]:
        """Targets of a step that have not been dropped."""
        named = self.plan.named(step)
        return [one for one in self.targets if one.name in named and not one.dropped]

    def close(self) -> None:
        """Complete the records."""
        for target in self.targets:
            if target.problem is None and target.exceeded and self.ended:  # by an earlier run of the job
                target.fail(target.exceeded[0].problem(target))
            if target.problem is None and self.ended:
                target.record.verdict = "done"
        FleetJob.close(self)

    def facts(self) -> dict[str, object]:
        """Name, position and progress of the plan."""
        steps, after_s = len(self.plan.steps), self.plan.stop.after_s
        share = ((self.cycle - 1) * steps + self.step_number - 1) / (self.plan.cycles * steps)
        timed = 0.0 if after_s is None else self.ran_s / after_s
        return {
            "plan": self.plan.name, "cycles": self.plan.cycles, "cycles_done": self.cycle - 1,
            "next": [self.cycle, self.step_number], "ran_s": round(self.ran_s, 3),
            "progress": min(1.0, max(share, timed)),
        }  # fmt: skip

    def restore(self, result: Mapping[str, Any]) -> None:
        """Continue at the position and with the counts of an earlier run of the job."""
        self.cycle, self.step_number = result["next"]
        self.ran_s = result["ran_s"]
        by_uid = {one["uid"]: one for one in cast("Sequence[Mapping[str, Any]]", result["servos"])}
        for target in self.targets:
            target.restore(by_uid[target.uid])

    def show(self, now: Instant, *, always: bool = False) -> None:
        """Publish and store the progress, if that was not done recently. `now`: monotonic, s."""
        rows = len(self.targets) * len(self.plan.steps)
        if always or now - self._shown_at >= SHOWN_S * max(1.0, rows / SMALL):
            self._shown_at = now
            self.update_result()
            self.job.on_change(self.job)

    def show_step(self, target: PlanTarget, number: int, *, running: bool, at: float) -> None:
        """Update the step of the job that shows a step of the plan. `at`: seconds since 1970 UTC."""
        count, name = target.counts[number - 1], target.plan_step_name(number)
        step = next(one for one in self.job.steps if one.name == name)
        if running:
            step.state, step.started_at, step.ended_at = "running", at, None
            step.observe(None)
        else:
            step.state, step.ended_at = "failed" if count.exceeded else "done", at
            step.observe(count.evidence)

    def show_counts(self) -> None:
        """Show the results of an earlier run of the job in its steps."""
        for target in self.targets:
            for count in target.counts:
                if count.runs:
                    self.show_step(target, count.step, running=False, at=self.job.created_at)


@dataclass(frozen=True, slots=True)
class PlanResults:
    """Results of one servo: counts of the steps it took part in, exceeded limits, and measured extremes."""

    counts: Sequence[StepCount] = ()
    exceeded: Sequence[Exceeded] = ()
    measured: Mapping[str, float] = field(default_factory=dict[str, float])


def plan_results(result: Mapping[str, Any] | None) -> dict[Uid, PlanResults]:
    """Results of the servos of a plan, from the result of its job. Empty for other jobs."""
    if result is None or "plan" not in result:
        return {}
    return {
        Uid(one["uid"]): PlanResults(
            [StepCount(**count) for count in one["steps"] if count["runs"]],
            [Exceeded(**each) for each in one["exceeded"]],
            one["measured"],
        )
        for one in result["servos"]
    }


def plan_steps(targets: Sequence[PlanTarget], plan: RunPlan, *, profile: bool) -> list[Step]:
    """Steps of the job: preparation of every servo, the steps of the plan for each servo, torque off."""
    kinds = {"write": "Profile written and read back"} if profile else {}
    kinds |= {"check": "Commands checked", "torque_on": "Torque on"}
    found = [target.step(kind, text) for kind, text in kinds.items() for target in targets]
    for number, one in enumerate(plan.steps, start=1):
        for target in targets:
            if target.name in plan.named(one):
                values = _step_params(one, target.name)
                shown = f"{target.title}: {number}. {plan_step_text(one.do, values)}"
                params = {"servo": target.title, "step": number, **values}
                found.append(Step(target.plan_step_name(number), shown, uid=target.uid, params=params))
    return [*found, *(target.step("torque_off", "Torque off") for target in targets)]


def _step_params(step: PlanStep, name: str) -> dict[str, Param]:
    match step.do:
        case "move":
            return {"angle_deg": step.angle_of(name)}
        case "speed":
            return {"rpm": step.speed_rpm, "for_s": step.for_s}
        case "torque":
            return {"torque_pct": step.torque_pct, "for_s": step.for_s}
        case "wait":
            return {"for_s": step.for_s}


_STEP_TEXTS: Final = {
    "move": "Move to {angle_deg:g}°", "speed": "Turn at {rpm:g} rpm for {for_s:g} s",
    "torque": "Push with {torque_pct:g} % for {for_s:g} s", "wait": "Wait {for_s:g} s",
}  # fmt: skip


def plan_step_text(do: str, params: Mapping[str, Param]) -> str:
    """A step of a plan in English, such as "Move to 10°", from the values of its step of the job."""
    return _STEP_TEXTS[do].format(**params)
