"""Routes of restart and factory reset: what either would do, a dry run with every check, and the job."""

from typing import Annotated

from fastapi import Query
from pydantic import Field
from starlette.responses import Response

from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.routes.server.jobs import Wait, answer, previewed, starts
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
    """What a restart would change."""

    lost: list[Change] = Field(description="Rows that are in RAM only. `requested` is the value after the restart.")
    restart: Forecast


class FactoryReset(Model):
    """`keep_identity`: 0x44 to 0x46 stay. The result is saved, which restarts the servo."""

    keep_identity: bool = Field(default=True, description="Keep origin, servo ID and node ID.")
    dry_run: DryRun = False


READ_PROBLEMS = ("unknown_servo", "no_response", "bus_disconnected", "invalid_value")
Keep = Annotated[bool, Query(description="Keep origin, servo ID and node ID (0x44 to 0x46).")]


@routes.get("/servos/{uid}/restart-forecast", Role.VIEW, *READ_PROBLEMS, response_model=Forecast)
async def forecast_restart(
    host: TheHost,
    servo: TheServo,
    save: Annotated[bool, Query(description="Save RAM first. false: ROM as it is.")] = False,
    torque_on: Annotated[bool, Query(description="Save with `torque_on`.")] = False,
) -> Forecast:
    """What a restart, or with `save` a save, does to the horn, and what speaks against it. Reads, moves nothing."""
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
    """Restart. What is only in RAM is lost; with soft start and torque on in ROM the horn goes slowly to 0 degrees.

    With `dry_run` every check of the restart is done, and nothing else: the answer says which rows are lost and what
    the horn does.
    """
    host.connected()
    options = RestartOptions(lease)
    if body is None or not body.dry_run:
        return await answer(host, host.restarting.start(servo, "restart", options), wait)
    plan = await host.restarting.plan(servo, "restart", options)
    shown = RestartPreview(
        lost=list(plan.changes),
        restart=plan.restart,
    )
    return previewed(shown)


@routes.get(
    "/servos/{uid}/factory-reset",
    Role.VIEW,
    *READ_PROBLEMS,
    "not_in_this_model",
    response_model=ResetPreview,
)
async def preview_factory_reset(host: TheHost, servo: TheServo, keep_identity: Keep = True) -> ResetPreview:
    """Every row a factory reset would change, what stays, and what its restart does to the horn. Changes nothing."""
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
    """Back to the defaults of the model, in RAM and in ROM. Torque goes off, the servo restarts and its horn goes
    slowly to 0 degrees.

    With `dry_run` every check of the reset is done, and nothing else: the answer is that of GET.
    """
    host.connected()
    wanted = body or FactoryReset()
    options = RestartOptions(lease, keep_identity=wanted.keep_identity)
    if wanted.dry_run:
        return previewed(await host.restarting.plan(servo, "factory_reset", options))
    return await answer(host, host.restarting.start(servo, "factory_reset", options), wait)
