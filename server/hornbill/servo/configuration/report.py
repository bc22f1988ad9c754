"""Owns Report: what a job did, servo by servo, from what the job itself keeps."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, cast

from hornbill.schema.catalog import Catalog
from hornbill.schema.parameter import Parameter
from hornbill.servo.configuration import sheet as sheets
from hornbill.servo.configuration.sheet import Sheet
from hornbill.servo.jobs import Job
from hornbill.servo.steps import Step
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
VERDICT_WORDS = {"waiting": "Not finished", "done": "Done", "failed": "Failed", "not_tried": "Not tried"}


@dataclass(frozen=True, slots=True)
class Unit:
    """One servo of the job, and the steps that were about it."""

    sheet: Sheet
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
    units: Sequence[Unit]
    steps: Sequence[Step]

    @property
    def title(self) -> str:
        """What to print at the top."""
        return KIND_TITLES.get(self.kind, self.kind.replace("_", " ").capitalize())

    @property
    def filename(self) -> str:
        """A file name without its ending."""
        day = datetime.fromtimestamp(self.created_at, UTC).strftime("%Y%m%d")
        return f"hornbill-{self.kind.replace('_', '-')}-{day}-{self.job_id[:8]}"

    def count(self, verdict: str) -> int:
        """How many servos have this verdict."""
        return sum(unit.sheet.verdict == verdict for unit in self.units)


def report(job: Job, inventory: Callable[[Uid], StoredServo | None], catalog: Catalog) -> Report:
    """The report of a job, under way or ended; `inventory` knows servos of which the job kept no sheet."""
    kept = _kept(job, catalog, inventory)
    wanted: dict[Uid, None] = dict.fromkeys(kept)
    wanted |= dict.fromkeys(step.uid for step in job.steps if step.uid is not None)
    if job.uid is not None:
        wanted[job.uid] = None
    units = [
        Unit(
            kept[uid] if uid in kept else _from_steps(job, uid, inventory(uid)),
            _about(job, uid),
        )
        for uid in wanted
    ]
    loose = [step for step in job.steps if step.uid is None and job.uid is None]
    problem = None if job.error is None else job.error.detail
    return Report(job.id, job.kind, job.state, job.created_at, job.ended_at, problem, units, loose)


def when(at: float | None) -> str:
    """An instant for people and programs alike: 2026-05-04T10:00:00Z, "" for none."""
    return "" if at is None else datetime.fromtimestamp(at, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def took(step: Step) -> float | None:
    """How long a step took, in seconds; None when it did not end or was left out."""
    return None if step.started_at is None or step.ended_at is None else max(0.0, step.ended_at - step.started_at)


def _kept(job: Job, catalog: Catalog, inventory: Callable[[Uid], StoredServo | None]) -> dict[Uid, Sheet]:
    """Sheets by uid: those in `units` of the result, and those made from `servos`, as a profile's job keeps them."""
    result = job.result or {}
    found = [sheets.from_document(one) for one in _listed(result.get("units"))]
    for one in _listed(result.get("servos")):
        uid = Uid(str(one["uid"]))
        found.append(_from_changes(job, one, sheets.remembered(uid, inventory(uid)), catalog))
    return {Uid(one.uid): one for one in found}


def _listed(entries: object) -> list[Mapping[str, Any]]:
    if not isinstance(entries, list):
        return []
    documents = [cast("Mapping[str, Any]", one) for one in cast("list[object]", entries) if isinstance(one, Mapping)]
    return [one for one in documents if isinstance(one.get("uid"), str)]


def _from_changes(job: Job, entry: Mapping[str, Any], made: Sheet, catalog: Catalog) -> Sheet:
    """A sheet from what a profile's job keeps of one servo: what each change left behind, and whether it was saved."""
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


def _about(job: Job, uid: Uid) -> list[Step]:
    """The steps of a job that are about one servo."""
    return [step for step in job.steps if (step.uid or job.uid) == uid]


def _time(made: Sheet, steps: Sequence[Step]) -> None:
    begun = [step.started_at for step in steps if step.started_at is not None]
    ended = [step.ended_at for step in steps if step.ended_at is not None]
    made.started_at, made.ended_at = min(begun, default=None), max(ended, default=None)


def _from_steps(job: Job, uid: Uid, kept: StoredServo | None) -> Sheet:
    """A sheet for a servo the job kept none of: who the inventory says it is, and what its steps say."""
    made = sheets.remembered(uid, kept)
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
