"""Routes of Improve."""

from typing import TYPE_CHECKING

from pydantic import Field
from starlette.responses import Response

from hornbill.api.addressing import ServoRef
from hornbill.api.dependencies import LeaseHeader, TheHost, TheServo, load_lab
from hornbill.api.routes.motion.lab import STEP_PROBLEMS
from hornbill.api.routes.server.jobs import Wait, job_response, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.fields import Model
from hornbill.domain.improve import Goal, ImproveBounds, ImprovePreview
from hornbill.domain.set_up import SetUp
from hornbill.servo.host import Host

if TYPE_CHECKING:
    from hornbill.lab.improve import Improvements, ImproveRequest

routes = Routes("lab", after=load_lab)

PROBLEMS = (*STEP_PROBLEMS, "not_available")


class Improve(Model):
    """Options of an improvement."""

    goal: Goal = Field(
        default="calm",
        description="calm: no overshoot and no hunting, with a large margin. fast: settles soonest. stiff: highest "
        "holding gain with a phase margin of at least 40°.",
    )
    bounds: ImproveBounds = Field(default_factory=ImproveBounds)
    expert: bool = Field(
        default=False, description="Also change the gains of the speed loop (0x30, 0x31), against the maker's advice."
    )
    note: str = Field(default="", max_length=200, description="Note on other conditions.")
    set_up: SetUp | None = Field(default=None, description="Set-up of the runs. Null for that of the servo.")

    def request(self) -> "ImproveRequest":
        """As the lab takes it."""
        from hornbill.lab.improve import ImproveRequest

        return ImproveRequest(self.goal, self.bounds, self.expert, self.note, self.set_up)


class ImproveSet(Improve):
    """Options of an improvement of several servos in turn."""

    uids: list[ServoRef] = Field(min_length=1, max_length=50, description="Servos, in order.")


@routes.post("/servos/{uid}/improve/plan", Role.VIEW, *PROBLEMS)
async def plan_improve(host: TheHost, servo: TheServo, body: Improve | None = None) -> ImprovePreview:
    """Get what an improvement would move and write, how far and for how long. Only reads."""
    host.connected()
    return await _improvements(host).preview(servo, (body or Improve()).request())


@routes.post("/servos/{uid}/improve", Role.OPERATE, *PROBLEMS, **starts())
async def improve_servo(
    host: TheHost, servo: TheServo, body: Improve | None = None, lease: LeaseHeader = None, wait: Wait = False
) -> Response:
    """Find better gains by measured steps. Requires a lease and torque on. Writes to RAM only; every ending but one
    with better gains restores the previous values and verifies them."""
    host.connected()
    return await job_response(host, _improvements(host).begin(servo, lease, (body or Improve()).request()), wait)


@routes.post("/improve", Role.OPERATE, *PROBLEMS, **starts())
async def improve_servos(host: TheHost, body: ImproveSet, lease: LeaseHeader = None, wait: Wait = False) -> Response:
    """Improve several servos in turn. The result contains each servo's result, the spread, and the outlier."""
    host.connected()
    servos = [host.fleet.get(uid) for uid in body.uids]
    return await job_response(host, _improvements(host).begin_all(servos, lease, body.request()), wait)


def _improvements(host: Host) -> "Improvements":
    from hornbill.lab.improve import Improvements

    return Improvements(host.services, host.motion, host.store, host.compute)
