"""Routes of the position unit."""

from pydantic import Field

from hornbill.api import present
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.fields import Model
from hornbill.domain.servo import PositionUnit, PositionUnitState
from hornbill.errors import Busy

routes = Routes("motion")


class PositionUnitPut(Model):
    """Position unit to use."""

    unit: PositionUnit | None = Field(description="Unit of position 1.0. Null to measure it.")


@routes.get("/servos/{uid}/position-unit", Role.VIEW, "unknown_servo")
async def get_position_unit(host: TheHost, servo: TheServo) -> PositionUnitState:
    """Get the unit of positions in Status and ArrayCommand, and its evidence."""
    return present.position_unit(host, servo)


@routes.put("/servos/{uid}/position-unit", Role.CONFIGURE, "unknown_servo", "busy", "lease_held", "invalid_value")
async def set_position_unit(
    host: TheHost, servo: TheServo, body: PositionUnitPut, lease: LeaseHeader = None
) -> PositionUnitState:
    """Set the position unit, or measure it again (null). Nothing is written to the servo."""
    now = host.base.now()
    host.leases.allow_write(lease, now, servo.uid)
    if host.motion.is_commanded(servo.uid):
        raise Busy(
            f"{servo.title} is under command. Changing the unit would change its position. End the command first.",
            cause="unit_change_under_command",
            servo=servo.title,
        )
    host.position_units.force(servo, body.unit, by=host.leases.who(lease, now))
    return present.position_unit(host, servo)
