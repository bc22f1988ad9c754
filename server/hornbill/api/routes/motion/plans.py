"""Route of test plans: dry run and start. Jobs show their progress, `/jobs/{job_id}/report` their results."""

import tomllib
from collections.abc import Mapping
from typing import Annotated

from pydantic import BeforeValidator, Field
from starlette.responses import Response

from hornbill.api import present
from hornbill.api.addressing import resolve
from hornbill.api.dependencies import LeaseHeader, TheHost
from hornbill.api.routes.motion.motion import MOTION_PROBLEMS
from hornbill.api.routes.server.jobs import Wait, job_response, preview_response, starts
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.fields import Confirmed, DryRun, Model
from hornbill.domain.plan import PlanPreview, RunPlan
from hornbill.errors import Conflict
from hornbill.servo.runtime.actor import signed
from hornbill.units import Uid

routes = Routes("motion")


def _read(plan: object) -> object:
    """Contents of a plan file. Raises ValueError."""
    if not isinstance(plan, str):
        return plan
    try:
        return tomllib.loads(plan.removeprefix("\ufeff"))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ValueError(f"The file is not TOML: {error}.") from None


class PlanStart(Model):
    """A test plan to run."""

    plan: Annotated[RunPlan, BeforeValidator(_read, json_schema_input_type=RunPlan | str)] = Field(
        description="Test plan, or the text of a plan file (TOML)."
    )
    dry_run: DryRun = False
    confirm: Confirmed = Field(default=[])
    by: str = Field(default="REST", max_length=64, description="Client that starts it, for the record.")


@routes.post("/plans", Role.CONFIGURE, *MOTION_PROBLEMS, "unknown_profile", "conflict", **starts(PlanPreview))
async def run_plan(host: TheHost, body: PlanStart, lease: LeaseHeader = None, wait: Wait = False) -> Response:
    """Run a test plan: turns torque on, moves servos in cycles while limits are checked, and turns torque off.

    The job takes the lease itself, so the run does not depend on the client. If you have the lease, it is released. The
    job is resumable.
    """
    host.connected()
    uids = {name: resolve(host, name) for name in body.plan.servos}
    _check_different(uids)
    if body.dry_run:
        return preview_response(present.plan(body.plan, await host.plan_jobs.preview(body.plan, uids, body.confirm)))
    job = host.plan_jobs.start(body.plan, uids, lease, body.confirm, by=signed(body.by))
    return await job_response(host, job, wait)


def _check_different(uids: Mapping[str, Uid]) -> None:
    if len(set(uids.values())) < len(uids):
        raise Conflict("Two names of the plan are the same servo. List each servo once.", cause="duplicate_servo")
