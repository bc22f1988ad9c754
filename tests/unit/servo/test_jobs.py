"""A job ends once, visibly, and says why."""

import asyncio
from collections.abc import Awaitable, Callable

from hornbill.bus import clock
from hornbill.errors import NoAnswer
from hornbill.servo.jobs import KEPT, Job, Jobs, Step
from hornbill.units import Uid


def run(work: Callable[[Jobs], Awaitable[None]]) -> list[str]:
    seen: list[str] = []

    async def inside() -> None:
        loop = asyncio.get_running_loop()
        await work(Jobs(lambda job: seen.append(job.state), loop.time))

    clock.run(inside())
    return seen


def test_success_carries_the_result_and_the_evidence() -> None:
    async def work(jobs: Jobs) -> None:
        async def body(job: Job) -> dict[str, object]:
            job.begin("one")
            assert job.step == "one"
            job.done("one", "42 rows")
            job.skip("two", "not needed")
            return {"rows": 42}

        job = await jobs.wait(jobs.start("save", Uid("aa"), [Step("one", "1"), Step("two", "2")], body))
        assert (job.state, job.result, job.progress, job.error) == ("succeeded", {"rows": 42}, 1.0, None)
        assert [step.evidence for step in job.steps] == ["42 rows", "not needed"]

    assert run(work)[-1] == "succeeded"


def test_an_error_fails_the_running_step_and_is_kept() -> None:
    async def work(jobs: Jobs) -> None:
        async def body(job: Job) -> dict[str, object]:
            job.begin("one")
            raise NoAnswer("gone")

        job = await jobs.wait(jobs.start("save", Uid("aa"), [Step("one", "1"), Step("two", "2")], body))
        assert job.state == "failed"
        assert job.error is not None
        assert job.error.code == "no_answer"
        assert [step.state for step in job.steps] == ["failed", "waiting"]

    run(work)


def test_a_defect_ends_the_job_instead_of_leaving_it_running() -> None:
    async def work(jobs: Jobs) -> None:
        async def body(job: Job) -> dict[str, object]:
            raise ZeroDivisionError

        job = await jobs.wait(jobs.start("save", None, [], body))
        assert job.state == "failed"
        assert "hornbill itself failed" in str(job.error)

    run(work)


def test_cancelling_ends_it_at_once() -> None:
    async def work(jobs: Jobs) -> None:
        async def body(job: Job) -> dict[str, object]:
            await asyncio.sleep(1e6)
            return {}

        job = jobs.start("save", Uid("aa"), [], body)
        await asyncio.sleep(1)
        assert jobs.running(Uid("aa")) is job
        assert (await jobs.cancel(job.id)).state == "cancelled"
        assert jobs.running(Uid("aa")) is None

    run(work)


def test_only_the_last_finished_jobs_are_kept() -> None:
    async def work(jobs: Jobs) -> None:
        async def body(job: Job) -> dict[str, object]:
            return {}

        for _ in range(KEPT + 20):
            await jobs.wait(jobs.start("save", None, [], body))
        assert len(jobs.all()) <= KEPT + 1

    run(work)
