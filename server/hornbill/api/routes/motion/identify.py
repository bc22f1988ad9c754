"""Route that wiggles a horn to identify the servo."""

from starlette.responses import Response

from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.routes.server.jobs import Wait, job_response, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role

routes = Routes("motion")

PROBLEMS = (
    "unknown_servo", "not_in_this_model", "busy", "configuration_lost", "stopped", "lease_required", "lease_held",
    "commanded_elsewhere", "no_response", "bus_disconnected",
)  # fmt: skip


@routes.post("/servos/{uid}/identify", Role.OPERATE, *PROBLEMS, **starts())
async def identify_servo(host: TheHost, servo: TheServo, lease: LeaseHeader = None, wait: Wait = False) -> Response:
    """Wiggle the horn: turn it slowly 3° to either side, twice, and back. Torque mode is restored afterwards.

    Uses the given lease or, if no client has one, a lease of its own for the duration.
    """
    host.connected()
    return await job_response(host, host.wiggle.identify(servo, lease), wait)
