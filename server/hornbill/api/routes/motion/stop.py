"""Routes of stop: press it, look at it, clear it, none of which asks for a lease; and restore what it switched off."""

from typing import Annotated, Literal

from fastapi import Query
from pydantic import Field
from starlette.responses import Response

from hornbill.api import present
from hornbill.api.dependencies import LeaseHeader, TheHost
from hornbill.api.routes.server.jobs import Wait, answer, previewed, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import HERE, Role
from hornbill.domain.fields import DryRun, Model, Short, UidField
from hornbill.domain.motion import OutputRestorePreview, Stop, StopMode
from hornbill.servo.runtime.actor import signed
from hornbill.units import Uid

routes = Routes("motion")


class OutputRestore(Model):
    """Which outputs to switch on again."""

    uids: list[UidField] | None = Field(
        default=None,
        max_length=250,
        description="Servos, unique IDs. Null: all that are configured on and were switched off by a "
        "stop, lease or command.",
    )
    dry_run: DryRun = False
    confirm: list[Literal["load"]] = Field(
        default_factory=list[Literal["load"]],
        description="Confirmation codes of earlier `needs_confirmation` problems.",
    )


class StopRequest(Model):
    """Stop everything now."""

    mode: StopMode = Field(default="off", description="Torque off or brake.")
    reason: Short = Field(default="", description="200 characters of it are kept")


By = Annotated[str, Query(description="Client that stops, shown to all users. At most 80 characters are stored.")]
WITHIN_S = 0.25
"""POST /stop answers when every servo has confirmed, or after this long; it goes on repeating all the same."""


@routes.post("/stop", HERE, "invalid_value")
async def stop(host: TheHost, body: StopRequest | None = None, by: By = "REST") -> Stop:
    """Stop every servo now: needs no lease, waits for nothing, latches. Pressing again sends again."""
    wanted = body or StopRequest()
    host.stop.now(wanted.mode, signed(by), wanted.reason)
    await host.torque_off.acknowledged(WITHIN_S)
    return present.stop(host)


@routes.get("/stop", Role.VIEW)
async def get_stop(host: TheHost) -> Stop:
    """The stop latch, and which servos have confirmed."""
    return present.stop(host)


@routes.delete("/stop", Role.OPERATE)
async def clear_stop(host: TheHost, by: By = "REST") -> Stop:
    """Unlatch. Moves nothing and turns nothing on: torque stays off until it is turned on."""
    host.stop.clear(signed(by))
    return present.stop(host)


@routes.post(
    "/stop/restore",
    Role.OPERATE,
    "unknown_servo",
    "invalid_value",
    "busy",
    "lease_required",
    "lease_held",
    "needs_confirmation",
    "bus_disconnected",
    **starts(OutputRestorePreview),
)
async def restore_output(
    host: TheHost,
    body: OutputRestore | None = None,
    lease: LeaseHeader = None,
    by: By = "REST",
    wait: Wait = False,
) -> Response:
    """Switch outputs on again, servo by servo, each held where its horn stands; a latched stop is cleared first.

    With a lease the servos are kept on under it, and are off when it ends. Without one only servos whose own timeout
    holds (0x26) can be restored: the others would let go again. Horns that may carry a load have to be confirmed. A
    servo that fails stays off and is named in the result; Stop ends the job at once. With `dry_run` every check of the
    lease, the stop and each servo is done, and nothing else: the answer names who carries a load or needs a lease.
    """
    host.connected()
    wanted = body or OutputRestore()
    uids = None if wanted.uids is None else [Uid(uid) for uid in wanted.uids]
    if wanted.dry_run:
        found = present.output_restore(host, await host.restore_output_jobs.plan(uids, lease))
        return previewed(found)
    who = signed(by) if lease is None else host.leases.who(lease, host.base.now())
    job = await host.restore_output_jobs.start(uids, lease, by=who, confirm=wanted.confirm)
    return await answer(host, job, wait)
