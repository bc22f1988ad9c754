"""The error of a run in which servos failed. Its other ends are tested in tests/behaviour/test_profiles.py and
test_commissioning.py.
"""

import asyncio
from collections.abc import Mapping

from hornbill.errors import Busy, HornbillError, NoResponse, Stopped
from hornbill.servo.configuration.record import ServoRecord, of_result
from hornbill.servo.runs.fleet_run import FleetJob, RunTarget
from hornbill.servo.runtime.jobs import Jobs, RunningJob
from hornbill.servo.runtime.steps import Evidence
from hornbill.store.store import Store
from hornbill.units import Uid

A, B, C = UIDS = [Uid(letter * 32) for letter in "abc"]


class Run(FleetJob[RunTarget]):
    """A run whose only step fails for the servos of `problems`."""

    ENDS = (Stopped,)
    problems: Mapping[Uid, HornbillError]

    async def act(self, target: RunTarget) -> Evidence:
        if target.uid in self.problems:
            raise self.problems[target.uid]
        return Evidence("read_back", "done")

    async def execute(self) -> None:
        async def one(run: Run, target: RunTarget) -> None:
            await run.step(target, "do", Run.act)

        await self.each(self.targets, one)


async def ended(problems: Mapping[Uid, HornbillError]) -> RunningJob:
    """The job of a run over three servos."""
    targets = [RunTarget(record=ServoRecord(uid), place=place) for place, uid in enumerate(UIDS, start=1)]

    async def work(job: RunningJob) -> dict[str, object]:
        run = Run(job=job, targets=targets)
        run.problems = problems
        return await run.work(run.execute())

    with Store("sqlite://") as store:
        jobs = Jobs(lambda job: None, asyncio.get_running_loop().time, store.jobs)
        return await jobs.wait(jobs.start("profile", None, [target.step("do", "Done") for target in targets], work))


def states(job: RunningJob) -> tuple[list[str], list[str]]:
    """The states of the steps, and the verdicts on the servos."""
    return [step.state for step in job.steps], [one.verdict for one in of_result(job.result).values()]


async def test_a_problem_fails_its_servo_and_the_first_one_the_job() -> None:
    job = await ended({A: NoResponse("silent", cause=None), C: Busy("saving", cause=None, seconds=3)})
    assert states(job) == (["failed", "done", "failed"], ["failed", "not_tried", "failed"])
    assert isinstance(job.error, NoResponse)
    assert job.error.detail == "2 of 3 servos failed. silent"
    assert job.error.facts == {
        "uid": A, "uids": [A, C], "also": ["some_servos_failed"], "failed": 2, "targets": 3,
        "titles": ["servo aaaaaaaa", "servo cccccccc"],
    }  # fmt: skip


async def test_a_problem_of_all_servos_ends_the_run() -> None:
    job = await ended({B: Stopped("stop was pressed", cause=None)})
    assert states(job) == (["done", "failed", "waiting"], ["not_tried", "failed", "not_tried"])
    assert isinstance(job.error, Stopped)
    assert job.error.detail == "stop was pressed"
