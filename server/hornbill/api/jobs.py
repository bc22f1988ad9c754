"""Owns the routes of jobs (list, one, cancel, resume), and how a route that starts one answers."""

from typing import Annotated, Any, Literal

import orjson
from fastapi import APIRouter, Query
from starlette.responses import Response

from hornbill.api import PREFIX, models, present
from hornbill.api.dependencies import LeaseHeader, TheHost
from hornbill.api.problems import declared
from hornbill.servo.host import Host
from hornbill.servo.jobs import Job

router = APIRouter(prefix=PREFIX, tags=["jobs"])

Wait = Annotated[bool, Query(description="answer only when the job has ended: 200 and the finished job")]
JOB_ANSWERS: dict[int | str, dict[str, Any]] = {
    200: {"model": models.Job, "description": "the finished job"},
    202: {"model": models.Job, "description": "the job, under way"},
}
"""What a route answers that starts a job; see `answer`."""


@router.get("/jobs", operation_id="list_jobs", responses=declared("invalid_value"))
async def list_jobs(
    host: TheHost,
    kind: str | None = None,
    state: Literal["queued", "running", "succeeded", "failed", "cancelled"] | None = None,
    uid: Annotated[str | None, Query(description="jobs of this servo, and those with a step about it")] = None,
) -> list[models.Job]:
    """Jobs under way and the last ones that ended, also before the server was started; oldest first."""
    found = (
        job
        for job in host.jobs.all()
        if kind in (None, job.kind)
        and state in (None, job.state)
        and (uid in (None, job.uid) or any(step.uid == uid for step in job.steps))
    )
    return [present.job(job) for job in found]


@router.get("/jobs/{job_id}", operation_id="get_job", responses=declared("unknown_job"))
async def get_job(host: TheHost, job_id: str) -> models.Job:
    """One job."""
    return present.job(host.jobs.get(job_id))


@router.delete("/jobs/{job_id}", operation_id="cancel_job", responses=declared("unknown_job"))
async def cancel_job(host: TheHost, job_id: str) -> models.Job:
    """Cancel a job. What it already sent to the servo stays sent."""
    return present.job(await host.jobs.cancel(job_id))


@router.post(
    "/jobs/{job_id}/resume",
    operation_id="resume_job",
    status_code=202,
    response_model=models.Job,
    responses={**declared("unknown_job", "busy", "lease_held", "stopped", "bus_disconnected"), **JOB_ANSWERS},
)
async def resume_job(host: TheHost, job_id: str, lease: LeaseHeader = None, wait: Wait = False) -> Response:
    """Go on with a job that failed, was cancelled, or was cut off by the end of the server. Its done steps stay done.

    Only a job that says `resumable`. Nothing is resumed by itself.
    """
    job = host.jobs.get(job_id)
    host.connected()
    host.stop.check()
    host.leases.allow_write(lease, host.base.now())
    return await answer(host, host.jobs.resume(job.id, lease), wait)


async def answer(host: Host, job: Job, wait: bool) -> Response:
    """202 and the job as it is now, or, with `wait`, 200 and the job as it ended; its address is in Location."""
    if wait:
        await host.jobs.wait(job)
    return Response(
        orjson.dumps(present.job(job).model_dump()), 200 if wait else 202, media_type="application/json",
        headers={"Location": f"/api/v1/jobs/{job.id}"},
    )  # fmt: skip
