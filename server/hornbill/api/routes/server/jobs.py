"""Routes of jobs (list, one, cancel, resume), and how a route that starts one answers."""

from typing import Annotated, Any

import orjson
from fastapi import Query
from pydantic import BaseModel, TypeAdapter
from starlette.responses import Response

from hornbill.api import present
from hornbill.api.dependencies import JobId, LeaseHeader, TheHost
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.change import ResetPreview
from hornbill.domain.job import Job, JobState
from hornbill.servo.host import Host
from hornbill.servo.runtime.jobs import RunningJob

routes = Routes("jobs")

_PREVIEW: TypeAdapter[Any] = TypeAdapter(Any)

Wait = Annotated[bool, Query(description="Wait until the job has ended: 200 and the finished job.")]


def starts(preview: type[BaseModel | ResetPreview] | None = None) -> dict[str, Any]:
    """What a route declares that starts a job; `preview`: what its dry run answers. See `answer`."""
    ended = {"model": Job, "description": "the finished job"}
    if preview is not None:
        ended = {"model": Job | preview, "description": "the finished job, or the dry run"}
    under_way = {"model": Job, "description": "the job, under way"}
    return {"status_code": 202, "response_model": Job, "responses": {200: ended, 202: under_way}}


@routes.get("/jobs", Role.VIEW, "invalid_value")
async def list_jobs(
    host: TheHost,
    kind: Annotated[str | None, Query(description="Kind of job.")] = None,
    state: Annotated[JobState | None, Query(description="State of the job.")] = None,
    uid: Annotated[str | None, Query(description="Servo of the job, or of one of its steps.")] = None,
) -> list[Job]:
    """Jobs under way and the last ones that ended, also before the server was started; oldest first."""
    found = (
        job
        for job in host.jobs.all()
        if kind in (None, job.kind)
        and state in (None, job.state)
        and (uid in (None, job.uid) or any(step.uid == uid for step in job.steps))
    )
    return [present.job(job) for job in found]


@routes.get("/jobs/{job_id}", Role.VIEW, "unknown_job")
async def get_job(host: TheHost, job_id: JobId) -> Job:
    """One job."""
    return present.job(host.jobs.get(job_id))


@routes.delete("/jobs/{job_id}", Role.OPERATE, "unknown_job")
async def cancel_job(host: TheHost, job_id: JobId) -> Job:
    """Cancel a job. What it already sent to the servo stays sent."""
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
    """Go on with a job that failed, was cancelled, or was cut off by the end of the server. Its done steps stay done.

    Only a job that says `resumable`. Nothing is resumed by itself.
    """
    job = host.jobs.get(job_id)
    host.connected()
    host.stop.check()
    host.leases.allow_write(lease, host.base.now())
    return await answer(host, host.jobs.resume(job.id, lease), wait)


def previewed(found: BaseModel | ResetPreview) -> Response:
    """200 and what a dry run found, where the real call answers with a job."""
    return Response(orjson.dumps(_PREVIEW.dump_python(found, mode="json")), media_type="application/json")


async def answer(host: Host, job: RunningJob, wait: bool) -> Response:
    """202 and the job as it is now, or, with `wait`, 200 and the job as it ended; its address is in Location."""
    if wait:
        await host.jobs.wait(job)
    return Response(
        orjson.dumps(present.job(job).model_dump()), 200 if wait else 202, media_type="application/json",
        headers={"Location": f"/api/v1/jobs/{job.id}"},
    )  # fmt: skip
