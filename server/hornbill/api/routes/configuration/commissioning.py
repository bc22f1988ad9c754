"""Routes of commissioning: candidates, and the job that sets labels, IDs and values."""

from pydantic import Field
from starlette.responses import Response

from hornbill.api import present
from hornbill.api.addressing import ServoRef
from hornbill.api.dependencies import LeaseHeader, TheHost
from hornbill.api.routes.server.jobs import Wait, job_response, preview_response, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.bus import PendingAllocation
from hornbill.domain.change import Change, SavePreview
from hornbill.domain.fields import DryRun, Model, OnAnomaly, SafetyConfirm, SaveAfter, UidField
from hornbill.domain.servo import Servo
from hornbill.servo.runs.commission_request import Wanted
from hornbill.servo.runs.commissioning import CommissionOptions, Planned
from hornbill.units import Uid

routes = Routes("commissioning")


class Candidate(Model):
    """A servo that appears to be new (servo ID 0, no label)."""

    servo: Servo
    servo_id: int | None = Field(description="Next free servo ID. Null if none is free.")


class Candidates(Model):
    """Servos to commission, by serial number, and nodes waiting for a node ID."""

    servos: list[Candidate] = Field(description="One entry per servo.")
    pending: list[PendingAllocation] = Field(description="Nodes that still wait for a node ID.")


class CommissionServo(Model):
    """Settings of one servo. Null and "" keep the current value."""

    uid: ServoRef
    servo_id: int | None = Field(default=None, ge=1, le=254, description="Servo ID (0x45), 1 to 254. Null to keep it.")
    node_id: int | None = Field(
        default=None, ge=0, le=125, description="Static node ID. 0 for dynamic. Null to keep it."
    )
    label: str = Field(default="", max_length=64, description="Nickname.")


class Commissioning(Model):
    """Servos to commission, in this order."""

    servos: list[CommissionServo] = Field(min_length=1, max_length=125, description="Servos to commission.")
    profile: str | None = Field(default=None, description="Name of the profile to apply to all servos. Null for none.")
    save: SaveAfter = True
    identify: bool = Field(default=False, description="Wiggle each horn before the servo gets its identity.")
    on_anomaly: OnAnomaly = Field(
        default="stop",
        description="After the first servo with an unexpected result: stop, leaving the remaining servos unchanged, or "
        "continue.",
    )
    confirm: SafetyConfirm
    dry_run: DryRun = False


class CommissionPlan(SavePreview):
    """Effect of commissioning on one servo."""

    uid: UidField
    changes: list[Change] = Field(description="Rows to write.")


class CommissioningPreview(Model):
    """Effect of commissioning, in the order of the request."""

    servos: list[CommissionPlan] = Field(description="One entry per servo.")


PROBLEMS = (
    "unknown_servo", "unknown_profile", "invalid_value", "out_of_range", "not_in_this_model", "conflict",
    "bus_read_only", "needs_confirmation", "configuration_lost", "torque_on", "busy", "stopped", "lease_held",
    "no_response", "bus_disconnected",
)  # fmt: skip


@routes.get("/commissioning/candidates", Role.VIEW)
async def list_candidates(host: TheHost) -> Candidates:
    """List servos that appear to be new (servo ID 0, no label), each with the next free servo ID, and nodes waiting for
    a node ID.
    """
    return Candidates(
        servos=[
            Candidate(servo=present.servo(host, one.servo), servo_id=one.servo_id)
            for one in host.commissioning_jobs.candidates()
        ],
        pending=present.pending(host),
    )


@routes.post("/commissioning", Role.CONFIGURE, *PROBLEMS, **starts(CommissioningPreview))
async def commission(host: TheHost, body: Commissioning, lease: LeaseHeader = None, wait: Wait = False) -> Response:
    """Commission servos: set labels, IDs and values one servo at a time, each all or nothing, then save and verify.

    Everything is checked before the first write. With `identify` each horn wiggles first. With `save` each servo
    restarts; with soft start, and torque on in ROM, its horn moves slowly to 0°. Repeating the request is safe: values
    that a servo already has are not written. The job can be resumed, also by another server.

    `dry_run` performs all checks and returns, for each servo, the writes, the rows of ROM that would change and the
    effect on its horn.
    """
    host.connected()
    wanted = [Wanted(Uid(one.uid), one.servo_id, one.node_id, one.label.strip()) for one in body.servos]
    options = CommissionOptions(body.profile, body.save, body.identify, body.on_anomaly, body.confirm)
    if body.dry_run:
        planned = await host.commissioning_jobs.plan(wanted, lease, options)
        shown = CommissioningPreview(servos=[_plan(one) for one in planned])
        return preview_response(shown)
    job = host.commissioning_jobs.start(wanted, lease, options)
    return await job_response(host, job, wait)


def _plan(one: Planned) -> CommissionPlan:
    return CommissionPlan(
        **dict(one.save or SavePreview()),
        uid=one.servo.uid,
        changes=one.changes,
    )
