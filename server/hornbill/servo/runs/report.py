"""Report of a job, servo by servo, from the data stored with the job."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime

from hornbill.servo.configuration import record as records
from hornbill.servo.configuration.record import ServoRecord
from hornbill.servo.runs.plan_run import PlanResults, StepCount, plan_results, plan_step_text
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.steps import Step
from hornbill.store.servos import StoredServo
from hornbill.units import Uid

KIND_TITLES = {
    "commissioning": "Commissioning",
    "profile": "Profile applied",
    "save": "Saved to ROM",
    "restart": "Restart",
    "factory_reset": "Factory reset",
    "identify": "Identified",
    "plan": "Test plan",
}


@dataclass(frozen=True, slots=True)
class ReportTarget:
    """One servo of the job, with its steps. `plan`: its results in a test plan."""

    record: ServoRecord
    steps: Sequence[Step]
    plan: PlanResults = field(default_factory=PlanResults)

    def action(self, count: StepCount) -> str:
        """Step of the plan, such as `Move to 10°`."""
        steps = (one for one in self.steps if (one.code, one.params.get("step")) == (count.do, count.step))
        return next((plan_step_text(count.do, one.params) for one in steps), "")


@dataclass(frozen=True, slots=True)
class Report:
    """A job as a report. `steps`: those without a servo. Instants: seconds since 1970 UTC."""

    job_id: str
    kind: str
    state: str
    created_at: float
    ended_at: float | None
    problem: str | None
    targets: Sequence[ReportTarget]
    steps: Sequence[Step]
    subject: str = ""

    @property
    def title(self) -> str:
        """Heading of the report."""
        title = KIND_TITLES.get(self.kind, self.kind.replace("_", " ").capitalize())
        return f"{title}: {self.subject}" if self.subject else title

    @property
    def filename(self) -> str:
        """File name without extension."""
        day = datetime.fromtimestamp(self.created_at, UTC).strftime("%Y%m%d")
        return f"hornbill-{self.kind.replace('_', '-')}-{day}-{self.job_id[:8]}"

    def count(self, verdict: str) -> int:
        """Number of servos with this verdict."""
        return sum(target.record.verdict == verdict for target in self.targets)


def report(job: RunningJob, inventory: Callable[[Uid], StoredServo | None]) -> Report:
    """The report of a job, running or ended. `inventory` supplies servos without a record in the result."""
    stored = records.of_result(job.result)
    wanted: dict[Uid, None] = dict.fromkeys(stored)
    wanted |= dict.fromkeys(step.uid for step in job.steps if step.uid is not None)
    if job.uid is not None:
        wanted[job.uid] = None
    planned = plan_results(job.result)
    targets = [
        ReportTarget(
            stored[uid] if uid in stored else _from_steps(job, uid, inventory(uid)),
            _about(job, uid),
            planned.get(uid, PlanResults()),
        )
        for uid in wanted
    ]
    loose = [step for step in job.steps if step.uid is None and job.uid is None]
    problem = None if job.error is None else job.error.detail
    subject = str((job.result or {}).get("plan", ""))
    return Report(job.id, job.kind, job.state, job.created_at, job.ended_at, problem, targets, loose, subject)


def took(step: Step) -> float | None:
    """Duration of a step, s. None if it was skipped or has not ended."""
    return None if step.started_at is None or step.ended_at is None else max(0.0, step.ended_at - step.started_at)


def _about(job: RunningJob, uid: Uid) -> list[Step]:
    """The steps of a job for one servo."""
    return [step for step in job.steps if (step.uid or job.uid) == uid]


def _from_steps(job: RunningJob, uid: Uid, known: StoredServo | None) -> ServoRecord:
    """Record of a servo that has none in the result, from the inventory and its steps."""
    made = records.of_inventory(uid, known)
    mine = _about(job, uid)
    begun = [step.started_at for step in mine if step.started_at is not None]
    ended = [step.ended_at for step in mine if step.ended_at is not None]
    made.started_at, made.ended_at = min(begun, default=None), max(ended, default=None)
    failed = [step for step in mine if step.state == "failed"]
    if failed or (job.uid == uid and job.error is not None):
        if job.error is not None:
            made.fail(job.error)
        else:
            made.verdict, made.problem = "failed", {"detail": failed[0].evidence or f"{failed[0].text}: failed"}
    elif job.ended and made.started_at is None:
        made.verdict = "not_tried"
    elif job.ended and all(step.state in ("done", "skipped") for step in mine):
        made.verdict = "done"
    return made
