"""Jobs of kind "plan": start, dry run and resumption of test plans."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

from hornbill.domain.motion import Caution
from hornbill.domain.plan import RunPlan
from hornbill.errors import HornbillError
from hornbill.servo.configuration.changes import Changes
from hornbill.servo.configuration.record import ServoRecord
from hornbill.servo.device import permission
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.motion import Motion
from hornbill.servo.motion.motion_control import MotionControl
from hornbill.servo.profiles.profiles import Profiles
from hornbill.servo.runs.plan_run import PlanRequest, PlanRun, PlanTarget, StepCount, plan_steps
from hornbill.servo.runs.plan_steps import LEASE_S, PlanSteps
from hornbill.servo.runtime.jobs import RunningJob, Work
from hornbill.store.tables import Json
from hornbill.units import Uid


@dataclass(slots=True)
class PlanProspect:
    """Result of a dry run for one servo. `problem`: reason why it would not run."""

    servo: Servo
    cautions: Sequence[Caution] = field(default_factory=tuple[Caution, ...])
    problem: HornbillError | None = None


class PlanJobs:
    """Starts and resumes jobs of kind "plan", each under a lease of its own.

    The lease makes a run independent of its client: it continues without one. Another client can take motion control as
    from any holder, which ends the run.
    """

    def __init__(
        self,
        services: HostServices,
        fleet: Fleet,
        motion: Motion,
        control: MotionControl,
        profiles: Profiles,
        changes: Changes,
        steps: PlanSteps,
    ) -> None:
        self._services = services
        self._jobs = services.jobs
        self._fleet = fleet
        self._motion = motion
        self._control = control
        self._profiles = profiles
        self._changes = changes
        self._steps = steps

    def start(
        self, plan: RunPlan, uids: Mapping[str, Uid], lease_id: str | None, confirm: Sequence[str], *, by: str
    ) -> RunningJob:
        """Start a plan. `uids`: servos by name, as named in the plan. Nothing is sent before all is checked.

        `lease_id`: lease of the client, which is released first.

        The job's result has `servos`, one entry each, with counts by step and exceeded limits. It fails with
        unexpected_result if a limit was exceeded. Raises Unknown (servo, profile), Busy, Stopped, LeaseHeld,
        NoResponse, OutOfRange, InvalidValue, NotInThisModel, NeedsConfirmation, ConfigurationLost, CommandedElsewhere.
        """
        profile = None if plan.profile is None else self._profiles.get(plan.profile)
        request = PlanRequest(plan, uids, profile, tuple(confirm), by)
        targets = self._targets(request)
        for target in targets:
            self._check(request, target.name, target.servo)
        work = self._work(request, targets, lease_id, None)
        steps = plan_steps(targets, plan, profile=profile is not None)
        return self._jobs.start("plan", None, steps, work, cast("Mapping[str, Json]", request.document()))

    async def preview(self, plan: RunPlan, uids: Mapping[str, Uid], confirm: Sequence[str]) -> list[PlanProspect]:
        """Dry run of `start`, servo by servo. Sends only reads. Raises Unknown, LeaseHeld."""
        profile = None if plan.profile is None else self._profiles.get(plan.profile)
        self._services.leases.allow_write(None, self._services.base.now(), *uids.values())
        request = PlanRequest(plan, uids, profile, tuple(confirm), "")
        return [await self._prospect(request, name) for name in plan.servos]

    async def _prospect(self, request: PlanRequest, name: str) -> PlanProspect:
        found = PlanProspect(self._fleet.get(request.uids[name]))
        try:
            await self._motion.freshen(found.servo, "angle")
            if request.profile is None:
                found.cautions = self._steps.check_commands(request.plan, name, found.servo)
            self._check(request, name, found.servo)
            self._motion.check_energise(found.servo)
        except HornbillError as problem:
            found.problem = problem
        return found

    def resumer(self, job: RunningJob) -> Work:
        """Resume a run at the step after the last completed one, with a new lease. Raises as `start`.

        The profile is written again, and torque is turned on again. Counts and exceeded limits are kept.
        """
        assert job.request is not None
        request = PlanRequest.from_document(job.request)
        targets = self._targets(request)
        work = self._work(request, targets, job.lease_id, job.result)
        job.steps[:] = plan_steps(targets, request.plan, profile=request.profile is not None)
        return work

    def _targets(self, request: PlanRequest) -> list[PlanTarget]:
        servos = {name: self._fleet.get(request.uids[name]) for name in request.plan.servos}
        self._jobs.check_apart([one.uid for one in servos.values()])
        self._motion.stop.check()
        targets: list[PlanTarget] = []
        for place, (name, servo) in enumerate(servos.items(), start=1):
            permission.check_free(servo, self._jobs)
            counts = [StepCount(step=number, do=one.do) for number, one in enumerate(request.plan.steps, start=1)]
            target = PlanTarget(
                record=ServoRecord(servo.uid, by=request.by), place=place, name=name, servo=servo, counts=counts
            )
            target.record.identify(servo)
            targets.append(target)
        return targets

    def _check(self, request: PlanRequest, name: str, servo: Servo) -> None:
        """Check the profile, or else the commands, which a profile may permit or forbid."""
        permission.check_movable(servo)
        if request.profile is not None:
            values, _left_out = self._profiles.values_for(request.profile, servo)
            self._changes.plan(servo, values, confirm=request.confirm)
        else:
            self._steps.check_confirmed(request.plan, name, servo, request.confirm)

    def _work(
        self,
        request: PlanRequest,
        targets: Sequence[PlanTarget],
        lease_id: str | None,
        stored: Mapping[str, Any] | None,
    ) -> Work:
        """Take the lease, and return the work under it. Raises what refuses motion, and then releases it."""
        if lease_id is not None:
            self._services.leases.require(lease_id, self._services.base.now())
            self._control.release(lease_id, "released")
        uids = frozenset(target.uid for target in targets)
        lease = self._control.take(f"plan {request.plan.name}"[:64], LEASE_S, uids)
        try:
            for target in targets:
                self._motion.may_move(target.servo, lease.id)
        except HornbillError:
            self._control.release(lease.id, "job_ended")
            raise

        async def work(job: RunningJob) -> dict[str, object]:
            run = PlanRun(job=job, targets=targets, request=request, lease=lease)
            if stored is not None and "next" in stored:
                run.restore(stored)
            return await run.work(self._steps.execute(run))

        return work
