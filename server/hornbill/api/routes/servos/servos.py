"""Routes of servos themselves: list, one, nickname and save."""

from typing import Annotated

from fastapi import Query
from pydantic import Field
from starlette.responses import Response

from hornbill.api import present
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.routes.server.jobs import Wait, answer, previewed, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.change import SavePreview
from hornbill.domain.fields import Confirmed, DryRun, Model
from hornbill.domain.servo import Servo
from hornbill.servo.configuration.restart_plan import RestartOptions

routes = Routes("servos")


class ServoPatch(Model):
    """The only thing about a servo that the server itself keeps."""

    label: str = Field(max_length=64, description="Nickname.")


class Save(Model):
    """What a save is asked for with."""

    confirm: Confirmed = Field(default=[])
    torque_on: bool = Field(
        default=False,
        description="ROM is to have torque on, whatever it holds now. Without it, ROM keeps the torque mode it holds.",
    )
    dry_run: DryRun = False


SAVE_ANSWERS = (
    "unknown_servo", "no_response", "busy", "stopped", "lease_held", "bus_disconnected", "needs_confirmation",
    "invalid_value", "configuration_lost", "bus_read_only", "not_in_this_model", "out_of_range", "conflict",
)  # fmt: skip


@routes.get("/servos", Role.VIEW, "invalid_value")
async def list_servos(
    host: TheHost,
    node_id: Annotated[int | None, Query(description="Node ID, 1 to 127.")] = None,
    servo_id: Annotated[int | None, Query(description="Servo ID (0x45). 0 if never set.")] = None,
    label: Annotated[str | None, Query(description="Nickname.")] = None,
    serial: Annotated[
        str | None, Query(description="Serial number as printed on the servo, such as `61-466861`.")
    ] = None,
) -> list[Servo]:
    """Every servo seen since the start. Filters are look-ups: the key of a servo is its uid."""
    found = [present.servo(host, one) for one in host.fleet.all()]
    wanted = {"node_id": node_id, "servo_id": servo_id, "label": label, "serial": serial}
    return [one for one in found if all(want is None or getattr(one, key) == want for key, want in wanted.items())]


@routes.get("/servos/{uid}", Role.VIEW, "unknown_servo")
async def get_servo(host: TheHost, servo: TheServo) -> Servo:
    """One servo."""
    return present.servo(host, servo)


@routes.patch("/servos/{uid}", Role.CONFIGURE, "unknown_servo", "invalid_value")
async def label_servo(host: TheHost, servo: TheServo, body: ServoPatch, lease: LeaseHeader = None) -> Servo:
    """Give a servo a nickname; the server keeps it, the servo does not know it."""
    await host.set_label(servo, body.label, by=host.leases.who(lease, host.base.now()))
    return present.servo(host, servo)


@routes.delete("/servos/{uid}/lost", Role.CONFIGURE, "unknown_servo", "lease_held", status_code=204)
async def dismiss_lost_values(host: TheHost, servo: TheServo, lease: LeaseHeader = None) -> None:
    """Forget the RAM values that the servo lost in a restart. The servo is not told."""
    now = host.base.now()
    host.leases.allow_write(lease, now)
    host.lost_values.dismiss(servo, host.leases.who(lease, now))


@routes.post("/servos/{uid}/save", Role.CONFIGURE, *SAVE_ANSWERS, **starts(SavePreview))
async def save_servo(
    host: TheHost,
    servo: TheServo,
    body: Save | None = None,
    lease: LeaseHeader = None,
    wait: Wait = False,
) -> Response:
    """Write RAM to ROM. The servo restarts; with soft start and torque on in ROM its horn goes slowly to 0 degrees.

    Torque mode (0x20) is the exception: RAM's is session state, so ROM keeps the one it holds, unless another was
    written as configuration. Where that is on and the output is off, it comes on right before the write, and the horn
    is held where it stands until the restart. Where nobody knows what ROM holds it has to be said, by `confirm`.

    A second save joins the one under way. With `dry_run` every check of the save is done, and nothing else: the answer
    says which rows of ROM change and what the horn does.
    """
    host.connected()
    asked = body or Save()
    options = RestartOptions(lease, confirm=asked.confirm, torque_on=asked.torque_on)
    if asked.dry_run:
        return previewed(await host.restarting.plan(servo, "save", options))
    return await answer(host, host.restarting.start(servo, "save", options), wait)
