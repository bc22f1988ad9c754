"""A job ends once, visibly, says why, and is remembered by the next process."""

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
    """Play `work`, and each of `later` as another process on the same store would; what states were told."""
    seen: list[str] = []

    async def inside() -> None:
        loop = asyncio.get_running_loop()
        with Store("sqlite://") as store:
            for part in (work, *later):
                await part(Jobs(lambda job: seen.append(job.state), loop.time, store.jobs))

    clock.run(inside())
    return seen


async def for_ever(job: RunningJob) -> dict[str, object]:
    await asyncio.sleep(1e6)
    return {}


def steps() -> list[Step]:
    return [Step("one", "First"), Step("two", "Second", uid=A), Step("three", "Third")]


def test_success_carries_the_result_and_the_evidence() -> None:
    async def work(jobs: Jobs) -> None:
        async def body(job: RunningJob) -> dict[str, object]:
            job.begin("one")
            assert job.step == "one"
            job.done("one", Evidence("read_back", "42 rows", {"rows": 42}))
            job.skip("two", Evidence("save_not_needed", "not needed"))
            return {"rows": 42}

        job = await jobs.wait(jobs.start("save", Uid("aa"), [Step("one", "1"), Step("two", "2")], body))
        assert (job.state, job.result, job.progress, job.error) == ("succeeded", {"rows": 42}, 1.0, None)
        assert [step.evidence for step in job.steps] == ["42 rows", "not needed"]

    assert run(work)[-1] == "succeeded"


def test_an_error_fails_the_running_step_and_is_kept() -> None:
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


def test_a_defect_ends_the_job_instead_of_leaving_it_running() -> None:
    async def work(jobs: Jobs) -> None:
        async def body(job: RunningJob) -> dict[str, object]:
            raise ZeroDivisionError

        job = await jobs.wait(jobs.start("save", None, [], body))
        assert job.state == "failed"
        assert "Internal error in hornbill" in str(job.error)

    run(work)


def test_cancelling_ends_it_at_once() -> None:
    async def work(jobs: Jobs) -> None:
        async def body(job: RunningJob) -> dict[str, object]:
            await asyncio.sleep(1e6)
            return {}

        job = jobs.start("save", Uid("aa"), [], body)
        await asyncio.sleep(1)
        assert jobs.running(Uid("aa")) is job
        assert (await jobs.cancel(job.id)).state == "cancelled"
        assert jobs.running(Uid("aa")) is None

    run(work)


def test_cancelling_one_that_has_not_begun_ends_it_too() -> None:
    async def work(jobs: Jobs) -> None:
        job = jobs.start("save", A, [], for_ever)
        assert (await jobs.cancel(job.id)).state == "cancelled"
        assert job.ended
        assert jobs.running(A) is None

    run(work)


def test_only_the_last_finished_jobs_are_kept() -> None:
    async def work(jobs: Jobs) -> None:
        async def body(job: RunningJob) -> dict[str, object]:
            return {}

        for _ in range(MAX_ROWS + 20):
            await jobs.wait(jobs.start("save", None, [], body))
        assert len(jobs.all()) <= MAX_ROWS + 1

    run(work)


def test_the_next_process_knows_how_each_ended() -> None:
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
    """A process that dies in the second of three steps."""

    async def body(job: RunningJob) -> dict[str, object]:
        job.begin("one")
        job.done("one", Evidence("read_back", "read"))
        job.begin("two")
        await asyncio.sleep(1e6)
        return {}

    jobs.start("commissioning", None, steps(), body, {"count": 12})
    await asyncio.sleep(1)
    jobs.start("save", A, [], for_ever)
    await asyncio.sleep(1)
    for job in jobs.all():  # nothing of this process may be kept any more
        job.on_change = lambda job: None
        assert job.task is not None
    jobs._stored.put = lambda job: None  # pyright: ignore[reportPrivateUsage, reportAttributeAccessIssue]


def test_what_the_end_of_the_server_cut_off_says_so_and_claims_nothing() -> None:
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


def test_a_job_is_resumed_as_itself_with_what_was_done_behind_it() -> None:
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


def test_a_resumer_that_refuses_leaves_the_job_as_it_was() -> None:
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


def test_one_servo_is_worked_on_by_one_job_also_when_one_is_resumed() -> None:
    async def work(jobs: Jobs) -> None:
        jobs.resumers["save"] = lambda job: for_ever
        first = jobs.start("save", A, [], for_ever, {})
        await jobs.cancel(first.id)
        second = jobs.start("restart", A, [], for_ever)
        with pytest.raises(Busy, match="A restart job is running"):
            jobs.resume(first.id)
        await jobs.cancel(second.id)
        assert jobs.resume(first.id) is first
        assert jobs.running(A) is first
        await jobs.close()

    run(work)


def test_what_ends_because_the_server_closes_was_interrupted_not_cancelled() -> None:
    async def work(jobs: Jobs) -> None:
        jobs.start("save", A, steps(), for_ever)
        await asyncio.sleep(1)
        await jobs.close()

    async def later(jobs: Jobs) -> None:
        (job,) = jobs.all()
        assert job.state == "failed"
        assert isinstance(job.error, Interrupted)
        assert "Completed: no step." in job.error.detail

    run(work, later)


def test_a_store_that_fails_stops_no_job_and_is_told_once(caplog: pytest.LogCaptureFixture) -> None:
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


def test_a_row_nobody_can_read_keeps_no_server_from_starting(caplog: pytest.LogCaptureFixture) -> None:
    async def work(jobs: Jobs) -> None:
        kept = jobs._stored  # pyright: ignore[reportPrivateUsage]
        kept.put(StoredJob("odd", "save", None, "running", 1.0, None, None, {"steps": [{"nonsense": 1}]}))
        kept.put(
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
