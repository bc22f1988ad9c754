"""Owns the routes of stop: press it, look at it, clear it. None of them asks for a lease."""

from typing import Annotated

from fastapi import APIRouter, Query

from hornbill.api import PREFIX, models, present
from hornbill.api.dependencies import TheHost
from hornbill.api.problems import declared
from hornbill.servo.acting import signed

router = APIRouter(prefix=PREFIX, tags=["motion"])

By = Annotated[str, Query(description="who does it, for the log and for everybody to see; 80 characters are kept")]
WITHIN_S = 0.25
"""POST /stop answers when every servo has confirmed, or after this long; it goes on repeating all the same."""


@router.post("/stop", operation_id="stop", responses=declared("invalid_value"))
async def stop(host: TheHost, body: models.StopRequest | None = None, by: By = "REST") -> models.Stop:
    """Stop every servo now: needs no lease, waits for nothing, latches. Pressing again sends again."""
    wanted = body or models.StopRequest()
    host.stop.now(wanted.mode, signed(by), wanted.reason)
    await host.stop.confirmed(WITHIN_S)
    return present.stop(host)


@router.get("/stop", operation_id="get_stop")
async def get_stop(host: TheHost) -> models.Stop:
    """The stop latch, and which servos have confirmed."""
    return present.stop(host)


@router.delete("/stop", operation_id="clear_stop")
async def clear_stop(host: TheHost, by: By = "REST") -> models.Stop:
    """Unlatch. Moves nothing and turns nothing on: torque stays off until it is turned on."""
    host.stop.clear(signed(by))
    return present.stop(host)
