"""Loop over targets and steps, shared by all operations on many servos."""

import asyncio
from collections.abc import Awaitable, Callable, Iterable, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import ClassVar, Generic, Literal, Self, TypeAlias, TypeVar

from hornbill.domain.change import Change, SavePreview
from hornbill.errors import Cause, HornbillError, Interrupted, UnexpectedResult, Unknown
from hornbill.servo.configuration.record import ServoRecord
from hornbill.servo.configuration.writing import Outcome
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.shielded import shielded
from hornbill.servo.runtime.steps import Evidence, Step
from hornbill.units import Uid

OnAnomaly: TypeAlias = Literal["stop", "continue"]
"""Action after the first servo that failed."""


class NotNeeded(Exception):
    """A step has nothing to do. `why`: the reason, as evidence."""

    def __init__(self, why: Evidence) -> None:
        super().__init__(why.text)
        self.why = why


@dataclass(slots=True, kw_only=True)
class RunTarget:
    """One servo of a run, with its record. `place`: number from 1, part of its step names. `problem`: its failure."""

    record: ServoRecord
    place: int
    problem: HornbillError | None = None

    @property
    def uid(self) -> Uid:
        """Unique ID of the servo."""
        return self.record.uid

    @property
    def title(self) -> str:
        """Title of the servo, even if it is offline."""
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
        """The target in the result of a job, as JSON: its record, and fields of its kind of run."""
        return self.record.document()

    def step(self, kind: str, text: str) -> Step:
        """A step of the job for this servo."""
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
    """An operation on many servos: targets, and the loop over the steps that each kind of run supplies.

    A HornbillError of a step becomes the problem of its target. Only errors in `ENDS` leave the step.
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
        """Whether a problem ends the run."""
        return self.on_anomaly == "stop" and bool(self.failed)

    async def each(self, items: Iterable[Item], do: "Callable[[Self, Item], Awaitable[object]]") -> None:
        """Call `do` for each item in turn, until a problem stops the run."""
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
        """Run the same step of many targets concurrently."""
        await asyncio.gather(*(self.step(target, kind, do, whole=whole) for target in targets))

    async def step(
        self, target: T, kind: str, do: "Callable[[Self, T], Awaitable[Evidence | None]]", *, whole: bool = False
    ) -> bool:
        """Run one step and record its outcome. `do` returns the evidence. Returns whether the step succeeded.

        `whole`: the step is completed even if the run is cancelled.
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

    # Progress of a step. A run without a job does not show it.

    def _began(self, name: str) -> None: ...

    def _done(self, name: str, evidence: Evidence | None) -> None: ...

    def _failed(self, name: str, why: Evidence) -> None: ...

    def _skipped(self, name: str, why: Evidence) -> None: ...


@dataclass(slots=True, kw_only=True)
class FleetJob(FleetRun[T]):
    """A run shown by a job, with its records as the job's result."""

    FAILED: ClassVar[str] = "servos failed"
    """End of the sentence that counts the targets with a problem."""
    ALSO: ClassVar[Cause] = "some_servos_failed"
    """Code of that sentence; its values are `failed`, `targets` and `titles`."""

    SHOWS_RESULT: ClassVar[bool] = False
    """Whether the job's result is updated after each step, not only at the end."""

    job: RunningJob

    def result(self) -> dict[str, object]:
        """The present result: `servos`, one entry each in the given order."""
        return {"servos": [target.shown() for target in self.targets], **self.facts()}

    def facts(self) -> dict[str, object]:
        """Further fields of the result, by kind of run."""
        return {}

    def close(self) -> None:
        """Complete the records when the run is over."""
        for target in self.targets:
            steps = [step for step in self.job.steps if step.uid == target.uid]
            begun = [step.started_at for step in steps if step.started_at is not None]
            ended = [step.ended_at for step in steps if step.ended_at is not None]
            target.record.started_at, target.record.ended_at = min(begun, default=None), max(ended, default=None)
            target.close()

    def update_result(self) -> None:
        """Update the result of the job. It is stored with the next change of a step."""
        self.job.result = self.result()

    async def work(self, execute: Awaitable[None]) -> dict[str, object]:
        """Run `execute` and return the result. The job has the result in any case. Raises a target's first problem."""
        try:
            await execute
        finally:  # also if cancelled: the result lists the writes
            self.close()
            self.update_result()
        self._raise_first()
        return self.result()

    def skip(self, target: T, why: Evidence) -> None:
        """Skip the steps of a target that have not begun."""
        for step in self.job.steps:
            if step.uid == target.uid and step.state == "waiting":
                self.job.skip(step.name, why)

    def skip_all(self, why: Evidence) -> None:
        """Skip the steps of all targets that have not begun."""
        for target in self.targets:
            self.skip(target, why)

    def summary(self, failed: Sequence[T]) -> str:
        """Sentence that precedes the first problem."""
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
            self.update_result()

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


SAVED = Evidence("saved", "saved to ROM, read back after the restart")


def rows_written(written: int, of: int) -> Evidence:
    """Evidence of a step that wrote rows and read them back."""
    text = f"{written} rows written and read back, {of - written} unchanged"
    return Evidence("written", text, {"rows": written, "unchanged": of - written})


def check_outcome(title: str, outcome: Outcome) -> None:
    """Raises the failure of a change, or UnexpectedResult for values that the servo clamped."""
    if outcome.failure is not None:
        raise outcome.failure
    clamped = [one for one in outcome.changes if one.verdict == "clamped"]
    if clamped:
        listed = ", ".join(f"{one.key} {one.requested} → {one.after}" for one in clamped)
        raise UnexpectedResult(
            f"{title} changed written values: {listed}.",
            differences=[{"key": one.key, "wanted": one.requested, "found": one.after} for one in clamped],
            cause="values_differ",
            servo=title,
            keys=[one.key for one in clamped],
        )
