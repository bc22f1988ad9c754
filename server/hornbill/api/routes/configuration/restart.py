"""Routes of restart and factory reset: forecast, dry run and job."""

from typing import Annotated

from fastapi import Query
from pydantic import Field
from starlette.responses import Response

from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.routes.server.jobs import Wait, job_response, preview_response, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.change import Change, Forecast, ResetPreview
from hornbill.domain.fields import DryRun, Model
from hornbill.servo.configuration.forecast import forecast
from hornbill.servo.configuration.restart_plan import RestartOptions, saved_by
from hornbill.servo.device.identification import read_rows
from hornbill.servo.device.output import KEY, ON
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host

routes = Routes("configuration")


class Restart(Model):
    """Options of a restart."""

    dry_run: DryRun = False


class RestartPreview(Model):
    """Effect of a restart."""

    lost: list[Change] = Field(description="Rows that are in RAM only. `requested` is the value after the restart.")
    restart: Forecast


class FactoryReset(Model):
    """Options of a factory reset."""

    keep_identity: bool = Field(default=True, description="Keep origin, servo ID and node ID (0x44 to 0x46).")
    dry_run: DryRun = False


READ_PROBLEMS = ("unknown_servo", "no_response", "bus_disconnected", "invalid_value")
Keep = Annotated[bool, Query(description="Keep origin, servo ID and node ID (0x44 to 0x46).")]


@routes.get("/servos/{uid}/restart-forecast", Role.VIEW, *READ_PROBLEMS, response_model=Forecast)
async def forecast_restart(
    host: TheHost,
    servo: TheServo,
    save: Annotated[
        bool, Query(description="Forecast for a save followed by the restart. false: restart without save.")
    ] = False,
    torque_on: Annotated[bool, Query(description="Save with `torque_on`.")] = False,
) -> Forecast:
    """Forecast the effect of a restart, or with `save` of a save, on the horn, with warnings. Moves nothing."""
    host.connected()
    await _read(host, servo)
    saved = saved_by(servo, ON if torque_on else servo.configured(KEY)) if save else None
    return forecast(servo, saved)


async def _read(host: Host, servo: Servo) -> None:
    await read_rows(host.requests, servo, servo.before_restart)


@routes.post(
    "/servos/{uid}/restart",
    Role.CONFIGURE,
    "unknown_servo",
    "no_response",
    "busy",
    "stopped",
    "lease_held",
    "bus_disconnected",
    "invalid_value",
    **starts(RestartPreview),
)
async def restart_servo(
    host: TheHost,
    servo: TheServo,
    body: Restart | None = None,
    lease: LeaseHeader = None,
    wait: Wait = False,
) -> Response:
    """Restart a servo. Values that are only in RAM are lost; with soft start, and torque on in ROM, the horn moves
    slowly to 0°.

    `dry_run` performs all checks and returns the rows that would be lost and the effect on the horn.
    """
    host.connected()
    options = RestartOptions(lease)
    if body is None or not body.dry_run:
        return await job_response(host, host.restarting.start(servo, "restart", options), wait)
    plan = await host.restarting.plan(servo, "restart", options)
    shown = RestartPreview(
        lost=list(plan.changes),
        restart=plan.restart,
    )
    return preview_response(shown)


@routes.get(
    "/servos/{uid}/factory-reset",
    Role.VIEW,
    *READ_PROBLEMS,
    "not_in_this_model",
    response_model=ResetPreview,
)
async def preview_factory_reset(host: TheHost, servo: TheServo, keep_identity: Keep = True) -> ResetPreview:
    """Preview a factory reset: the rows that would change, those that would stay, and the effect on the horn."""
    host.connected()
    return await host.restarting.preview_reset(servo, keep_identity=keep_identity)


@routes.post(
    "/servos/{uid}/factory-reset",
    Role.CONFIGURE,
    "unknown_servo",
    "not_in_this_model",
    "no_response",
    "busy",
    "stopped",
    "lease_held",
    "bus_disconnected",
    "invalid_value",
    "out_of_range",
    **starts(ResetPreview),
)
async def factory_reset(
    host: TheHost,
    servo: TheServo,
    body: FactoryReset | None = None,
    lease: LeaseHeader = None,
    wait: Wait = False,
) -> Response:
    """Reset a servo to the defaults of its model, in RAM and ROM. Torque goes off, the servo restarts and its horn
    moves slowly to 0°.

    `dry_run` performs all checks and returns the same preview as GET.
    """
    host.connected()
    wanted = body or FactoryReset()
    options = RestartOptions(lease, keep_identity=wanted.keep_identity)
    if wanted.dry_run:
        return preview_response(await host.restarting.plan(servo, "factory_reset", options))
    return await job_response(host, host.restarting.start(servo, "factory_reset", options), wait)
