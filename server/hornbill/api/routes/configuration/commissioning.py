"""Owns the routes of commissioning: which servos look new, and the job that gives them names, ids and values."""

from starlette.responses import Response

from hornbill.api import config_models, present
from hornbill.api.dependencies import LeaseHeader, TheHost
from hornbill.api.routes.server.jobs import Wait, answer, previewed, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.change import SavePreview
from hornbill.servo.runs.commission_request import Wanted
from hornbill.servo.runs.commissioning import CommissionOptions, Planned
from hornbill.units import Uid

routes = Routes("commissioning")

PROBLEMS = (
    "unknown_servo", "unknown_profile", "invalid_value", "out_of_range", "not_in_this_model", "conflict",
    "bus_read_only", "needs_confirmation", "configuration_lost", "torque_on", "busy", "stopped", "lease_held",
    "no_answer", "bus_disconnected",
)  # fmt: skip


@routes.get("/commissioning/candidates", Role.VIEW)
async def list_candidates(host: TheHost) -> config_models.Candidates:
    """Servos on the bus that look new (servo id 0, no label), each with the servo id to give it; and those that still
    wait for a node id.
    """
    return config_models.Candidates(
        servos=[
            config_models.Candidate(servo=present.servo(host, one.servo), servo_id=one.servo_id)
            for one in host.commissioning_jobs.candidates()
        ],
        pending=present.pending(host),
    )


@routes.post("/commissioning", Role.CONFIGURE, *PROBLEMS, **starts(config_models.CommissioningPreview))
async def commission(
    host: TheHost, body: config_models.Commissioning, lease: LeaseHeader = None, wait: Wait = False
) -> Response:
    """Give servos their labels, ids and values, one by one, each all or nothing, saved and proved.

    Everything is checked before the first write. With `identify` each horn wiggles a little first; with `save` each
    servo restarts, and with soft start and torque on in ROM its horn goes slowly to 0 degrees. Asking again for one
    servo does its part again; what it holds already is not written. The job can be resumed, also by another server.

    With `dry_run` every check is done, and nothing else: the answer says of each servo what is written, which rows of
    ROM change and what its horn does.
    """
    host.connected()
    wanted = [Wanted(Uid(one.uid), one.servo_id, one.node_id, one.label.strip()) for one in body.servos]
    options = CommissionOptions(body.profile, body.save, body.identify, body.on_anomaly, body.confirm)
    if body.dry_run:
        planned = await host.commissioning_jobs.plan(wanted, lease, options)
        shown = config_models.CommissioningPreview(servos=[_plan(one) for one in planned])
        return previewed(shown)
    job = host.commissioning_jobs.start(wanted, lease, options)
    return await answer(host, job, wait)


def _plan(one: Planned) -> config_models.CommissionPlan:
    return config_models.CommissionPlan(
        **dict(one.save or SavePreview()),
        uid=one.servo.uid,
        changes=one.changes,
    )
