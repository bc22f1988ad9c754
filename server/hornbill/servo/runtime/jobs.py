"""Jobs: long-running work with visible steps, evidence and one result, stored across restarts of the server."""

import asyncio
import logging
import secrets
from collections.abc import Awaitable, Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from hornbill.errors import Busy, HornbillError, Interrupted, Unknown
from hornbill.servo.runtime import steps as document
from hornbill.servo.runtime.steps import Evidence, Step
from hornbill.store.jobs import MAX_ROWS, StoredJob, StoredJobs
from hornbill.store.tables import Json
from hornbill.units import Uid

log = logging.getLogger(__name__)

OUTCOME_UNKNOWN = "the server exited during this step, so its outcome is unknown"
"""Evidence of a step that was running when the server exited."""

Work: TypeAlias = "Callable[[RunningJob], Awaitable[dict[str, object]]]"
Resumer: TypeAlias = "Callable[[RunningJob], Work]"


@dataclass(slots=True)
class RunningJob:
    """`state`: queued, running, succeeded, failed or cancelled. `error` is the problem that ended it.

    `request` is what another process needs to resume it, None if it cannot be resumed. `lease_id` is the lease of the
    client that resumed it; it is not stored.
    """

    id: str
    kind: str
    uid: Uid | None
    steps: list[Step]
    created_at: float
    clock: Callable[[], float]
    on_change: Callable[["RunningJob"], None]
    state: str = "queued"
    result: dict[str, object] | None = None
    error: HornbillError | None = None
    ended_at: float | None = None
    request: Mapping[str, Json] | None = None
    lease_id: str | None = field(default=None, repr=False)
    resumers: Mapping[str, Resumer] = field(default_factory=dict[str, Resumer], repr=False)
    task: "asyncio.Task[None] | None" = field(default=None, repr=False)

    @property
    def uids(self) -> frozenset[Uid]:
        """Servos of the job. Empty if it concerns none."""
        return frozenset(uid for uid in (self.uid, *(step.uid for step in self.steps)) if uid is not None)

    @property
    def step(self) -> str | None:
        """Name of the running step."""
        return next((step.name for step in self.steps if step.state == "running"), None)

    @property
    def progress(self) -> float:
        """Share of completed or skipped steps, 0..1, or of repeated steps the `progress` in the result."""
        reported = (self.result or {}).get("progress")
        if isinstance(reported, int | float):
            return reported
        completed = sum(step.state in ("done", "skipped") for step in self.steps)
        return completed / len(self.steps) if self.steps else 1.0

    @property
    def ended(self) -> bool:
        """Whether the job has ended, with any outcome."""
        return self.ended_at is not None

    @property
    def resumable(self) -> bool:
        """Whether `Jobs.resume` can continue it."""
        return self.state in ("failed", "cancelled") and self.request is not None and self.kind in self.resumers

    def begin(self, name: str) -> None:
        """Start a step. The previous step must have ended."""
        step = self._find(name)
        step.state, step.started_at = "running", self.clock()
        self.on_change(self)

    def done(self, name: str, evidence: Evidence | None = None) -> None:
        """Complete a step."""
        step = self._find(name)
        step.state, step.ended_at = "done", self.clock()
        step.observe(evidence)
        self.on_change(self)

    def fail(self, name: str, why: Evidence) -> None:
        """End a step as failed while the job continues."""
        step = self._find(name)
        step.state, step.ended_at = "failed", self.clock()
        step.observe(why)
        self.on_change(self)

    def skip(self, name: str, why: Evidence) -> None:
        """Skip a step, with the reason as its evidence."""
        step = self._find(name)
        step.state = "skipped"
        step.observe(why)
        self.on_change(self)

    def _find(self, name: str) -> Step:
        return next(step for step in self.steps if step.name == name)


class Jobs:
    """Runs jobs on the event loop. Their progress is stored after every step; a store failure does not stop a job."""

    def __init__(
        self,
        on_change: Callable[[RunningJob], None],
        clock: Callable[[], float],
        stored: StoredJobs,
        resumers: Mapping[str, Resumer] | None = None,
    ) -> None:
        """`clock` returns seconds since 1970 (UTC). Unfinished jobs of the previous server fail now and do not resume.

        `resumers`, by kind: creates the work that resumes a job, from its request and the states of its steps. It may
        refuse with a HornbillError before anything has changed. The work must check on the servo what a "waiting" step
        may already have done.
        """
        self._on_change = on_change
        self._clock = clock
        self._stored = stored
        self._store_works = True
        self._closing = False
        self.resumers = dict(resumers or {})
        self._jobs: dict[str, RunningJob] = {}
        self._restore()

    def all(self) -> list[RunningJob]:
        """All jobs, newest last."""
        return list(self._jobs.values())

    def get(self, job_id: str) -> RunningJob:
        """The job with this ID. Raises Unknown(unknown_job)."""
        try:
            return self._jobs[job_id]
        except KeyError:
            raise Unknown("unknown_job", f"There is no job {job_id!r}.", cause="job_not_found", job=job_id) from None

    def running(self, uid: Uid) -> RunningJob | None:
        """The running job on this servo, if any."""
        return next((job for job in self._jobs.values() if job.uid == uid and not job.ended), None)

    def check_apart(self, uids: Collection[Uid]) -> None:
        """Raises Busy while a job on several servos, one of these among them, is running."""
        for job in self._jobs.values():
            both = next((step.uid for step in job.steps if step.uid is not None and step.uid in uids), None)
            if both is not None and not job.ended:
                raise Busy(
                    f"A {job.kind} job that includes servo {both[:8]} is running. Wait until it ends.",
                    job=job.id,
                    cause="job_running",
                    kind=job.kind,
                )

    def start(
        self, kind: str, uid: Uid | None, steps: list[Step], work: Work, request: Mapping[str, Json] | None = None
    ) -> RunningJob:
        """Run `work(job)`. Its return value is the job's result; a HornbillError it raises is the job's error.

        With a `request` it can be resumed, also by another process, if its kind has a resumer.
        """
        job = RunningJob(
            id=secrets.token_hex(8), kind=kind, uid=uid, steps=steps, created_at=self._clock(),
            clock=self._clock, on_change=self._changed, request=request, resumers=self.resumers,
        )  # fmt: skip
        self._jobs[job.id] = job
        for old in [known.id for known in self._jobs.values() if known.ended][:-MAX_ROWS]:
            del self._jobs[old]
        self._store(job)
        job.task = asyncio.get_running_loop().create_task(self._run(job, work))
        return job

    def resume(self, job_id: str, lease_id: str | None = None) -> RunningJob:
        """Resume a job that failed, was cancelled or was interrupted. Completed steps are not repeated.

        Steps that are neither done nor skipped become "waiting". `lease_id` is for the work to use. Raises Unknown
        (unknown_job), Busy if it cannot be resumed (now), and whatever its resumer raises.
        """
        job = self.get(job_id)
        if not job.resumable:
            raise Busy(
                f"The {job.kind} job {job.id} cannot be resumed: {_why_not(job)}",
                job=job.id,
                state=job.state,
                cause="not_resumable",
                kind=job.kind,
            )
        other = None if job.uid is None else self.running(job.uid)
        if other is not None:
            raise Busy(
                f"A {other.kind} job is running on this servo. Wait until it ends, then resume.",
                job=other.id,
                cause="job_running",
                kind=other.kind,
            )
        before, job.lease_id = job.lease_id, lease_id
        try:
            work = self.resumers[job.kind](job)
        except BaseException:
            job.lease_id = before
            raise
        job.state, job.result, job.error, job.ended_at = "queued", None, None, None
        for step in job.steps:
            if step.state not in ("done", "skipped"):
                step.state, step.started_at, step.ended_at = "waiting", None, None
                step.observe(None)
        job.task = asyncio.get_running_loop().create_task(self._run(job, work))
        self._changed(job)
        return job

    async def _run(self, job: RunningJob, work: Work) -> None:
        job.state = "running"
        self._changed(job)
        try:
            job.result = await work(job)
            job.state = "succeeded"
        except asyncio.CancelledError:
            self._on_cancelled(job)
        except HornbillError as error:
            job.state, job.error = "failed", error
        except Exception as error:  # a bug must end the job visibly, not leave it running forever
            log.exception("the %s job %s failed", job.kind, job.id)
            text = f"Internal error in hornbill: {error!r}. Report it."
            job.state, job.error = "failed", HornbillError(text, cause="internal_error", error=repr(error))
        finally:
            self._end(job)

    async def wait(self, job: RunningJob, within_s: float | None = None) -> RunningJob:
        """Wait until the job has ended, with any outcome, or at most `within_s`."""
        if job.task is not None:
            await asyncio.wait([job.task], timeout=within_s)
        return job

    async def succeeded(self, child: RunningJob, cancelled: HornbillError) -> None:
        """Wait for a job that is part of another. Raises its error, or `cancelled` if it was cancelled."""
        await self.wait(child)
        if child.error is not None:
            raise child.error
        if child.state != "succeeded":
            raise cancelled

    async def cancel(self, job_id: str) -> RunningJob:
        """Cancel a running job. A job that has ended does not change."""
        job = self.get(job_id)
        if job.task is not None and not job.ended:
            if job.state == "queued":  # resources reserved for it at its start are released only by its work
                await asyncio.sleep(0)
            job.task.cancel()
            await asyncio.wait([job.task])
        return job

    async def close(self) -> None:
        """End all running jobs. No client cancelled them, so they fail as Interrupted."""
        self._closing = True
        for job in self.all():
            await self.cancel(job.id)

    def _on_cancelled(self, job: RunningJob) -> None:
        if self._closing:
            job.state, job.error = "failed", _interrupted(job)
        else:
            job.state = "cancelled"

    def _end(self, job: RunningJob) -> None:
        job.ended_at = self._clock()
        for step in job.steps:
            if step.state == "running":
                step.state, step.ended_at = "failed", job.ended_at
                if isinstance(job.error, Interrupted):
                    step.observe(Evidence("interrupted", OUTCOME_UNKNOWN))
        self._changed(job)

    def _changed(self, job: RunningJob) -> None:
        self._store(job)
        self._on_change(job)

    def _store(self, job: RunningJob) -> None:
        try:
            self._stored.put(
                StoredJob(
                    job.id, job.kind, job.uid, job.state, job.created_at, job.ended_at, job.request,
                    document.write(job.steps, job.result, job.error),
                )
            )  # fmt: skip
            self._store_works = True
        except Exception:  # a full disk must not interrupt a save
            if self._store_works:
                self._store_works = False
                log.exception("jobs cannot be stored; the %s job %s continues", job.kind, job.id)

    def _restore(self) -> None:
        for one in self._stored.all():
            try:
                steps, result, error = document.read(one.document)
            except Exception:  # an unreadable row must not prevent the server from starting
                log.exception("the stored %s job %s cannot be read", one.kind, one.id)
                continue
            job = RunningJob(
                one.id, one.kind, one.uid, steps, one.created_at, self._clock, self._changed, one.state, result, error,
                one.ended_at, one.request, resumers=self.resumers,
            )  # fmt: skip
            self._jobs[job.id] = job
            if not job.ended:
                _begin_next(job)
                job.state, job.error = "failed", _interrupted(job)
                self._end(job)


def _begin_next(job: RunningJob) -> None:
    """Treat the step after the last completed one as started: its start may not have reached the database."""
    if job.state == "running" and all(step.state != "running" for step in job.steps):
        step = next((one for one in job.steps if one.state == "waiting"), None)
        if step is not None:
            step.state = "running"


def _interrupted(job: RunningJob) -> Interrupted:
    """The error of a job interrupted by the server's exit. Makes no claim about the step it was in."""
    done = [_titled(step) for step in job.steps if step.state in ("done", "skipped")]
    begun = [_titled(step) for step in job.steps if step.state == "running"]
    text = f"The server exited while this job was running. Completed: {', '.join(done) or 'no step'}. "
    if begun:
        text += f"Started, outcome unknown: {', '.join(begun)}. "
    return Interrupted(text + "The remaining steps were not started.", cause="server_exited")


def _titled(step: Step) -> str:
    return step.text if step.uid is None else f"{step.text} ({step.uid[:8]}…)"


def _why_not(job: RunningJob) -> str:
    if not job.ended:
        return "it is running."
    if job.state == "succeeded":
        return "it succeeded."
    return "start a new job instead."
