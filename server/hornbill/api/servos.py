"""Owns the routes of servos themselves: list, one, nickname, telemetry wish, save and restart, and jobs."""

from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Query
from starlette.responses import Response

from hornbill.api import models, present
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.problems import declared
from hornbill.servo.host import Host
from hornbill.servo.jobs import Job

router = APIRouter(tags=["servos"])

Wait = Annotated[bool, Query(description="answer only when the job has ended: 200 and the finished job")]
SAVE_PROBLEMS = declared("unknown_servo", "no_answer", "busy", "stopped", "lease_held")
JOB_ANSWERS: dict[int | str, dict[str, Any]] = {
    200: {"model": models.Job, "description": "the finished job"},
    202: {"model": models.Job, "description": "the job, under way"},
}


@router.get("/servos", operation_id="list_servos", responses=declared("invalid_value"))
async def list_servos(
    host: TheHost,
    node_id: int | None = None,
    servo_id: int | None = None,
    label: str | None = None,
    serial: str | None = None,
) -> list[models.Servo]:
    """Every servo seen since the start. Filters are look-ups: the key of a servo is its uid."""
    found = [present.servo(host, one) for one in host.fleet.all()]
    wanted = {"node_id": node_id, "servo_id": servo_id, "label": label, "serial": serial}
    return [one for one in found if all(want is None or getattr(one, key) == want for key, want in wanted.items())]


@router.get("/servos/{uid}", operation_id="get_servo", responses=declared("unknown_servo"))
async def get_servo(host: TheHost, servo: TheServo) -> models.Servo:
    """One servo."""
    return present.servo(host, servo)


@router.patch("/servos/{uid}", operation_id="label_servo", responses=declared("unknown_servo", "invalid_value"))
async def label_servo(host: TheHost, servo: TheServo, body: models.ServoPatch) -> models.Servo:
    """Give a servo a nickname; the server keeps it, the servo does not know it."""
    host.set_label(servo, body.label)
    return present.servo(host, servo)


@router.put(
    "/servos/{uid}/telemetry",
    operation_id="set_telemetry",
    responses=declared("unknown_servo", "unknown_parameter", "not_in_this_model", "invalid_value"),
)
async def set_telemetry(host: TheHost, servo: TheServo, body: models.TelemetryWish) -> models.TelemetryGrant:
    """What to poll of this servo, and how often; the answer says what the bus budget allows. [] ends it."""
    return models.TelemetryGrant.model_validate(host.polling.wish(servo, body.channels, body.rate_hz))


@router.post(
    "/servos/{uid}/save",
    operation_id="save_servo",
    status_code=202,
    response_model=models.Job,
    responses={**SAVE_PROBLEMS, **JOB_ANSWERS},
)
async def save_servo(host: TheHost, servo: TheServo, lease: LeaseHeader = None, wait: Wait = False) -> Response:
    """Write RAM to ROM. The servo restarts; with soft start and torque on in ROM its horn goes slowly to 0 degrees."""
    host.connected()
    return await _job(host, host.saving.save(servo, lease), wait)


@router.post(
    "/servos/{uid}/restart",
    operation_id="restart_servo",
    status_code=202,
    response_model=models.Job,
    responses={**SAVE_PROBLEMS, **JOB_ANSWERS},
)
async def restart_servo(host: TheHost, servo: TheServo, lease: LeaseHeader = None, wait: Wait = False) -> Response:
    """Restart. What is only in RAM is lost; with soft start and torque on in ROM the horn goes slowly to 0 degrees."""
    host.connected()
    return await _job(host, host.saving.restart(servo, lease), wait)


@router.get("/jobs", operation_id="list_jobs", tags=["jobs"])
async def list_jobs(host: TheHost) -> list[models.Job]:
    """Jobs under way and the last ones that ended, oldest first."""
    return [present.job(job) for job in host.jobs.all()]


@router.get("/jobs/{job_id}", operation_id="get_job", tags=["jobs"], responses=declared("unknown_job"))
async def get_job(host: TheHost, job_id: str) -> models.Job:
    """One job."""
    return present.job(host.jobs.get(job_id))


@router.delete("/jobs/{job_id}", operation_id="cancel_job", tags=["jobs"], responses=declared("unknown_job"))
async def cancel_job(host: TheHost, job_id: str) -> models.Job:
    """Cancel a job. What it already sent to the servo stays sent."""
    return present.job(await host.jobs.cancel(job_id))


async def _job(host: Host, job: Job, wait: bool) -> Response:
    if wait:
        await host.jobs.wait(job)
    return Response(
        orjson.dumps(present.job(job).model_dump()), 200 if wait else 202, media_type="application/json",
        headers={"Location": f"/api/v1/jobs/{job.id}"},
    )  # fmt: skip
