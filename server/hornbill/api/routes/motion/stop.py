"""Routes of stop: stop, state and clear, none of which requires a lease; and restoring outputs."""

from typing import Annotated, ClassVar, Literal

from fastapi import Query
from pydantic import ConfigDict, Field
from starlette.responses import Response

from hornbill.api import present
from hornbill.api.addressing import ServoRef
from hornbill.api.dependencies import LeaseHeader, TheHost
from hornbill.api.routes.server.jobs import Wait, job_response, preview_response, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import LOCAL, Role
from hornbill.domain.fields import DryRun, Model, Short
from hornbill.domain.motion import OutputRestorePreview, Stop, StopMode
from hornbill.servo.runtime.actor import signed
from hornbill.units import Uid

routes = Routes("motion")


class OutputRestore(Model):
    """Outputs to restore."""

    uids: list[ServoRef] | None = Field(
        default=None,
        max_length=250,
        description="Servos. Null: all that are configured on and were switched off by a stop, lease or command.",
    )
    dry_run: DryRun = False
    confirm: list[Literal["load"]] = Field(
        default_factory=list[Literal["load"]],
        description="Confirmation codes of earlier `needs_confirmation` problems.",
    )


class StopRequest(Model):
    """Options of a stop."""

    model_config: ClassVar[ConfigDict] = {**Model.model_config, "defer_build": False}  # a stop waits for nothing

    mode: StopMode = Field(default="off", description="Torque off or brake.")
    reason: Short = Field(default="", description="Reason, shown to users. At most 200 characters are stored.")
    everyone: bool = Field(
        default=False,
        description="As guest, stop all servos on the bus, also those that the autopilot commands. An aircraft then "
        "loses its control surfaces. Without effect as host or observer.",
    )


By = Annotated[str, Query(description="Client that stops, shown to all users. At most 80 characters are stored.")]
WITHIN_S = 0.25
"""POST /stop responds when every servo has confirmed, or after this time. Retries continue in either case."""


@routes.post("/stop", LOCAL, "invalid_value")
async def stop(host: TheHost, body: StopRequest | None = None, by: By = "REST") -> Stop:
    """Stop immediately. Needs no lease, and latches. A repeated request is sent again.

    As host it reaches all servos; as guest, those that hornbill commands unless `everyone`; as observer, none.
    """
    wanted = body or StopRequest()
    host.stop.now(wanted.mode, signed(by), wanted.reason, everyone=wanted.everyone)
    await host.torque_off.acknowledged(WITHIN_S)
    return present.stop(host)


@routes.get("/stop", Role.VIEW)
async def get_stop(host: TheHost) -> Stop:
    """Get the stop latch and the confirmations of the servos."""
    return present.stop(host)


@routes.delete("/stop", Role.OPERATE)
async def clear_stop(host: TheHost, by: By = "REST") -> Stop:
    """Clear a stop. Moves nothing: torque stays off until it is turned on."""
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
    """Restore outputs: switch them on again, one servo at a time, each holding its current angle. Clears a latched stop
    first.

    With a lease the outputs stay on until it ends. Without one, only servos with timeout action hold (0x26) can be
    restored, because the others would switch off again. Horns that may be under load require confirmation. A servo that
    fails stays off and is listed in the result. Stop ends the job immediately.

    `dry_run` performs all checks and returns the servos, with their load and whether they need a lease.
    """
    host.connected()
    wanted = body or OutputRestore()
    uids = None if wanted.uids is None else [Uid(uid) for uid in wanted.uids]
    if wanted.dry_run:
        found = present.output_restore(host, await host.restore_output_jobs.plan(uids, lease))
        return preview_response(found)
    who = signed(by) if lease is None else host.leases.who(lease, host.base.now())
    job = await host.restore_output_jobs.start(uids, lease, by=who, confirm=wanted.confirm)
    return await job_response(host, job, wait)
