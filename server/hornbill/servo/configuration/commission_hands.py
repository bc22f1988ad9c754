"""Owns Hands: what every step of commissioning is made of: find the servo, write, save, and write down how it went."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping

from hornbill.errors import Busy, HornbillError, NoAnswer, NotAsWanted, Unknown
from hornbill.servo import permission
from hornbill.servo.configuration.changes import Changes
from hornbill.servo.configuration.commission_run import Run, Unit
from hornbill.servo.configuration.saving import Saving
from hornbill.servo.fleet import Fleet
from hornbill.servo.jobs import Job, Jobs
from hornbill.servo.servo import Servo
from hornbill.servo.timebase import TimeBase

MISSING_AFTER_S = 6.0
"""A servo that is not there is waited for so long: node id and identification take up to about 4 s after power."""

BUSY_FOR_S = 45.0
"""One that restarts or is in soft start, so long."""

LOOK_AGAIN_S = 0.05


class Needless(Exception):
    """A step has nothing to do."""


class Hands:
    """Acts on one servo of a run at a time."""

    def __init__(self, base: TimeBase, jobs: Jobs, fleet: Fleet, changes: Changes, saving: Saving) -> None:
        self._base = base
        self._jobs = jobs
        self._fleet = fleet
        self._changes = changes
        self._saving = saving

    async def present(self, unit: Unit) -> Servo:
        """The servo, ready to be written to, wherever it is now. Raises NoAnswer, Busy."""
        began = self._base.now()
        while True:
            try:
                servo = self._fleet.get(unit.wanted.uid)
                permission.check_writable(servo)
            except (Unknown, NoAnswer) as error:
                if self._base.now() - began > MISSING_AFTER_S:
                    raise NoAnswer(
                        f"{unit.title} is not on the bus. Check its supply and the wiring, then resume the job.",
                        uid=unit.wanted.uid,
                    ) from error
            except Busy:
                if self._base.now() - began > BUSY_FOR_S:
                    raise
            else:
                return servo
            await asyncio.sleep(LOOK_AGAIN_S)

    async def step(self, run: Run, unit: Unit, kind: str, do: Callable[[Run, Unit], Awaitable[str]]) -> bool:
        """Do one step and write down what came of it; whether it went well. What `do` answers is its evidence."""
        name = f"{kind} {unit.place}"
        run.job.begin(name)
        try:
            evidence = await do(run, unit)
        except Needless as needless:
            run.job.skip(name, str(needless))
            return True
        except HornbillError as error:
            unit.problem, unit.sheet.problem = error, error.detail
            unit.sheet.verdict = "failed"
            run.tell()
            run.job.fail(name, error.detail)
            return False
        run.tell()
        run.job.done(name, evidence)
        return True

    async def apply(self, run: Run, servo: Servo, values: Mapping[str, object]) -> int:
        """Write, all or nothing; how many rows changed. Raises what Changes raises, and NotAsWanted when clamped."""
        outcome = await self._changes.apply(
            servo, values, run.lease_id, confirm=run.request.confirm, leaving=run.leaving(), by=run.by,
            job=run.job.id, reason="commissioning",
        )  # fmt: skip
        if outcome.failure is not None:
            raise outcome.failure
        clamped = [one for one in outcome.changes if one.verdict == "clamped"]
        if clamped:
            listed = ", ".join(f"{one.key} {one.requested} → {one.after}" for one in clamped)
            raise NotAsWanted(
                f"{servo.title} holds other values than those written: {listed}.",
                differences=[{"key": one.key, "wanted": one.requested, "found": one.after} for one in clamped],
            )
        return sum(one.verdict == "applied" for one in outcome.changes)

    async def save(self, run: Run, servo: Servo) -> None:
        """Save it by a job of its own, and wait for its proof. Raises what that job ended with."""
        job = self._saving.save(servo, run.lease_id, by=run.by)
        await self.ended(job, servo)

    async def ended(self, job: Job, servo: Servo) -> None:
        """Wait for a job of the servo's own; its problem is raised."""
        await self._jobs.wait(job)
        if job.error is not None:
            raise job.error
        if job.state != "succeeded":
            raise NotAsWanted(f"{job.kind.capitalize()} of {servo.title} was cancelled.", job=job.id)
