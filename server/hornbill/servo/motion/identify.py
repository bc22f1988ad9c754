"""The identify job: it shows which horn belongs to a servo, under a lease of the client or one of its own."""

import contextlib

from hornbill.domain.note import Note
from hornbill.errors import ConfigurationLost, HornbillError, Unknown
from hornbill.servo.device import permission
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.identify_motion import STEPS, IdentifyMotion
from hornbill.servo.motion.motion import Motion
from hornbill.servo.motion.motion_control import MotionControl
from hornbill.servo.motion.setpoint_runner import SetpointRunner
from hornbill.servo.runtime.jobs import RunningJob, Step
from hornbill.servo.runtime.leases import HeldLease
from hornbill.store.audit import NewAuditEntry

OWN_TTL_S = 5.0
"""The job says every moment that it is there; nothing it waits for takes longer than 4 s."""


class Identify:
    """Starts identify jobs, each under the lease of who asks for it, or one of its own."""

    def __init__(self, services: HostServices, control: MotionControl, motion: Motion, runner: SetpointRunner) -> None:
        self._services = services
        self._base = services.base
        self._jobs = services.jobs
        self._leases = services.leases
        self._control = control
        self._motion = motion
        self._runner = runner
        self._audit = services.audit

    def identify(self, servo: Servo, lease_id: str | None, *, by: str = "") -> RunningJob:
        """A job of kind "identify" on this servo; a second one joins the first.

        Its result: {"from_deg", "low_deg", "high_deg", "back_deg", "moved"}; a horn that did not move fails it with
        did_not_move. Without `lease_id` it takes a lease of its own for its time. The caller must not hold
        `servo.changing`. Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoResponse, NotInThisModel,
        ConfigurationLost, BusDisconnected; later, as the job's problem, OutOfRange, Refused, UnexpectedResult, too.
        """
        running = self._jobs.running(servo.uid)
        if running is not None and running.kind == "identify":
            return running
        permission.check_free(servo, self._jobs)
        self._motion.stop.check()
        permission.check_ready(servo)
        permission.row_for(servo, "angle")
        if servo.rom_lost:
            raise ConfigurationLost(
                f"{servo.title} could not load what was saved and runs on defaults, so it is not moved. "
                "Restore its configuration and save it first.",
                cause="runs_on_defaults",
                servo=servo.title,
            )
        now = self._base.now()
        if lease_id is None:
            lease = self._control.take(f"identify {servo.title}", OWN_TTL_S)
            by = by or self._leases.who(None, now)
        else:
            lease = self._leases.require(lease_id, now)
            by = by or lease.holder
        own = lease_id is None
        try:
            self._motion.may_move(servo, lease.id)
        except HornbillError:
            self._end(lease, own=own)
            raise
        steps = [Step(name, text) for name, text in STEPS.items()]
        return self._jobs.start("identify", servo.uid, steps, lambda job: self._work(job, servo, lease, own, by))

    async def _work(self, job: RunningJob, servo: Servo, lease: HeldLease, own: bool, by: str) -> dict[str, object]:
        outcome, notes = "cancelled", ()
        try:
            async with servo.changing:
                wiggling = IdentifyMotion(self._services, self._motion, self._runner, job, servo, lease, own=own)
                result = await wiggling.run()
            outcome = "succeeded"
            return result
        except HornbillError as error:
            outcome, notes = "failed", (Note.of(error),)
            raise
        finally:
            self._end(lease, own=own)
            self._audit.note(
                NewAuditEntry(by, "identify", outcome, servo.uid, after=_moved(job), notes=notes, job=job.id)
            )

    def _end(self, lease: HeldLease, *, own: bool) -> None:
        if own:
            with contextlib.suppress(Unknown):  # it ran out: the tick has told that
                self._control.release(lease.id, "job_ended")


def _moved(job: RunningJob) -> bool | None:
    """Whether the horn was seen to move; None when it did not come to that."""
    return None if job.result is None else job.result["moved"] is True
