"""Owns the routes of servos themselves: list, one, nickname, save and restart."""

from fastapi import APIRouter
from starlette.responses import Response

from hornbill.api import PREFIX, config_models, models, present
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.jobs import JOB_ANSWERS, Wait, answer
from hornbill.api.problems import declared, together
from hornbill.servo.configuration import torque_in_rom

router = APIRouter(prefix=PREFIX, tags=["servos"])

SAVE_PROBLEMS = declared("unknown_servo", "no_answer", "busy", "stopped", "lease_held", "bus_disconnected")
SAVE_ANSWERS = together(
    SAVE_PROBLEMS, declared("needs_confirmation", "invalid_value", "configuration_lost", "bus_read_only")
)


@router.get("/servos", operation_id="list_servos", responses=declared("invalid_value"))
async def list_servos(
    host: TheHost,
    node_id: int | None = None,
    servo_id: int | None = None,
    label: str | None = None,
    serial: str | None = None,
) -> list[models.Servo]:
    """Every servo seen since the start. Filters are look-ups: the key of a servo is its uid."""
    found = [present.servo(host, one) for one in host.fleet.all()]
    wanted = {"node_id": node_id, "servo_id": servo_id, "label": label, "serial": serial}
    return [one for one in found if all(want is None or getattr(one, key) == want for key, want in wanted.items())]


@router.get("/servos/{uid}", operation_id="get_servo", responses=declared("unknown_servo"))
async def get_servo(host: TheHost, servo: TheServo) -> models.Servo:
    """One servo."""
    return present.servo(host, servo)


@router.patch("/servos/{uid}", operation_id="label_servo", responses=declared("unknown_servo", "invalid_value"))
async def label_servo(
    host: TheHost, servo: TheServo, body: models.ServoPatch, lease: LeaseHeader = None
) -> models.Servo:
    """Give a servo a nickname; the server keeps it, the servo does not know it."""
    host.set_label(servo, body.label, by=host.leases.who(lease, host.base.now()))
    return present.servo(host, servo)


@router.post(
    "/servos/{uid}/save", operation_id="save_servo", status_code=202, response_model=models.Job,
    responses={**SAVE_ANSWERS, **JOB_ANSWERS},
)  # fmt: skip
async def save_servo(
    host: TheHost,
    servo: TheServo,
    body: config_models.Save | None = None,
    lease: LeaseHeader = None,
    wait: Wait = False,
) -> Response:
    """Write RAM to ROM. The servo restarts; with soft start and torque on in ROM its horn goes slowly to 0 degrees.

    A second save joins the one under way. Where RAM has no torque, and ROM is not known to have none already, it has
    to be confirmed, for the servo would hold nothing after any start; or `torque_on` puts torque into ROM.
    """
    host.connected()
    asked = body or config_models.Save()
    if host.saving.running("save", servo) is None:
        host.saving.check(servo, lease)
        if not asked.torque_on:
            await torque_in_rom.require(host.asker, servo, asked.confirm)
    return await answer(host, host.saving.save(servo, lease, torque_on=asked.torque_on), wait)


@router.post(
    "/servos/{uid}/restart", operation_id="restart_servo", status_code=202, response_model=models.Job,
    responses={**SAVE_PROBLEMS, **JOB_ANSWERS},
)  # fmt: skip
async def restart_servo(host: TheHost, servo: TheServo, lease: LeaseHeader = None, wait: Wait = False) -> Response:
    """Restart. What is only in RAM is lost; with soft start and torque on in ROM the horn goes slowly to 0 degrees."""
    host.connected()
    return await answer(host, host.saving.restart(servo, lease), wait)
