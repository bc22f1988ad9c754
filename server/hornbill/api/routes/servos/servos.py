"""Routes of servos: list, get, nickname and save."""

from typing import Annotated

from fastapi import Query, Request
from pydantic import Field
from starlette.responses import Response

from hornbill.api import present
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo, host_of
from hornbill.api.encoded_servos import encoded_servos
from hornbill.api.paging import Every
from hornbill.api.routes.server.jobs import Wait, job_response, preview_response, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.change import SavePreview
from hornbill.domain.fields import Confirmed, DryRun, Model
from hornbill.domain.servo import Servo
from hornbill.servo.configuration.restart_plan import RestartOptions

routes = Routes("servos")


class ServoPatch(Model):
    """Changes to a servo entry of the server."""

    label: str = Field(max_length=64, description="Nickname.")


class Save(Model):
    """Options of a save."""

    confirm: Confirmed = Field(default=[])
    torque_on: bool = Field(
        default=False,
        description="Write torque on to ROM. Otherwise ROM keeps its torque mode.",
    )
    dry_run: DryRun = False


SAVE_PROBLEMS = (
    "unknown_servo", "no_response", "busy", "stopped", "lease_held", "bus_disconnected", "needs_confirmation",
    "invalid_value", "configuration_lost", "bus_read_only", "not_in_this_model", "out_of_range", "conflict",
)  # fmt: skip


async def _all(request: Request, _body: bytes) -> Response | None:
    if request.scope["query_string"]:
        return None
    host = host_of(request)
    return Response(encoded_servos(request.app.state, host).array(host.fleet.all()), media_type="application/json")


@routes.get("/servos", Role.VIEW, "invalid_value", response_model=list[Servo], direct=_all)
async def list_servos(
    host: TheHost,
    page: Every,
    request: Request,
    response: Response,
    node_id: Annotated[int | None, Query(description="Node ID, 1 to 127.")] = None,
    servo_id: Annotated[int | None, Query(description="Servo ID (0x45). 0 if never set.")] = None,
    label: Annotated[str | None, Query(description="Nickname.")] = None,
    serial: Annotated[
        str | None, Query(description="Serial number as printed on the servo, such as `61-466861`.")
    ] = None,
) -> Response:
    """List the servos seen since the start. Filters are for lookup; a servo is identified by its unique ID."""
    given = {"node_id": node_id, "servo_id": servo_id, "label": label, "serial": serial}
    wanted = {key: want for key, want in given.items() if want is not None}
    found = [one for one in host.fleet.all() if all(getattr(one, key) == want for key, want in wanted.items())]
    content = encoded_servos(request.app.state, host).array(page.of(found, lambda one: one.uid))
    return Response(content, headers=dict(response.headers), media_type="application/json")


@routes.get("/servos/{uid}", Role.VIEW, "unknown_servo")
async def get_servo(host: TheHost, servo: TheServo) -> Servo:
    """Get a servo."""
    return present.servo(host, servo)


@routes.patch("/servos/{uid}", Role.CONFIGURE, "unknown_servo", "invalid_value")
async def label_servo(host: TheHost, servo: TheServo, body: ServoPatch, lease: LeaseHeader = None) -> Servo:
    """Set the nickname of a servo, which is stored on the server only."""
    await host.set_label(servo, body.label, by=host.leases.who(lease, host.base.now()))
    return present.servo(host, servo)


@routes.delete("/servos/{uid}/lost", Role.CONFIGURE, "unknown_servo", "lease_held", status_code=204)
async def dismiss_lost_values(host: TheHost, servo: TheServo, lease: LeaseHeader = None) -> None:
    """Dismiss the RAM values that the servo lost in a restart. Sends nothing to the servo."""
    now = host.base.now()
    host.leases.allow_write(lease, now, servo.uid)
    host.lost_values.dismiss(servo, host.leases.who(lease, now))


@routes.post("/servos/{uid}/save", Role.CONFIGURE, *SAVE_PROBLEMS, **starts(SavePreview))
async def save_servo(
    host: TheHost,
    servo: TheServo,
    body: Save | None = None,
    lease: LeaseHeader = None,
    wait: Wait = False,
) -> Response:
    """Write RAM to ROM. The servo restarts; with soft start, and torque on in ROM, its horn moves slowly to 0°.

    Torque mode (0x20) is an exception: its RAM value is session state, so ROM keeps its value unless another was
    written as configuration. If that value is on and the output is off, the output is switched on right before the
    write, and the horn is held at its current angle until the restart. If the ROM value is unknown, choose one with
    `confirm`.

    A second save joins the running one. `dry_run` performs all checks and returns the rows of ROM that would change and
    the effect on the horn.
    """
    host.connected()
    wanted = body or Save()
    options = RestartOptions(lease, confirm=wanted.confirm, torque_on=wanted.torque_on)
    if wanted.dry_run:
        return preview_response(await host.restarting.plan(servo, "save", options))
    return await job_response(host, host.restarting.start(servo, "save", options), wait)
