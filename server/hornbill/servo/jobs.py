"""Owns Job and Jobs: things that take time, with visible steps, evidence and one ending."""

import asyncio
import secrets
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field

from hornbill.errors import HornbillError, Unknown
from hornbill.units import Uid

KEPT = 200
"""Finished jobs that stay readable; older ones are forgotten."""


@dataclass(slots=True)
class Step:
    """One step of a job. `state`: waiting, running, done, failed or skipped; times are seconds since 1970.

    `uid`: the servo it is about, in a job over several.
    """

    name: str
    text: str
    state: str = "waiting"
    evidence: str | None = None
    started_at: float | None = None
    ended_at: float | None = None
    uid: Uid | None = None


@dataclass(slots=True)
class Job:
    """`state`: queued, running, succeeded, failed or cancelled. `error` is the problem that ended it."""

    id: str
    kind: str
    uid: Uid | None
    steps: list[Step]
    created_at: float
    clock: Callable[[], float]
    on_change: Callable[["Job"], None]
    state: str = "queued"
    result: dict[str, object] | None = None
    error: HornbillError | None = None
    ended_at: float | None = None
    task: "asyncio.Task[None] | None" = field(default=None, repr=False)

    @property
    def step(self) -> str | None:
        """Name of the running step."""
        return next((step.name for step in self.steps if step.state == "running"), None)

    @property
    def progress(self) -> float:
        """Share of the steps that are behind us, 0..1."""
        behind = sum(step.state in ("done", "skipped") for step in self.steps)
        return behind / len(self.steps) if self.steps else 1.0

    @property
    def ended(self) -> bool:
        """Whether the job has come to its one ending."""
        return self.ended_at is not None

    def begin(self, name: str) -> None:
        """Start a step; the one before it must have ended."""
        step = self._find(name)
        step.state, step.started_at = "running", self.clock()
        self.on_change(self)

    def done(self, name: str, evidence: str | None = None) -> None:
        """End a step well."""
        step = self._find(name)
        step.state, step.evidence, step.ended_at = "done", evidence, self.clock()
        self.on_change(self)

    def skip(self, name: str, why: str) -> None:
        """Leave a step out, with the reason as its evidence."""
        step = self._find(name)
        step.state, step.evidence = "skipped", why
        self.on_change(self)

    def _find(self, name: str) -> Step:
        return next(step for step in self.steps if step.name == name)


class Jobs:
    """Runs jobs on the event loop and remembers how the last ones ended."""

    def __init__(self, on_change: Callable[[Job], None], clock: Callable[[], float]) -> None:
        self._on_change = on_change
        self._clock = clock
        self._jobs: dict[str, Job] = {}

    def all(self) -> list[Job]:
        """Newest last."""
        return list(self._jobs.values())

    def get(self, job_id: str) -> Job:
        """The job of that id. Raises Unknown(unknown_job)."""
        try:
            return self._jobs[job_id]
        except KeyError:
            raise Unknown("unknown_job", f"There is no job {job_id!r}.") from None

    def running(self, uid: Uid) -> Job | None:
        """The job under way on this servo."""
        return next((job for job in self._jobs.values() if job.uid == uid and not job.ended), None)

    def start(
        self,
        kind: str,
        uid: Uid | None,
        steps: list[Step],
        work: Callable[[Job], Awaitable[dict[str, object]]],
    ) -> Job:
        """Run `work(job)`; what it answers is the result, a HornbillError it raises is the job's error."""
        job = Job(
            id=secrets.token_hex(8), kind=kind, uid=uid, steps=steps, created_at=self._clock(),
            clock=self._clock, on_change=self._on_change,
        )  # fmt: skip
        self._jobs[job.id] = job
        for old in [known.id for known in self._jobs.values() if known.ended][:-KEPT]:
            del self._jobs[old]
        job.task = asyncio.get_running_loop().create_task(self._run(job, work))
        return job

    async def _run(self, job: Job, work: Callable[[Job], Awaitable[dict[str, object]]]) -> None:
        job.state = "running"
        self._on_change(job)
        try:
            job.result = await work(job)
            job.state = "succeeded"
        except asyncio.CancelledError:
            job.state = "cancelled"
        except HornbillError as error:
            job.state, job.error = "failed", error
        except Exception as error:  # a defect of ours must end the job visibly, not leave it running for ever
            job.state, job.error = "failed", HornbillError(f"hornbill itself failed: {error!r}. Report this.")
        finally:
            job.ended_at = self._clock()
            for step in job.steps:
                if step.state == "running":
                    step.state, step.ended_at = "failed", job.ended_at
            self._on_change(job)

    async def wait(self, job: Job) -> Job:
        """Answer when the job has ended, however it ended."""
        if job.task is not None:
            await asyncio.wait([job.task])
        return job

    async def cancel(self, job_id: str) -> Job:
        """Cancel a job that is under way; one that has ended stays as it is."""
        job = self.get(job_id)
        if job.task is not None and not job.ended:
            job.task.cancel()
            await asyncio.wait([job.task])
        return job

    async def close(self) -> None:
        """Cancel everything under way."""
        for job in self.all():
            await self.cancel(job.id)
