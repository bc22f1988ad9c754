"""Owns the routes of the position unit: what a position on the bus means on one servo, and saying so by hand."""

from fastapi import APIRouter

from hornbill.api import PREFIX, models, present
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.motion_models import PositionUnitPut
from hornbill.api.problems import declared
from hornbill.errors import Busy

router = APIRouter(prefix=PREFIX, tags=["motion"])


@router.get("/servos/{uid}/position-unit", operation_id="get_position_unit", responses=declared("unknown_servo"))
async def get_position_unit(host: TheHost, servo: TheServo) -> models.PositionUnitState:
    """What position 1.0 of Status and ArrayCommand means on this servo, and how that is known."""
    return present.position_unit(host, servo)


@router.put("/servos/{uid}/position-unit", operation_id="set_position_unit",
            responses=declared("unknown_servo", "busy", "lease_held", "invalid_value"))  # fmt: skip
async def set_position_unit(
    host: TheHost, servo: TheServo, body: PositionUnitPut, lease: LeaseHeader = None
) -> models.PositionUnitState:
    """Take its positions for this unit; null measures it, anew if it was before. Nothing is written to the servo."""
    now = host.base.now()
    host.leases.allow_write(lease, now)
    if host.motion.driven(servo.uid):
        raise Busy(f"{servo.title} is under command, and the same angle would be another position. Let it go first.")
    host.position_units.force(servo, body.unit, by=host.leases.who(lease, now))
    return present.position_unit(host, servo)
