"""Targets of a commissioning run and their progress, and the writes and saves on one of them."""

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from hornbill.domain.change import Reason
from hornbill.errors import Busy, NoResponse, NotAsWanted, Unknown
from hornbill.servo.configuration.changes import Changes
from hornbill.servo.configuration.restart_plan import RestartOptions
from hornbill.servo.configuration.restarting import Restarting
from hornbill.servo.configuration.writing import Outcome, WriteOptions
from hornbill.servo.device import permission
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.runs.commission_request import CommissionRequest, Wanted
from hornbill.servo.runs.fleet_run import FleetJob, RunTarget, check_outcome
from hornbill.servo.runs.id_exchange import IdExchange
from hornbill.servo.runs.id_order import IdTurn
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.units import Raw, Uid

MISSING_AFTER_S = 6.0
"""Timeout for a servo that is absent: node ID and identification take up to about 4 s after power-on."""

BUSY_FOR_S = 45.0
"""Timeout for a servo that restarts or is in soft start."""

LOOK_AGAIN_S = 0.05


@dataclass(slots=True, kw_only=True)
class CommissionTarget(RunTarget):
    """One servo of the job and its progress. `finished`: in an earlier run of the job."""

    wanted: Wanted
    finished: bool = False


@dataclass(slots=True, kw_only=True)
class CommissionRun(FleetJob[CommissionTarget]):
    """One run of a job. `pinned`: servos whose allocation was pinned on the way, and is to be forgotten. `ids`: the
    IDs that were parked on the way.
    """

    SHOWS_RESULT = True

    request: CommissionRequest
    order: Sequence[IdTurn]
    lease_id: str | None
    by: str
    pinned: set[Uid] = field(default_factory=set[Uid])
    ids: IdExchange = field(default_factory=IdExchange)

    def target(self, uid: Uid) -> CommissionTarget:
        """The target of that servo."""
        return next(target for target in self.targets if target.uid == uid)

    def leaving(self) -> list[Uid]:
        """Servos whose IDs do not count as taken, because this job changes them. A servo that failed keeps its IDs."""
        return [target.uid for target in self.targets if target.problem is None]

    def close(self) -> None:
        """Nothing: the last step of a target completed its record, and one that was cut off may be resumed."""

    def facts(self) -> dict[str, object]:
        """The profile, how many are done, and the same as a sentence."""
        profile = self.request.profile
        done = sum(target.record.verdict == "done" for target in self.targets)
        told = "" if self.request.save else " Nothing of it is in ROM: it is lost at the next restart."
        return {
            "profile": None if profile is None else profile["name"],
            "saved": self.request.save,
            "done": done,
            "pinned": sorted(self.pinned),
            "text": f"{done} of {len(self.targets)} servos are commissioned.{told}",
            "text_code": "commissioned",
            "text_params": {"done": done, "servos": len(self.targets), "saved": self.request.save},
        }


class CommissionWriter:
    """Acts on one servo of a run at a time."""

    def __init__(self, services: HostServices, fleet: Fleet, changes: Changes, restarting: Restarting) -> None:
        self._base = services.base
        self._jobs = services.jobs
        self._fleet = fleet
        self._changes = changes
        self._restarting = restarting

    async def present(self, target: CommissionTarget) -> Servo:
        """The servo, ready to be written to, wherever it is now. Raises NoResponse, Busy."""
        began = self._base.now()
        while True:
            try:
                servo = self._fleet.get(target.uid)
                permission.check_writable(servo)
            except (Unknown, NoResponse) as error:
                if self._base.now() - began > MISSING_AFTER_S:
                    raise NoResponse(
                        f"{target.title} is not on the bus. Check its supply and the wiring, then resume the job.",
                        uid=target.uid,
                        cause="not_on_bus",
                        servo=target.title,
                    ) from error
            except Busy:
                if self._base.now() - began > BUSY_FOR_S:
                    raise
            else:
                return servo
            await asyncio.sleep(LOOK_AGAIN_S)

    async def apply(self, run: CommissionRun, servo: Servo, values: Mapping[str, object]) -> int:
        """Write all or nothing; the number of changed rows. Raises as Changes.apply, NotAsWanted for clamped values."""
        options = WriteOptions(
            run.lease_id, save=run.request.save, confirm=run.request.confirm, leaving=run.leaving(),
            by=run.by, job=run.job.id, reason=Reason("commissioning", "commissioning"),
        )  # fmt: skip
        outcome = await self._changes.apply(servo, values, options)
        check_outcome(servo.title, outcome)
        return sum(one.verdict == "applied" for one in outcome.changes)

    async def save(self, run: CommissionRun, servo: Servo, values: Mapping[str, object]) -> None:
        """Save these written values by a child job, and wait for its proof. Raises the error of that job."""
        words, torque = run.request.words(values), run.request.torque.get(servo.uid)
        job = self._restarting.start(servo, "save", RestartOptions(run.lease_id, run.by, words, rom_was=torque))
        await self.ended(job, servo)

    def check_save(
        self, servo: Servo, request: CommissionRequest, lease_id: str | None, values: Mapping[str, object]
    ) -> Raw | None:
        """The 0x20 that ROM is to hold after the save. Raises as Restarting.check."""
        return self._restarting.check(
            servo, "save", RestartOptions(lease_id, confirm=request.words(values), values=values)
        )

    def check_values(self, servo: Servo, request: CommissionRequest, values: Mapping[str, object]) -> None:
        """Check these values against what is known. Sends nothing. Raises as Changes.plan."""
        self._changes.plan(servo, values, confirm=request.confirm, leaving=request.uids)

    async def plan(
        self, servo: Servo, request: CommissionRequest, lease_id: str | None, values: Mapping[str, object]
    ) -> Outcome:
        """What would be written, and with a save what ROM would hold. Sends only reads."""
        options = WriteOptions(
            lease_id, dry_run=True, save=request.save, confirm=request.words(values), leaving=request.uids
        )
        return await self._changes.edit(servo, values, options)

    async def ended(self, job: RunningJob, servo: Servo) -> None:
        """Wait for a child job on this servo. Raises its error."""
        cancelled = NotAsWanted(
            f"{job.kind.capitalize()} of {servo.title} was cancelled.",
            job=job.id,
            cause="job_cancelled",
            servo=servo.title,
            kind=job.kind,
        )
        await self._jobs.succeeded(job, cancelled)
