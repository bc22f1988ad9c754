"""Routes of jobs, and the responses of routes that start one."""

from typing import Annotated, Any

import orjson
from fastapi import Query
from pydantic import BaseModel, TypeAdapter
from starlette.responses import Response

from hornbill.api import present
from hornbill.api.addressing import ServoRef
from hornbill.api.dependencies import JobId, LeaseHeader, TheHost
from hornbill.api.paging import Page, pages
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.change import ResetPreview
from hornbill.domain.job import Job, JobState
from hornbill.servo.host import Host
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.store.jobs import MAX_ROWS

routes = Routes("jobs")

_PREVIEW: TypeAdapter[Any] = TypeAdapter(Any)

Wait = Annotated[bool, Query(description="Wait until the job has ended. The response is 200 with the finished job.")]


def starts(preview: type[BaseModel | ResetPreview] | None = None) -> dict[str, Any]:
    """Declaration of a route that starts a job; `preview`: response of its dry run. See `job_response`."""
    ended = {"model": Job, "description": "Finished job."}
    if preview is not None:
        ended = {"model": Job | preview, "description": "Finished job, or result of the dry run."}
    running = {"model": Job, "description": "Running job."}
    return {"status_code": 202, "response_model": Job, "responses": {200: ended, 202: running}}


@routes.get("/jobs", Role.VIEW, "unknown_servo", "invalid_value")
async def list_jobs(
    host: TheHost,
    page: Annotated[Page, pages(MAX_ROWS, MAX_ROWS)],
    kind: Annotated[str | None, Query(description="Kind of job.")] = None,
    state: Annotated[JobState | None, Query(description="State of the job.")] = None,
    uid: Annotated[ServoRef | None, Query(description="Servo of the job, or of one of its steps.")] = None,
) -> list[Job]:
    """List running and recently ended jobs, newest first, including those started before a restart of the server."""
    found = (
        job
        for job in reversed(host.jobs.all())
        if kind in (None, job.kind)
        and state in (None, job.state)
        and (uid in (None, job.uid) or any(step.uid == uid for step in job.steps))
    )
    return [present.job(job) for job in page.of(found, lambda job: job.id)]


@routes.get("/jobs/{job_id}", Role.VIEW, "unknown_job")
async def get_job(
    host: TheHost,
    job_id: JobId,
    wait: Annotated[
        float, Query(ge=0, le=60, allow_inf_nan=False, description="Maximum time to wait for the end of the job, s.")
    ] = 0.0,
) -> Job:
    """Get a job. With `wait`, the response is sent when the job has ended, or after that time (long poll)."""
    job = host.jobs.get(job_id)
    if wait:
        await host.jobs.wait(job, within_s=wait)
    return present.job(job)


@routes.delete("/jobs/{job_id}", Role.OPERATE, "unknown_job")
async def cancel_job(host: TheHost, job_id: JobId) -> Job:
    """Cancel a job. Steps already carried out are not undone."""
    return present.job(await host.jobs.cancel(job_id))


@routes.post(
    "/jobs/{job_id}/resume",
    Role.CONFIGURE,
    "unknown_job",
    "busy",
    "lease_held",
    "stopped",
    "bus_disconnected",
    **starts(),
)
async def resume_job(host: TheHost, job_id: JobId, lease: LeaseHeader = None, wait: Wait = False) -> Response:
    """Resume a job that failed, was cancelled or was interrupted by the end of the server. Completed steps are kept.

    Requires `resumable`. Jobs are never resumed automatically. Refused while another client has motion control of one
    of the job's servos.
    """
    job = host.jobs.get(job_id)
    host.connected()
    host.stop.check()
    host.leases.allow_write(lease, host.base.now(), *job.uids)
    return await job_response(host, host.jobs.resume(job.id, lease), wait)


def preview_response(found: BaseModel | ResetPreview) -> Response:
    """200 with the result of a dry run, in place of a job."""
    return Response(orjson.dumps(_PREVIEW.dump_python(found, mode="json")), media_type="application/json")


async def job_response(host: Host, job: RunningJob, wait: bool) -> Response:
    """202 with the running job, or, with `wait`, 200 with the finished job. Location is the address of the job."""
    if wait:
        await host.jobs.wait(job)
    return Response(
        orjson.dumps(present.job(job).model_dump()), 200 if wait else 202, media_type="application/json",
        headers={"Location": f"/api/v1/jobs/{job.id}"},
    )  # fmt: skip
