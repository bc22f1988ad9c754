"""The route that lets a horn wiggle, to show which servo it is."""

from starlette.responses import Response

from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.routes.server.jobs import Wait, answer, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role

routes = Routes("motion")

PROBLEMS = (
    "unknown_servo", "not_in_this_model", "busy", "configuration_lost", "stopped", "lease_required", "lease_held",
    "no_response", "bus_disconnected",
)  # fmt: skip


@routes.post("/servos/{uid}/identify", Role.OPERATE, *PROBLEMS, **starts())
async def identify_servo(host: TheHost, servo: TheServo, lease: LeaseHeader = None, wait: Wait = False) -> Response:
    """Turn the horn slowly by 3 degrees to either side, twice, and back. Torque is afterwards what it was before.

    Under the lease of the header, or, while nobody holds one, under one of its own for the time it takes.
    """
    host.connected()
    return await answer(host, host.wiggle.identify(servo, lease), wait)
