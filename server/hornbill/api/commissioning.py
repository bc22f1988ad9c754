"""Owns the routes of commissioning: which servos look new, and the job that gives them names, ids and values."""

from fastapi import APIRouter
from starlette.responses import Response

from hornbill.api import PREFIX, config_models, models, present
from hornbill.api.dependencies import LeaseHeader, TheHost
from hornbill.api.jobs import JOB_ANSWERS, Wait, answer
from hornbill.api.problems import declared
from hornbill.servo.configuration.commission_plan import Wanted
from hornbill.units import Uid

router = APIRouter(prefix=PREFIX, tags=["commissioning"])

PROBLEMS = declared(
    "unknown_servo", "unknown_profile", "invalid_value", "out_of_range", "not_in_this_model", "conflict",
    "needs_confirmation", "configuration_lost", "torque_on", "busy", "stopped", "lease_held", "no_answer",
    "bus_disconnected",
)  # fmt: skip


@router.get("/commissioning/candidates", operation_id="list_candidates")
async def list_candidates(host: TheHost) -> config_models.Candidates:
    """Servos on the bus that look new (servo id 0, no label), each with the servo id to give it; and those that still
    wait for a node id.
    """
    return config_models.Candidates(
        servos=[
            config_models.Candidate(servo=present.servo(host, one.servo), servo_id=one.servo_id)
            for one in host.commissioning.candidates()
        ],
        pending=present.pending(host),
    )


@router.post(
    "/commissioning",
    operation_id="commission",
    status_code=202,
    response_model=models.Job,
    responses={**PROBLEMS, **JOB_ANSWERS},
)
async def commission(
    host: TheHost, body: config_models.Commissioning, lease: LeaseHeader = None, wait: Wait = False
) -> Response:
    """Give servos their labels, ids and values, one by one, each all or nothing, saved and proved.

    Everything is checked before the first write. With `identify` each horn wiggles a little first; with `save` each
    servo restarts, and with soft start and torque on in ROM its horn goes slowly to 0 degrees. Asking again for one
    servo does its part again; what it holds already is not written. The job can be resumed, also by another server.
    """
    host.connected()
    job = host.commissioning.start(
        [Wanted(Uid(one.uid), one.servo_id, one.node_id, one.label.strip()) for one in body.servos],
        lease, profile=body.profile, save=body.save, identify=body.identify, on_anomaly=body.on_anomaly,
        confirm=body.confirm,
    )  # fmt: skip
    return await answer(host, job, wait)
