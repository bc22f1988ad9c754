"""Owns Wiggle: the job that shows a person which horn belongs to a servo, and the lease it moves it under."""

import contextlib

from hornbill.errors import ConfigurationLost, HornbillError, Unknown
from hornbill.servo import permission
from hornbill.servo.asking import Asker
from hornbill.servo.configuration.audit import Audit
from hornbill.servo.hub import Hub, LeaseChanged
from hornbill.servo.jobs import Job, Jobs, Step
from hornbill.servo.leases import Lease, Leases
from hornbill.servo.motion import Motion
from hornbill.servo.servo import Servo
from hornbill.servo.stop import Stop
from hornbill.servo.timebase import TimeBase
from hornbill.servo.wiggling import STEPS, Wiggling
from hornbill.store.audit import Entry

OWN_TTL_S = 5.0
"""The job says every moment that it is there; nothing it waits for takes longer than 4 s."""


class Wiggle:
    """Starts identify jobs, each under the lease of who asks for it, or one of its own."""

    def __init__(
        self,
        asker: Asker,
        hub: Hub,
        base: TimeBase,
        jobs: Jobs,
        leases: Leases,
        motion: Motion,
        stop: Stop,
        audit: Audit,
    ) -> None:
        self._asker = asker
        self._hub = hub
        self._base = base
        self._jobs = jobs
        self._leases = leases
        self._motion = motion
        self._stop = stop
        self._audit = audit

    def identify(self, servo: Servo, lease_id: str | None, *, by: str = "") -> Job:
        """A job of kind "identify" on this servo; a second one joins the first.

        Its result: {"from_deg", "low_deg", "high_deg", "back_deg", "moved"}; a horn that did not move fails it with
        did_not_move. Without `lease_id` it takes a lease of its own for its time. The caller must not hold
        `servo.changing`. Raises Stopped, LeaseRequired, LeaseHeld, Busy, NoAnswer, NotInThisModel,
        ConfigurationLost, BusDisconnected; later, as the job's problem, OutOfRange, Refused, NotAsWanted, too.
        """
        running = self._jobs.running(servo.uid)
        if running is not None and running.kind == "identify":
            return running
        self._jobs.check_free(servo)
        self._stop.check()
        permission.check_ready(servo)
        permission.row_for(servo, "angle")
        if servo.rom_lost:
            raise ConfigurationLost(
                f"{servo.title} could not load what was saved and runs on defaults, so it is not moved. "
                "Restore its configuration and save it first."
            )
        now = self._base.now()
        if lease_id is None:
            lease = self._leases.grant(f"identify {servo.title}", OWN_TTL_S, now)
            self._hub.tell(LeaseChanged())
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

    async def _work(self, job: Job, servo: Servo, lease: Lease, own: bool, by: str) -> dict[str, object]:
        outcome, detail = "cancelled", ""
        try:
            async with servo.changing:
                wiggling = Wiggling(
                    self._asker,
                    self._hub,
                    self._base,
                    self._leases,
                    self._motion,
                    self._stop,
                    job,
                    servo,
                    lease,
                    own=own,
                )
                result = await wiggling.run()
            outcome = "succeeded"
            return result
        except HornbillError as error:
            outcome, detail = "failed", error.detail
            raise
        finally:
            self._end(lease, own=own)
            self._audit.note(Entry(by, "identify", outcome, servo.uid, after=_moved(job), detail=detail, job=job.id))

    def _end(self, lease: Lease, *, own: bool) -> None:
        if own:
            with contextlib.suppress(Unknown):  # it ran out: the tick has told that
                self._leases.release(lease.id, self._base.now())
                self._motion.lease_ended(lease, f"{lease.holder} ended.")


def _moved(job: Job) -> bool | None:
    """Whether the horn was seen to move; None when it did not come to that."""
    return None if job.result is None else job.result["moved"] is True
