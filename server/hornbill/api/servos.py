"""Owns the routes of servos themselves: list, one, nickname, save and restart."""

from typing import Literal

from fastapi import APIRouter
from starlette.responses import Response

from hornbill.api import models, present
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo
from hornbill.api.jobs import JOB_ANSWERS, Wait, answer
from hornbill.api.problems import declared

router = APIRouter(tags=["servos"])

SAVE_PROBLEMS = declared("unknown_servo", "no_answer", "busy", "stopped", "lease_held", "bus_disconnected")


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


def _job_route(kind: Literal["save", "restart"], text: str) -> None:
    async def start(host: TheHost, servo: TheServo, lease: LeaseHeader = None, wait: Wait = False) -> Response:
        host.connected()
        begin = host.saving.save if kind == "save" else host.saving.restart
        return await answer(host, begin(servo, lease), wait)

    router.add_api_route(
        f"/servos/{{uid}}/{kind}", start, methods=["POST"], operation_id=f"{kind}_servo", status_code=202,
        response_model=models.Job, summary=f"{kind.capitalize()} servo", description=text,
        responses={**SAVE_PROBLEMS, **JOB_ANSWERS},
    )  # fmt: skip


_job_route(
    "save",
    "Write RAM to ROM. The servo restarts; with soft start and torque on in ROM its horn goes slowly to 0 degrees. "
    "A second save joins the one under way.",
)
_job_route(
    "restart",
    "Restart. What is only in RAM is lost; with soft start and torque on in ROM the horn goes slowly to 0 degrees.",
)
