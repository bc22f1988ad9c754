"""Jobs: they end once, with a reason, and are stored for the next process."""

import asyncio
import logging
from collections.abc import Awaitable, Callable

import pytest

import jumping_clock as clock
from hornbill.errors import Busy, HornbillError, Interrupted, NoResponse, Stopped, UnexpectedResult, Unknown
from hornbill.servo.runtime.jobs import MAX_ROWS, OUTCOME_UNKNOWN, Jobs, RunningJob, Step, Work
from hornbill.servo.runtime.steps import Evidence
from hornbill.store.jobs import StoredJob
from hornbill.store.store import Store
from hornbill.units import Uid

A = Uid("a0" * 16)


def run(work: Callable[[Jobs], Awaitable[None]], *later: Callable[[Jobs], Awaitable[None]]) -> list[str]:
    """Run `work`, then each of `later` as another process with the same store; the published states."""
    seen: list[str] = []

    async def inside() -> None:
        loop = asyncio.get_running_loop()
        with Store("sqlite://") as store:
            for part in (work, *later):
                await part(Jobs(lambda job: seen.append(job.state), loop.time, store.jobs))

    clock.run(inside())
    return seen


async def endless(job: RunningJob) -> dict[str, object]:
    await asyncio.sleep(1e6)
    return {}


def steps() -> list[Step]:
    return [Step("one", "First"), Step("two", "Second", uid=A), Step("three", "Third")]


def test_an_error_fails_the_running_step_and_the_job() -> None:
    async def work(jobs: Jobs) -> None:
        async def body(job: RunningJob) -> dict[str, object]:
            job.begin("one")
            raise NoResponse("gone", cause=None)

        job = await jobs.wait(jobs.start("save", Uid("aa"), [Step("one", "1"), Step("two", "2")], body))
        assert job.state == "failed"
        assert job.error is not None
        assert job.error.code == "no_response"
        assert [step.state for step in job.steps] == ["failed", "waiting"]

    run(work)


def test_an_internal_error_fails_the_job() -> None:
    async def work(jobs: Jobs) -> None:
        async def body(job: RunningJob) -> dict[str, object]:
            raise ZeroDivisionError

        job = await jobs.wait(jobs.start("save", None, [], body))
        assert job.state == "failed"
        assert "Internal error in hornbill" in str(job.error)

    run(work)


@pytest.mark.parametrize("after_s", [0, 1])
def test_cancelling_ends_a_job_at_once_even_before_it_has_begun(after_s: float) -> None:
    async def work(jobs: Jobs) -> None:
        job = jobs.start("save", A, [], endless)
        if after_s:
            await asyncio.sleep(after_s)
        assert jobs.running(A) is job
        assert (await jobs.cancel(job.id)).state == "cancelled"
        assert job.ended
        assert jobs.running(A) is None

    run(work)


def test_only_the_last_ended_jobs_are_stored() -> None:
    async def work(jobs: Jobs) -> None:
        async def body(job: RunningJob) -> dict[str, object]:
            return {}

        for _ in range(MAX_ROWS + 5):
            await jobs.wait(jobs.start("save", None, [], body))
        assert len(jobs.all()) <= MAX_ROWS + 1

    run(work)


def test_the_next_process_loads_ended_jobs() -> None:
    async def work(jobs: Jobs) -> None:
        async def well(job: RunningJob) -> dict[str, object]:
            job.begin("one")
            job.done("one", Evidence("read_back", "42 rows", {"rows": 42}))
            job.skip("two", Evidence("save_not_needed", "not needed"))
            return {"rows": 42, "by_uid": {A: [1, None]}}

        async def badly(job: RunningJob) -> dict[str, object]:
            raise UnexpectedResult("It holds something else.", cause=None, differences=[{"key": "origin", "wanted": 1}])

        async def unknown(job: RunningJob) -> dict[str, object]:
            raise Unknown("unknown_profile", "There is no such profile.", cause=None)

        for body in (well, badly, unknown):
            await jobs.wait(jobs.start("save", A, steps(), body))
            await asyncio.sleep(1)

    async def later(jobs: Jobs) -> None:
        well, badly, unknown = jobs.all()
        assert (well.state, well.progress, well.uid, well.kind) == ("succeeded", 2 / 3, A, "save")
        assert well.result == {"rows": 42, "by_uid": {A: [1, None]}}
        assert [step.evidence for step in well.steps] == ["42 rows", "not needed", None]
        assert well.steps[1].uid == A
        assert isinstance(badly.error, UnexpectedResult)
        assert (badly.error.code, badly.error.detail) == ("unexpected_result", "It holds something else.")
        assert badly.error.facts == {"differences": [{"key": "origin", "wanted": 1}]}
        assert isinstance(unknown.error, Unknown)
        assert unknown.error.code == "unknown_profile"
        assert not any(job.resumable for job in (well, badly, unknown))

    seen = run(work, later)
    assert seen[-1] == "failed"


async def killed(jobs: Jobs) -> None:
    """A process that is killed in the second of three steps."""

    async def body(job: RunningJob) -> dict[str, object]:
        job.begin("one")
        job.done("one", Evidence("read_back", "read"))
        job.begin("two")
        await asyncio.sleep(1e6)
        return {}

    jobs.start("commissioning", None, steps(), body, {"count": 12})
    await asyncio.sleep(1)
    jobs.start("save", A, [], endless)
    await asyncio.sleep(1)
    for job in jobs.all():  # this process must store nothing more
        job.on_change = lambda job: None
        assert job.task is not None
    jobs._stored.put = lambda job: None  # pyright: ignore[reportPrivateUsage, reportAttributeAccessIssue]


def test_a_job_that_the_exit_of_the_server_interrupted_has_failed() -> None:
    async def later(jobs: Jobs) -> None:
        cut, save = jobs.all()
        assert (cut.state, save.state) == ("failed", "failed")
        assert isinstance(cut.error, Interrupted)
        assert cut.error.detail == (
            "The server exited while this job was running. Completed: First. Started, outcome unknown: "
            "Second (a0a0a0a0…). The remaining steps were not started."
        )
        assert [step.state for step in cut.steps] == ["done", "failed", "waiting"]
        assert cut.steps[1].evidence == OUTCOME_UNKNOWN
        assert (cut.ended, jobs.running(A)) == (True, None)
        await asyncio.sleep(100)
        assert [job.task for job in jobs.all()] == [None, None]  # a start moves nothing

    run_killed(later)


def run_killed(*later: Callable[[Jobs], Awaitable[None]]) -> None:
    async def inside() -> None:
        loop = asyncio.get_running_loop()
        with Store("sqlite://") as store:
            await killed(Jobs(lambda job: None, loop.time, store.jobs))
            del store.jobs.put  # pyright: ignore[reportAttributeAccessIssue]
            for part in later:
                await part(Jobs(lambda job: None, loop.time, store.jobs))

    clock.run(inside())


def test_an_interrupted_job_is_resumed_after_its_completed_steps() -> None:
    async def later(jobs: Jobs) -> None:
        ran: list[str] = []

        def resumer(job: RunningJob) -> Work:
            async def go_on(job: RunningJob) -> dict[str, object]:
                assert job.request == {"count": 12}
                assert job.lease_id == "lease"
                for step in job.steps:
                    if step.state == "waiting":
                        job.begin(step.name)
                        ran.append(step.name)
                        job.done(step.name)
                return {"ok": True}

            return go_on

        cut, save = jobs.all()
        assert not cut.resumable
        jobs.resumers["commissioning"] = resumer
        assert cut.resumable
        assert not save.resumable
        resumed = jobs.resume(cut.id, "lease")
        assert resumed is cut
        assert (cut.state, cut.error, cut.ended) == ("queued", None, False)
        with pytest.raises(Busy, match="it is running"):
            jobs.resume(cut.id)
        await jobs.wait(cut)
        assert (cut.state, cut.result, ran) == ("succeeded", {"ok": True}, ["two", "three"])
        assert cut.steps[0].evidence == "read"
        with pytest.raises(Busy, match="it succeeded"):
            jobs.resume(cut.id)
        with pytest.raises(Busy, match="start a new job"):
            jobs.resume(save.id)
        with pytest.raises(Unknown):
            jobs.resume("none")

    async def last(jobs: Jobs) -> None:
        assert [job.state for job in jobs.all()] == ["succeeded", "failed"]

    run_killed(later, last)


def test_a_refused_resume_leaves_the_job_unchanged() -> None:
    async def later(jobs: Jobs) -> None:
        def resumer(job: RunningJob) -> Work:
            raise Stopped("Stop is latched.", cause=None)

        jobs.resumers["commissioning"] = resumer
        cut = jobs.all()[0]
        before = cut.error
        with pytest.raises(Stopped):
            jobs.resume(cut.id, "lease")
        assert (cut.state, cut.error, cut.lease_id) == ("failed", before, None)
        assert cut.steps[1].state == "failed"

    run_killed(later)


def test_a_job_is_not_resumed_while_another_runs_on_its_servo() -> None:
    async def work(jobs: Jobs) -> None:
        jobs.resumers["save"] = lambda job: endless
        first = jobs.start("save", A, [], endless, {})
        await jobs.cancel(first.id)
        second = jobs.start("restart", A, [], endless)
        with pytest.raises(Busy, match="A restart job is running"):
            jobs.resume(first.id)
        await jobs.cancel(second.id)
        assert jobs.resume(first.id) is first
        assert jobs.running(A) is first
        await jobs.close()

    run(work)


def test_a_job_that_ends_with_the_server_is_interrupted_and_not_cancelled() -> None:
    async def work(jobs: Jobs) -> None:
        jobs.start("save", A, steps(), endless)
        await asyncio.sleep(1)
        await jobs.close()

    async def later(jobs: Jobs) -> None:
        (job,) = jobs.all()
        assert job.state == "failed"
        assert isinstance(job.error, Interrupted)
        assert "Completed: no step." in job.error.detail

    run(work, later)


def test_a_failing_store_stops_no_job_and_is_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    async def work(jobs: Jobs) -> None:
        async def body(job: RunningJob) -> dict[str, object]:
            for name in ("one", "two", "three"):
                job.begin(name)
                job.done(name)
            return {}

        def fail(job: StoredJob) -> None:
            raise HornbillError("The disk is full.", cause=None)

        jobs._stored.put = fail  # pyright: ignore[reportPrivateUsage, reportAttributeAccessIssue]
        job = await jobs.wait(jobs.start("save", A, steps(), body))
        assert job.state == "succeeded"

    with caplog.at_level(logging.ERROR):
        run(work)
    assert [record.getMessage().split(";")[0] for record in caplog.records] == ["jobs cannot be stored"]


def test_an_unreadable_stored_job_is_skipped(caplog: pytest.LogCaptureFixture) -> None:
    async def work(jobs: Jobs) -> None:
        stored = jobs._stored  # pyright: ignore[reportPrivateUsage]
        stored.put(StoredJob("odd", "save", None, "running", 1.0, None, None, {"steps": [{"nonsense": 1}]}))
        stored.put(
            StoredJob("old", "save", None, "failed", 2.0, 3.0, None,
                      {"steps": [], "result": None,
                       "error": {"class": "Gone", "code": "gone", "detail": "It is gone.", "facts": {}}})
        )  # fmt: skip

    async def later(jobs: Jobs) -> None:
        (job,) = jobs.all()
        assert job.error is not None
        assert (job.id, job.error.code, job.error.detail) == ("old", "internal", "It is gone.")

    with caplog.at_level(logging.ERROR):
        run(work, later)
    assert "odd" in caplog.text
