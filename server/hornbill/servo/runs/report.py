"""Report of a job, servo by servo, from what the job itself stores."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, cast

from hornbill.schema.catalog import Catalog
from hornbill.schema.parameter import Parameter
from hornbill.servo.configuration import record as records
from hornbill.servo.configuration.record import ServoRecord
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
}


@dataclass(frozen=True, slots=True)
class ReportTarget:
    """One servo of the job, and the steps that were about it."""

    record: ServoRecord
    steps: Sequence[Step]


@dataclass(frozen=True, slots=True)
class Report:
    """A job as a report; `steps` are those about no one servo. Instants are seconds since 1970 (UTC)."""

    job_id: str
    kind: str
    state: str
    created_at: float
    ended_at: float | None
    problem: str | None
    targets: Sequence[ReportTarget]
    steps: Sequence[Step]

    @property
    def title(self) -> str:
        """Heading of the report."""
        return KIND_TITLES.get(self.kind, self.kind.replace("_", " ").capitalize())

    @property
    def filename(self) -> str:
        """File name without extension."""
        day = datetime.fromtimestamp(self.created_at, UTC).strftime("%Y%m%d")
        return f"hornbill-{self.kind.replace('_', '-')}-{day}-{self.job_id[:8]}"

    def count(self, verdict: str) -> int:
        """How many servos have this verdict."""
        return sum(target.record.verdict == verdict for target in self.targets)


def report(job: RunningJob, inventory: Callable[[Uid], StoredServo | None], catalog: Catalog) -> Report:
    """The report of a job, running or ended. `inventory` supplies servos without a record in the result."""
    kept = _kept(job, catalog, inventory)
    wanted: dict[Uid, None] = dict.fromkeys(kept)
    wanted |= dict.fromkeys(step.uid for step in job.steps if step.uid is not None)
    if job.uid is not None:
        wanted[job.uid] = None
    targets = [
        ReportTarget(
            kept[uid] if uid in kept else _from_steps(job, uid, inventory(uid)),
            _about(job, uid),
        )
        for uid in wanted
    ]
    loose = [step for step in job.steps if step.uid is None and job.uid is None]
    problem = None if job.error is None else job.error.detail
    return Report(job.id, job.kind, job.state, job.created_at, job.ended_at, problem, targets, loose)


def when(at: float | None) -> str:
    """An instant for people and programs alike: 2026-05-04T10:00:00Z, "" for none."""
    return "" if at is None else datetime.fromtimestamp(at, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def took(step: Step) -> float | None:
    """How long a step took, in seconds; None when it did not end or was left out."""
    return None if step.started_at is None or step.ended_at is None else max(0.0, step.ended_at - step.started_at)


def _kept(job: RunningJob, catalog: Catalog, inventory: Callable[[Uid], StoredServo | None]) -> dict[Uid, ServoRecord]:
    """Records by uid: those in `units` of the result, and those made from `servos`, as a profile's job keeps them."""
    result = job.result or {}
    found = [records.from_document(one) for one in _listed(result.get("units"))]
    for one in _listed(result.get("servos")):
        uid = Uid(str(one["uid"]))
        found.append(_from_changes(job, one, records.remembered(uid, inventory(uid)), catalog))
    return {Uid(one.uid): one for one in found}


def _listed(entries: object) -> list[Mapping[str, Any]]:
    if not isinstance(entries, list):
        return []
    documents = [cast("Mapping[str, Any]", one) for one in cast("list[object]", entries) if isinstance(one, Mapping)]
    return [one for one in documents if isinstance(one.get("uid"), str)]


def _from_changes(job: RunningJob, entry: Mapping[str, Any], made: ServoRecord, catalog: Catalog) -> ServoRecord:
    """Record of a servo from the result of a profile's job: its changes, and whether they were saved."""
    _time(made, _about(job, Uid(made.uid)))
    profile = (job.result or {}).get("profile")
    made.profile = profile if isinstance(profile, str) else None
    model = catalog.models.get(made.model or "")
    rows: Mapping[str, Parameter] = catalog.parameters if model is None else model.rows()
    for change in _listed_changes(entry):
        key, after = str(change["key"]), change["after"]
        made.values[key] = after
        row = rows.get(key)
        if row is not None and row.unit and isinstance(after, int | float) and not isinstance(after, bool):
            made.units[key] = row.unit
    problem, outcome = entry.get("problem"), entry.get("outcome")
    if problem:
        made.verdict, made.problem = "failed", str(problem["detail"])
    elif outcome in ("applied", "planned"):
        made.verdict = "done"
    elif job.ended:
        made.verdict = "not_tried"
    if made.values:
        made.held_in = "rom" if entry.get("saved") else "ram" if outcome == "applied" else ""
    return made


def _listed_changes(entry: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    changes = entry.get("changes")
    return cast("list[Mapping[str, Any]]", changes) if isinstance(changes, list) else []


def _about(job: RunningJob, uid: Uid) -> list[Step]:
    """The steps of a job that are about one servo."""
    return [step for step in job.steps if (step.uid or job.uid) == uid]


def _time(made: ServoRecord, steps: Sequence[Step]) -> None:
    begun = [step.started_at for step in steps if step.started_at is not None]
    ended = [step.ended_at for step in steps if step.ended_at is not None]
    made.started_at, made.ended_at = min(begun, default=None), max(ended, default=None)


def _from_steps(job: RunningJob, uid: Uid, kept: StoredServo | None) -> ServoRecord:
    """Record of a servo without one in the result, from the inventory and its steps."""
    made = records.remembered(uid, kept)
    mine = _about(job, uid)
    _time(made, mine)
    failed = [step for step in mine if step.state == "failed"]
    if failed or (job.uid == uid and job.error is not None):
        made.verdict = "failed"
        made.problem = job.error.detail if job.error is not None else failed[0].evidence or f"{failed[0].text}: failed"
    elif job.ended and made.started_at is None:
        made.verdict = "not_tried"
    elif job.ended and all(step.state in ("done", "skipped") for step in mine):
        made.verdict = "done"
    return made
