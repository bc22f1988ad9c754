"""Targets of a commissioning run and their progress, and the writes and saves on one of them."""

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from hornbill.domain.change import Reason
from hornbill.errors import Busy, NoResponse, UnexpectedResult, Unknown
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

CHECK_PERIOD_S = 0.05


@dataclass(slots=True, kw_only=True)
class CommissionTarget(RunTarget):
    """One servo of the job and its progress. `finished`: in an earlier run of the job."""

    wanted: Wanted
    finished: bool = False


@dataclass(slots=True, kw_only=True)
class CommissionRun(FleetJob[CommissionTarget]):
    """One run of a job. `pinned`: servos whose allocation was pinned for the exchange and must be freed. `ids`: the IDs
    parked for the exchange.
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
        """Servos whose IDs do not count as in use, because this job changes them. A failed servo retains its IDs."""
        return [target.uid for target in self.targets if target.problem is None]

    def close(self) -> None:
        """Nothing to do: the last step of a target completes its record, and an interrupted one may be resumed."""

    def facts(self) -> dict[str, object]:
        """Profile, number of servos done, and a summary sentence."""
        profile = self.request.profile
        done = sum(target.record.verdict == "done" for target in self.targets)
        warning = "" if self.request.save else " The values are not saved to ROM and are lost at the next restart."
        return {
            "profile": None if profile is None else profile["name"],
            "saved": self.request.save,
            "done": done,
            "pinned": sorted(self.pinned),
            "text": f"{done} of {len(self.targets)} servos commissioned.{warning}",
            "text_code": "commissioned",
            "text_params": {"done": done, "servos": len(self.targets), "saved": self.request.save},
        }


class CommissionWriter:
    """Writes and saves one servo of a run at a time."""

    def __init__(self, services: HostServices, fleet: Fleet, changes: Changes, restarting: Restarting) -> None:
        self._base = services.base
        self._jobs = services.jobs
        self._fleet = fleet
        self._changes = changes
        self._restarting = restarting

    async def present(self, target: CommissionTarget) -> Servo:
        """Wait until the servo is ready to be written, on any node ID. Raises NoResponse, Busy."""
        began = self._base.now()
        while True:
            try:
                servo = self._fleet.get(target.uid)
                permission.check_writable(servo)
            except (Unknown, NoResponse) as error:
                if self._base.now() - began > MISSING_AFTER_S:
                    raise NoResponse(
                        f"{target.title} is offline. Check its supply and wiring, then resume the job.",
                        uid=target.uid,
                        cause="not_on_bus",
                        servo=target.title,
                    ) from error
            except Busy:
                if self._base.now() - began > BUSY_FOR_S:
                    raise
            else:
                return servo
            await asyncio.sleep(CHECK_PERIOD_S)

    async def apply(self, run: CommissionRun, servo: Servo, values: Mapping[str, object]) -> int:
        """Write atomically. Returns the number of changed rows.

        Raises the errors of Changes.apply, and UnexpectedResult for clamped values.
        """
        options = WriteOptions(
            run.lease_id, save=run.request.save, confirm=run.request.confirm, leaving=run.leaving(),
            by=run.by, job=run.job.id, reason=Reason("commissioning", "commissioning"),
        )  # fmt: skip
        outcome = await self._changes.apply(servo, values, options)
        check_outcome(servo.title, outcome)
        return sum(one.verdict == "applied" for one in outcome.changes)

    async def save(self, run: CommissionRun, servo: Servo, values: Mapping[str, object]) -> None:
        """Save these written values by a child job, and wait until it has verified them. Raises the job's error."""
        words, torque = run.request.words(values), run.request.torque.get(servo.uid)
        job = self._restarting.start(servo, "save", RestartOptions(run.lease_id, run.by, words, rom_was=torque))
        await self.ended(job, servo)

    def check_save(
        self, servo: Servo, request: CommissionRequest, lease_id: str | None, values: Mapping[str, object]
    ) -> Raw | None:
        """The 0x20 that the save will write to ROM. Raises the errors of Restarting.check."""
        return self._restarting.check(
            servo, "save", RestartOptions(lease_id, confirm=request.words(values), values=values)
        )

    def check_values(self, servo: Servo, request: CommissionRequest, values: Mapping[str, object]) -> None:
        """Check these values against the known state. Sends nothing. Raises the errors of Changes.plan."""
        self._changes.plan(servo, values, confirm=request.confirm, leaving=request.uids)

    async def plan(
        self, servo: Servo, request: CommissionRequest, lease_id: str | None, values: Mapping[str, object]
    ) -> Outcome:
        """Dry run: the values to write, and with a save the ROM changes. Sends only reads."""
        options = WriteOptions(
            lease_id, dry_run=True, save=request.save, confirm=request.words(values), leaving=request.uids
        )
        return await self._changes.edit(servo, values, options)

    async def ended(self, job: RunningJob, servo: Servo) -> None:
        """Wait for a child job on this servo. Raises its error."""
        cancelled = UnexpectedResult(
            f"{job.kind.capitalize()} of {servo.title} was cancelled.",
            job=job.id,
            cause="job_cancelled",
            servo=servo.title,
            kind=job.kind,
        )
        await self._jobs.succeeded(job, cancelled)
