"""Owns the route that lets a horn wiggle, to show which servo it is."""

from fastapi import APIRouter
from starlette.responses import Response

from hornbill.api import PREFIX, models
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.jobs import JOB_ANSWERS, Wait, answer
from hornbill.api.problems import declared

router = APIRouter(prefix=PREFIX, tags=["motion"])

PROBLEMS = declared(
    "unknown_servo", "not_in_this_model", "busy", "configuration_lost", "stopped", "lease_required", "lease_held",
    "no_answer", "bus_disconnected",
)  # fmt: skip


@router.post(
    "/servos/{uid}/identify",
    operation_id="identify_servo",
    status_code=202,
    response_model=models.Job,
    responses={**PROBLEMS, **JOB_ANSWERS},
)
async def identify_servo(host: TheHost, servo: TheServo, lease: LeaseHeader = None, wait: Wait = False) -> Response:
    """Turn the horn slowly by 3 degrees to either side, twice, and back. Torque is afterwards what it was before.

    Under the lease of the header, or, while nobody holds one, under one of its own for the time it takes.
    """
    host.connected()
    return await answer(host, host.wiggle.identify(servo, lease), wait)
