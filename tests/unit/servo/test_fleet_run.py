"""Runs over many servos: failed and skipped servos, and what a cancelled run still completes."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping

import pytest

import jumping_clock as clock
from hornbill.errors import Busy, NoResponse, Stopped
from hornbill.servo.configuration.record import ServoRecord, of_result
from hornbill.servo.runs.fleet_run import FleetJob, NotNeeded, OnAnomaly, RunTarget
from hornbill.servo.runtime.jobs import Jobs, RunningJob
from hornbill.servo.runtime.steps import Evidence
from hornbill.store.store import Store
from hornbill.units import Uid

A, B, C = UIDS = [Uid(letter * 32) for letter in "abc"]
DONE = Evidence("read_back", "done")
LEFT_OUT = Evidence("job_ended", "left out")


class Run(FleetJob[RunTarget]):
    """A run whose only step ends as `outcomes` says for its servo."""

    ENDS = (Stopped,)
    outcomes: Mapping[Uid, Exception]

    async def act(self, target: RunTarget) -> Evidence:
        await asyncio.sleep(1)
        if target.uid in self.outcomes:
            raise self.outcomes[target.uid]
        return DONE

    async def execute(self, *, whole: bool = False) -> None:
        async def one(run: Run, target: RunTarget) -> None:
            await run.step(target, "do", Run.act, whole=whole)

        await self.each(self.targets, one)
        self.skip_all(LEFT_OUT)


def play(
    outcomes: Mapping[Uid, Exception],
    on_anomaly: OnAnomaly = "continue",
    *,
    whole: bool = False,
    then: Callable[[Jobs, RunningJob], Awaitable[object]] | None = None,
) -> RunningJob:
    """The job of a run over three servos, when it has ended."""

    async def inside() -> RunningJob:
        with Store("sqlite://") as store:
            jobs = Jobs(lambda job: None, asyncio.get_running_loop().time, store.jobs)
            targets = [RunTarget(record=ServoRecord(uid), place=place) for place, uid in enumerate(UIDS, start=1)]

            async def work(job: RunningJob) -> dict[str, object]:
                run = Run(job=job, targets=targets, on_anomaly=on_anomaly)
                run.outcomes = outcomes
                return await run.work(run.execute(whole=whole))

            job = jobs.start("profile", None, [target.step("do", "Done") for target in targets], work)
            if then is not None:
                await then(jobs, job)
            return await jobs.wait(job)

    return clock.run(inside())


def states(job: RunningJob) -> list[str]:
    return [step.state for step in job.steps]


def verdicts(job: RunningJob) -> list[str]:
    return [one.verdict for one in of_result(job.result).values()]


def test_a_problem_fails_its_servo_and_the_first_one_the_job() -> None:
    job = play({A: NoResponse("silent", cause=None), C: Busy("saving", cause=None, seconds=3)})
    assert states(job) == ["failed", "done", "failed"]
    assert isinstance(job.error, NoResponse)
    assert job.error.detail == "2 of 3 servos failed. silent"
    assert job.error.facts == {
        "uid": A, "uids": [A, C], "also": ["some_servos_failed"], "failed": 2, "targets": 3,
        "titles": ["servo aaaaaaaa", "servo cccccccc"],
    }  # fmt: skip
    assert verdicts(job) == ["failed", "not_tried", "failed"]


def test_with_stop_the_first_problem_skips_the_rest() -> None:
    job = play({B: NoResponse("silent", cause=None)}, "stop")
    assert states(job) == ["done", "failed", "skipped"]
    assert job.steps[2].evidence == "left out"


def test_a_problem_of_all_servos_ends_the_run() -> None:
    job = play({B: Stopped("stop was pressed", cause=None)})
    assert states(job) == ["done", "failed", "waiting"]
    assert isinstance(job.error, Stopped)
    assert job.error.detail == "stop was pressed"
    assert verdicts(job) == ["not_tried", "failed", "not_tried"]


def test_a_step_with_nothing_to_do_is_skipped() -> None:
    job = play({B: NotNeeded(Evidence("save_not_needed", "nothing to do"))}, "stop")
    assert states(job) == ["done", "skipped", "done"]
    assert (job.state, job.steps[1].evidence) == ("succeeded", "nothing to do")


@pytest.mark.parametrize(("whole", "expected"), [(True, "done"), (False, "failed")])
def test_a_cancelled_run_completes_an_indivisible_step(whole: bool, expected: str) -> None:
    async def cancel(jobs: Jobs, job: RunningJob) -> None:
        await asyncio.sleep(1.5)
        await jobs.cancel(job.id)

    job = play({A: NoResponse("silent", cause=None)}, whole=whole, then=cancel)
    assert states(job) == ["failed", expected, "waiting"]
    assert (job.state, verdicts(job)) == ("cancelled", ["failed", "not_tried", "not_tried"])
    assert [one.ended_at is None for one in of_result(job.result).values()] == [False, not whole, True]
