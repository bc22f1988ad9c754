"""One operation on many servos: the loop over targets and steps that every kind of run shares."""

import asyncio
from collections.abc import Awaitable, Callable, Iterable, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import ClassVar, Generic, Literal, Self, TypeAlias, TypeVar

from hornbill.domain.change import Change, SavePreview
from hornbill.errors import Cause, HornbillError, Interrupted, NotAsWanted, Unknown
from hornbill.servo.configuration.record import ServoRecord
from hornbill.servo.configuration.writing import Outcome
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.shielded import shielded
from hornbill.servo.runtime.steps import Evidence, Step
from hornbill.units import Uid

OnAnomaly: TypeAlias = Literal["stop", "continue"]
"""What follows the first servo that failed."""


class NotNeeded(Exception):
    """A step has nothing to do. `why`: the reason, as evidence."""

    def __init__(self, why: Evidence) -> None:
        super().__init__(why.text)
        self.why = why


@dataclass(slots=True, kw_only=True)
class RunTarget:
    """One servo of a run, and the record of it. `place` counts from 1 and is part of the names of its steps; `problem`
    is why it failed.
    """

    record: ServoRecord
    place: int
    problem: HornbillError | None = None

    @property
    def uid(self) -> Uid:
        """Unique ID of the servo."""
        return self.record.uid

    @property
    def title(self) -> str:
        """Title of the servo, also of one that is absent."""
        return self.record.title or f"servo {self.uid[:8]}"

    def fail(self, problem: HornbillError) -> None:
        """Record the problem of a step."""
        self.problem = problem
        self.record.fail(problem)

    def close(self) -> None:
        """Complete the record when the run is over."""
        if self.record.verdict == "waiting":
            self.record.verdict = "not_tried"

    def shown(self) -> dict[str, object]:
        """The target in the result of a job, as JSON: its record, and what else its kind of run tells of it."""
        return self.record.document()

    def step(self, kind: str, text: str) -> Step:
        """A step of the job that is about this servo."""
        return Step(self.step_name(kind), f"{self.title}: {text}", uid=self.uid, params={"servo": self.title})

    def step_name(self, kind: str) -> str:
        """Name of its step of this kind."""
        return f"{kind} {self.place}"


@dataclass(slots=True, kw_only=True)
class WrittenTarget(RunTarget):
    """A servo whose rows a run writes. `outcome`: not_tried, planned, rejected, applied or rolled_back."""

    outcome: str = "not_tried"
    changes: list[Change] = field(default_factory=list[Change])
    plan: SavePreview | None = None

    def fail(self, problem: HornbillError) -> None:
        """Record the problem of a step. The servo is rejected if nothing was written yet."""
        RunTarget.fail(self, problem)
        if self.outcome in ("not_tried", "planned"):
            self.outcome, self.changes, self.plan = "rejected", [], None


T = TypeVar("T", bound=RunTarget)
Item = TypeVar("Item")


@dataclass(slots=True, kw_only=True)
class FleetRun(Generic[T]):
    """One operation on many servos: its targets, and the loop over the steps that each kind of run supplies.

    A HornbillError of a step is that target's problem and never leaves the step, unless it is one of `ENDS`.
    """

    ENDS: ClassVar[tuple[type[HornbillError], ...]] = ()
    """Problems that concern every servo, and end the run."""

    targets: Sequence[T]
    on_anomaly: OnAnomaly = "continue"

    @property
    def failed(self) -> list[T]:
        """The targets with a problem."""
        return [target for target in self.targets if target.problem is not None]

    @property
    def stopped(self) -> bool:
        """Whether a problem ends it here."""
        return self.on_anomaly == "stop" and bool(self.failed)

    async def each(self, items: Iterable[Item], do: "Callable[[Self, Item], Awaitable[object]]") -> None:
        """Do it for one item after the other, up to the first problem where that stops the run."""
        for item in items:
            if self.stopped:
                return
            await do(self, item)

    async def together(
        self,
        targets: Iterable[T],
        kind: str,
        do: "Callable[[Self, T], Awaitable[Evidence | None]]",
        *,
        whole: bool = False,
    ) -> None:
        """Do the same step of many targets at once."""
        await asyncio.gather(*(self.step(target, kind, do, whole=whole) for target in targets))

    async def step(
        self, target: T, kind: str, do: "Callable[[Self, T], Awaitable[Evidence | None]]", *, whole: bool = False
    ) -> bool:
        """Do one step and record its outcome; whether it succeeded. What `do` returns is the evidence.

        `whole`: it comes to its end although the run is cancelled meanwhile.
        """
        if whole:
            return await shielded(self.step(target, kind, do))
        name = target.step_name(kind)
        self._began(name)
        try:
            evidence = await do(self, target)
        except NotNeeded as reason:
            self._skipped(name, reason.why)
            return True
        except HornbillError as problem:
            target.fail(problem)
            if isinstance(problem, self.ENDS):
                raise
            self._failed(name, Evidence.of(problem))
            return False
        self._done(name, evidence)
        return True

    # Progress of a step. A run without a job has none to show.

    def _began(self, name: str) -> None: ...

    def _done(self, name: str, evidence: Evidence | None) -> None: ...

    def _failed(self, name: str, why: Evidence) -> None: ...

    def _skipped(self, name: str, why: Evidence) -> None: ...


@dataclass(slots=True, kw_only=True)
class FleetJob(FleetRun[T]):
    """A run that a job shows, with the record of it as the job's result."""

    FAILED: ClassVar[str] = "servos failed"
    """End of the sentence that counts the targets with a problem."""
    ALSO: ClassVar[Cause] = "of_servos"
    """Code of that sentence; its values are `failed`, `targets` and `titles`."""

    SHOWS_RESULT: ClassVar[bool] = False
    """Whether the job has a result after each step, not at its end only."""

    job: RunningJob

    def result(self) -> dict[str, object]:
        """The result of the job as of now: `servos`, one entry each in the order given."""
        return {"servos": [target.shown() for target in self.targets], **self.facts()}

    def facts(self) -> dict[str, object]:
        """What its kind of run tells besides."""
        return {}

    def close(self) -> None:
        """Complete the records when the run is over."""
        for target in self.targets:
            steps = [step for step in self.job.steps if step.uid == target.uid]
            begun = [step.started_at for step in steps if step.started_at is not None]
            ended = [step.ended_at for step in steps if step.ended_at is not None]
            target.record.started_at, target.record.ended_at = min(begun, default=None), max(ended, default=None)
            target.close()

    def tell(self) -> None:
        """Update the result of the job. It is stored with the next change of a step."""
        self.job.result = self.result()

    async def work(self, execute: Awaitable[None]) -> dict[str, object]:
        """Do it and return the result, which the job has whatever the end. Raises the first problem of a target."""
        try:
            await execute
        finally:  # also if cancelled: the result names what was written
            self.close()
            self.tell()
        self._raise_first()
        return self.result()

    def skip(self, target: T, why: Evidence) -> None:
        """Skip the steps of a target that have not begun."""
        for step in self.job.steps:
            if step.uid == target.uid and step.state == "waiting":
                self.job.skip(step.name, why)

    def skip_all(self, why: Evidence) -> None:
        """Skip every step of any target that has not begun."""
        for target in self.targets:
            self.skip(target, why)

    def summary(self, failed: Sequence[T]) -> str:
        """Sentence before the detail of the first problem."""
        return f"{len(failed)} of {len(self.targets)} {self.FAILED}. " if len(self.targets) > 1 else ""

    def _began(self, name: str) -> None:
        self.job.begin(name)

    def _done(self, name: str, evidence: Evidence | None) -> None:
        self._show()
        self.job.done(name, evidence)

    def _failed(self, name: str, why: Evidence) -> None:
        self._show()
        self.job.fail(name, why)

    def _skipped(self, name: str, why: Evidence) -> None:
        self.job.skip(name, why)

    def _show(self) -> None:
        if self.SHOWS_RESULT:
            self.tell()

    def _raise_first(self) -> None:
        failed = self.failed
        if not failed:
            return
        first = failed[0].problem
        assert first is not None
        uids = [one.uid for one in failed]
        error = (
            HornbillError(first.detail, **{"cause": None, **first.facts})
            if isinstance(first, Unknown | Interrupted)
            else copy(first)
        )
        error.facts = {**first.facts, "uid": uids[0], "uids": uids}
        if summary := self.summary(failed):
            error.extend(
                before=summary, also=self.ALSO, failed=len(failed), targets=len(self.targets),
                titles=[one.title for one in failed],
            )  # fmt: skip
        raise error


SAVED = Evidence("saved", "in ROM, read back after the restart")


def rows_written(written: int, of: int) -> Evidence:
    """Evidence of a step that wrote rows and read them back."""
    text = f"{written} rows written and read back, {of - written} as they were"
    return Evidence("written", text, {"rows": written, "unchanged": of - written})


def check_outcome(title: str, outcome: Outcome) -> None:
    """Raises the failure of a change, or NotAsWanted for values that the servo clamped."""
    if outcome.failure is not None:
        raise outcome.failure
    clamped = [one for one in outcome.changes if one.verdict == "clamped"]
    if clamped:
        listed = ", ".join(f"{one.key} {one.requested} → {one.after}" for one in clamped)
        raise NotAsWanted(
            f"{title} holds other values than those written: {listed}.",
            differences=[{"key": one.key, "wanted": one.requested, "found": one.after} for one in clamped],
            cause="holds_something_else",
            servo=title,
            keys=[one.key for one in clamped],
        )
