"""Owns the routes of what a restart does and of the factory reset: what would happen first, then the job."""

from typing import Annotated

from fastapi import APIRouter, Query
from starlette.responses import Response

from hornbill.api import PREFIX, config_models, models
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.jobs import JOB_ANSWERS, Wait, answer
from hornbill.api.problems import declared, together
from hornbill.servo.configuration.forecast import forecast
from hornbill.servo.identification import read_rows

router = APIRouter(prefix=PREFIX, tags=["configuration"])

READ_PROBLEMS = declared("unknown_servo", "no_answer", "bus_disconnected", "invalid_value")
Keep = Annotated[bool, Query(description="origin, servo id and node id (0x44 to 0x46) stay")]


@router.get(
    "/servos/{uid}/restart-forecast",
    operation_id="forecast_restart",
    response_model=config_models.Forecast,
    responses=READ_PROBLEMS,
)
async def forecast_restart(
    host: TheHost,
    servo: TheServo,
    save: Annotated[bool, Query(description="RAM is saved first; false: ROM as it is")] = False,
    torque_on: Annotated[bool, Query(description="the save is to be with `torque_on`")] = False,
) -> config_models.Forecast:
    """What a restart, or with `save` a save, does to the horn, and what speaks against it. Reads, moves nothing."""
    host.connected()
    live = ("current_angle", "current_voltage", "fault_warning")
    rows = (key for key, one in servo.registers.items() if key in live or one.parameter.rom)
    await read_rows(host.asker, servo, list(rows))
    return config_models.Forecast.model_validate(forecast(servo, as_saved=save, torque_on=torque_on))


@router.get(
    "/servos/{uid}/factory-reset",
    operation_id="preview_factory_reset",
    response_model=config_models.ResetPreview,
    responses=together(READ_PROBLEMS, declared("not_in_this_model")),
)
async def preview_factory_reset(
    host: TheHost, servo: TheServo, keep_identity: Keep = True
) -> config_models.ResetPreview:
    """Every row a factory reset would change, what stays, and what its restart does to the horn. Changes nothing."""
    host.connected()
    preview = await host.resetting.preview(servo, keep_identity=keep_identity)
    return config_models.ResetPreview(
        changes=[models.Change.model_validate(one) for one in preview.changes],
        kept=preview.kept,
        restart=config_models.Forecast.model_validate(preview.restart),
    )


@router.post(
    "/servos/{uid}/factory-reset",
    operation_id="factory_reset",
    status_code=202,
    response_model=models.Job,
    responses={
        **declared(
            "unknown_servo", "not_in_this_model", "no_answer", "busy", "stopped", "lease_held", "bus_disconnected",
            "invalid_value",
        ),
        **JOB_ANSWERS,
    },
)  # fmt: skip
async def factory_reset(
    host: TheHost,
    servo: TheServo,
    body: config_models.FactoryReset | None = None,
    lease: LeaseHeader = None,
    wait: Wait = False,
) -> Response:
    """Back to the defaults of the model, in RAM and in ROM. Torque goes off, the servo restarts and its horn goes
    slowly to 0 degrees; GET says beforehand what changes."""
    host.connected()
    wanted = body or config_models.FactoryReset()
    return await answer(host, host.resetting.start(servo, lease, keep_identity=wanted.keep_identity), wait)
