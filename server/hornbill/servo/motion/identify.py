"""Identify jobs: wiggle the horn of a servo, under the client's lease or one of the job."""

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
"""The job renews its lease continuously; nothing it waits for takes longer than 4 s."""


class Identify:
    """Starts identify jobs, each under the client's lease or one of its own."""

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
        """Start a job of kind "identify" on this servo, or return the running one.

        Its result: {"from_deg", "low_deg", "high_deg", "back_deg", "moved"}; it fails with did_not_move if the horn did
        not move. Without `lease_id` the job takes a lease of its own. The caller must not hold
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
                f"{servo.title} runs on defaults, because its saved configuration could not be loaded. Motion is "
                "refused. Restore its configuration and save it first.",
                cause="runs_on_defaults",
                servo=servo.title,
            )
        now = self._base.now()
        if lease_id is None:
            lease = self._control.take(f"identify {servo.title}", OWN_TTL_S, frozenset([servo.uid]))
            by = by or self._leases.who(None, now)
        else:
            lease = self._leases.require(lease_id, now, servo.uid)
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
            with contextlib.suppress(Unknown):  # it expired, which was already published
                self._control.release(lease.id, "job_ended")


def _moved(job: RunningJob) -> bool | None:
    """Whether the horn was seen to move. None if the job ended before."""
    return None if job.result is None else job.result["moved"] is True
