"""Jobs: they end once, with a reason, and are stored for the next process."""

import asyncio
import logging
from collections.abc import Iterator

import pytest

from hornbill.errors import Busy, HornbillError, Interrupted, NoResponse, Stopped, UnexpectedResult, Unknown
from hornbill.servo.runtime import jobs as module
from hornbill.servo.runtime.jobs import OUTCOME_UNKNOWN, Jobs, RunningJob, Step, Work
from hornbill.servo.runtime.steps import Evidence
from hornbill.store import jobs as stored_jobs
from hornbill.store.jobs import StoredJob
from hornbill.store.store import Store
from hornbill.store.tables import Json
from hornbill.units import Uid

A = Uid("a0" * 16)
NOT_FOUND = Unknown("unknown_profile", "There is no such profile.", cause=None)
UNEXPECTED = UnexpectedResult(
    "It holds something else.", cause=None, differences=[{"key": "origin", "wanted": 1}]
)  # fmt: skip


@pytest.fixture
def store() -> Iterator[Store]:
    with Store("sqlite://") as opened:
        yield opened


def process(store: Store) -> Jobs:
    """The jobs of a server process, to be made in the test: the next process has the same store."""
    return Jobs(lambda job: None, asyncio.get_running_loop().time, store.jobs)


def steps() -> list[Step]:
    return [Step("one", "First"), Step("two", "Second", uid=A), Step("three", "Third")]


async def nothing(job: RunningJob) -> dict[str, object]:
    return {}


async def endless(job: RunningJob) -> dict[str, object]:
    await asyncio.sleep(1e6)
    return {}


async def begun(job: RunningJob) -> dict[str, object]:
    """It never ends its second step."""
    job.begin("one")
    job.done("one", Evidence("read_back", "read"))
    job.begin("two")
    return await endless(job)


def failing(error: Exception) -> Work:
    async def work(job: RunningJob) -> dict[str, object]:
        job.begin("one")
        raise error

    return work


async def interrupted(store: Store) -> list[RunningJob]:
    """The jobs of the next process, after the first was killed in a commissioning and a save."""
    killed = process(store)
    killed.start("commissioning", None, steps(), begun, {"count": 12})
    await asyncio.sleep(1)
    killed.start("save", A, [], endless)
    await asyncio.sleep(1)
    return process(store).all()


@pytest.mark.parametrize(
    ("error", "code", "text"),
    [(NoResponse("gone", cause=None), "no_response", "gone"), (ZeroDivisionError(), "internal", "Internal error in")],
)
async def test_an_error_fails_the_running_step_and_the_job(
    store: Store, error: Exception, code: str, text: str
) -> None:
    jobs = process(store)
    job = await jobs.wait(jobs.start("save", A, steps(), failing(error)))
    assert job.error is not None
    assert (job.state, job.error.code, [step.state for step in job.steps]) == (
        "failed", code, ["failed", "waiting", "waiting"]
    )  # fmt: skip
    assert text in str(job.error)


@pytest.mark.parametrize("after_s", [0, 1])
async def test_cancelling_ends_a_job_at_once_even_before_it_has_begun(store: Store, after_s: float) -> None:
    jobs = process(store)
    job = jobs.start("save", A, [], endless)
    if after_s:
        await asyncio.sleep(after_s)
    assert jobs.running(A) is job
    assert (await jobs.cancel(job.id)).state == "cancelled"
    assert job.ended
    assert jobs.running(A) is None


async def test_only_the_last_ended_jobs_are_stored(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    for owner in (module, stored_jobs):
        monkeypatch.setattr(owner, "MAX_ROWS", 5)
    jobs = process(store)
    for _ in range(10):
        await jobs.wait(jobs.start("save", None, [], nothing))
    assert [len(one.all()) for one in (jobs, process(store))] == [6, 6]


async def test_the_next_process_loads_ended_jobs(store: Store) -> None:
    async def well(job: RunningJob) -> dict[str, object]:
        job.begin("one")
        job.done("one", Evidence("read_back", "42 rows", {"rows": 42}))
        job.skip("two", Evidence("save_not_needed", "not needed"))
        return {"rows": 42, "by_uid": {A: [1, None]}}

    jobs = process(store)
    for body in (well, failing(UNEXPECTED), failing(NOT_FOUND)):
        await jobs.wait(jobs.start("save", A, steps(), body))
        await asyncio.sleep(1)
    done, *failed = process(store).all()
    assert (done.state, done.progress, done.uid, done.kind) == ("succeeded", 2 / 3, A, "save")
    assert done.result == {"rows": 42, "by_uid": {A: [1, None]}}
    assert [step.evidence for step in done.steps] == ["42 rows", "not needed", None]
    assert done.steps[1].uid == A
    for job, error in zip(failed, (UNEXPECTED, NOT_FOUND), strict=True):
        assert type(job.error) is type(error)
        assert job.error is not None
        assert (job.state, job.error.code, job.error.detail) == ("failed", error.code, error.detail)
        assert job.error.facts == error.facts
    assert not any(job.resumable for job in (done, *failed))


async def test_a_job_that_the_exit_of_the_server_interrupted_has_failed(store: Store) -> None:
    cut, save = await interrupted(store)
    assert (cut.state, save.state) == ("failed", "failed")
    assert isinstance(cut.error, Interrupted)
    assert cut.error.detail == (
        "The server exited while this job was running. Completed: First. Started, outcome unknown: "
        "Second (a0a0a0a0…). The remaining steps were not started."
    )
    assert [step.state for step in cut.steps] == ["done", "failed", "waiting"]
    assert cut.steps[1].evidence == OUTCOME_UNKNOWN
    await asyncio.sleep(100)
    assert [(job.ended, job.task) for job in (cut, save)] == [(True, None)] * 2, "a start moves nothing"


async def test_an_interrupted_job_is_resumed_after_its_completed_steps(store: Store) -> None:
    ran: list[str] = []

    async def go_on(job: RunningJob) -> dict[str, object]:
        assert (job.request, job.lease_id) == ({"count": 12}, "lease")
        for step in job.steps:
            if step.state == "waiting":
                job.begin(step.name)
                ran.append(step.name)
                job.done(step.name)
        return {"ok": True}

    await interrupted(store)
    jobs = process(store)
    cut, save = jobs.all()
    assert not cut.resumable
    jobs.resumers["commissioning"] = lambda job: go_on
    assert (cut.resumable, save.resumable) == (True, False)
    assert jobs.resume(cut.id, "lease") is cut
    assert (cut.state, cut.error, cut.ended) == ("queued", None, False)
    with pytest.raises(Busy, match="it is running"):
        jobs.resume(cut.id)
    await jobs.wait(cut)
    assert (cut.state, cut.result, ran) == ("succeeded", {"ok": True}, ["two", "three"])
    assert cut.steps[0].evidence == "read"
    for job, why in ((cut, "it succeeded"), (save, "start a new job")):
        with pytest.raises(Busy, match=why):
            jobs.resume(job.id)
    with pytest.raises(Unknown):
        jobs.resume("none")
    assert [job.state for job in process(store).all()] == ["succeeded", "failed"]


async def test_a_refused_resume_leaves_the_job_unchanged(store: Store) -> None:
    def refuse(job: RunningJob) -> Work:
        raise Stopped("Stop is latched.", cause=None)

    await interrupted(store)
    jobs = process(store)
    jobs.resumers["commissioning"] = refuse
    cut = jobs.all()[0]
    before = cut.error
    with pytest.raises(Stopped):
        jobs.resume(cut.id, "lease")
    assert (cut.state, cut.error, cut.lease_id, cut.steps[1].state) == ("failed", before, None, "failed")


async def test_a_job_is_not_resumed_while_another_runs_on_its_servo(store: Store) -> None:
    jobs = process(store)
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


async def test_a_job_that_ends_with_the_server_is_interrupted_and_not_cancelled(store: Store) -> None:
    jobs = process(store)
    jobs.start("save", A, steps(), endless)
    await asyncio.sleep(1)
    await jobs.close()
    (job,) = process(store).all()
    assert job.state == "failed"
    assert isinstance(job.error, Interrupted)
    assert "Completed: no step." in job.error.detail


async def test_a_failing_store_stops_no_job_and_is_logged_once(
    store: Store, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async def work(job: RunningJob) -> dict[str, object]:
        for name in ("one", "two", "three"):
            job.begin(name)
            job.done(name)
        return {}

    def fail(job: StoredJob) -> None:
        raise HornbillError("The disk is full.", cause=None)

    monkeypatch.setattr(store.jobs, "put", fail)
    jobs = process(store)
    assert (await jobs.wait(jobs.start("save", A, steps(), work))).state == "succeeded"
    errors = [record.getMessage() for record in caplog.records if record.levelno == logging.ERROR]
    assert [text.split(";")[0] for text in errors] == ["jobs cannot be stored"]


async def test_an_unreadable_stored_job_is_skipped(store: Store, caplog: pytest.LogCaptureFixture) -> None:
    gone: dict[str, Json] = {"class": "Gone", "code": "gone", "detail": "It is gone.", "facts": {}}
    store.jobs.put(StoredJob("odd", "save", None, "running", 1.0, None, None, {"steps": [{"nonsense": 1}]}))
    store.jobs.put(
        StoredJob("old", "save", None, "failed", 2.0, 3.0, None, {"steps": [], "result": None, "error": gone})
    )
    (job,) = process(store).all()
    assert job.error is not None
    assert (job.id, job.error.code, job.error.detail) == ("old", "internal", "It is gone.")
    assert "odd" in caplog.text
