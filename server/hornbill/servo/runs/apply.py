"""Job that applies a profile to many servos. Each servo is written atomically."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field

from hornbill.domain.change import LeftOut, Reason
from hornbill.domain.profile import Profile
from hornbill.errors import Conflict, InvalidValue, UnexpectedResult
from hornbill.schema.scale import Value
from hornbill.servo.configuration import torque_in_rom
from hornbill.servo.configuration.changes import Changes
from hornbill.servo.configuration.record import ServoRecord
from hornbill.servo.configuration.restart_plan import RestartOptions
from hornbill.servo.configuration.restarting import Restarting
from hornbill.servo.configuration.writing import WriteOptions
from hornbill.servo.device import permission
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.profiles.profiles import Profiles
from hornbill.servo.runs.fleet_run import SAVED, FleetJob, OnAnomaly, WrittenTarget, check_outcome, rows_written
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.steps import Evidence, Step
from hornbill.units import Uid


@dataclass(frozen=True, slots=True)
class ApplyOptions:
    """Options of applying a profile. `on_anomaly`: action after the first servo that failed."""

    dry_run: bool = False
    save: bool = False
    on_anomaly: OnAnomaly = "stop"
    confirm: tuple[str, ...] = ()


@dataclass(slots=True, kw_only=True)
class ProfileTarget(WrittenTarget):
    """One servo of the job and its progress."""

    servo: Servo
    values: dict[str, Value] = field(default_factory=dict[str, Value])
    left_out: list[LeftOut] = field(default_factory=list[LeftOut])
    job: str | None = None
    saved: bool = False

    def close(self) -> None:
        """Add the written values to the record, and whether they are in ROM."""
        record, rows = self.record, self.servo.registers
        record.values = {one.key: one.after for one in self.changes}
        record.units = {
            key: rows[key].parameter.unit
            for key, value in record.values.items()
            if rows[key].parameter.unit and isinstance(value, int | float) and not isinstance(value, bool)
        }
        if record.values:
            record.verified_in = "rom" if self.saved else "ram" if self.outcome == "applied" else ""
        if record.verdict == "waiting" and self.outcome in ("applied", "planned"):
            record.verdict = "done"
        WrittenTarget.close(self)

    def shown(self) -> dict[str, object]:
        """The target in the result of the job, as JSON."""
        return {
            **self.record.document(), "outcome": self.outcome, "changes": [asdict(one) for one in self.changes],
            "left_out": [asdict(one) for one in self.left_out], "saved": self.saved, "job": self.job,
            **({} if self.plan is None else self.plan.model_dump()),
        }  # fmt: skip


@dataclass(slots=True, kw_only=True)
class ProfileRun(FleetJob[ProfileTarget]):
    """One job of applying a profile."""

    FAILED = "servos did not accept the profile"
    ALSO = "profile_not_accepted"

    profile: Profile
    options: ApplyOptions
    lease_id: str | None
    by: str

    def facts(self) -> dict[str, object]:
        """Name of the profile, and whether it is a dry run."""
        return {"profile": self.profile.name, "dry_run": self.options.dry_run}

    def write_options(self, confirm: tuple[str, ...]) -> WriteOptions:
        """Options for writing each servo."""
        return WriteOptions(
            self.lease_id, self.options.dry_run, self.options.save, confirm=confirm, by=self.by, job=self.job.id,
            reason=Reason(f"profile {self.profile.name}", "profile", {"profile": self.profile.name}),
        )  # fmt: skip


class ProfileJobs:
    """Starts jobs of kind "profile"."""

    def __init__(
        self,
        services: HostServices,
        profiles: Profiles,
        changes: Changes,
        restarting: Restarting,
        fleet: Fleet,
    ) -> None:
        self._profiles = profiles
        self._changes = changes
        self._restarting = restarting
        self._jobs = services.jobs
        self._leases = services.leases
        self._fleet = fleet
        self._base = services.base

    def start(self, name: str, uids: Sequence[Uid], lease_id: str | None, options: ApplyOptions) -> RunningJob:
        """Apply a profile to servos. The result always has `servos`, one entry each in the given order.

        All servos are planned before the first write. A servo that cannot accept its values ends the job, or with
        `continue` is left out. With `stop`, servos are written and saved one after the other, and the first anomaly
        (refusal, rollback, clamped value, failed save) ends the job. With `continue`, all are written at once, then
        saved one after the other, and the job fails at its end if any servo failed. A servo with an anomaly is not
        saved. After a cancellation a write in progress is completed.

        Raises Unknown (profile or servo), LeaseHeld, InvalidValue (duplicate servo), Conflict (a profile with an ID for
        several servos), Busy (another such job includes one of them).
        """
        profile = self._profiles.get(name)
        servos = [self._fleet.get(uid) for uid in uids]
        if len(set(uids)) < len(uids):
            raise InvalidValue("A servo is listed twice. List each servo once.", cause="duplicate_servo")
        given = [key for key in self._fleet.catalog.unique if profile.values.get(key)]
        if given and len(servos) > 1:
            raise Conflict(
                f'The profile "{name}" contains {given[0]}, which must be unique. Apply it to one servo only.',
                key=given[0], requested=profile.values[given[0]], cause="unique_for_many", name=name,
            )  # fmt: skip
        now = self._base.now()
        self._leases.allow_write(lease_id, now, *(servo.uid for servo in servos))
        by = self._leases.who(lease_id, now)
        self._jobs.check_apart(uids)
        targets = [
            ProfileTarget(record=_record(servo, profile, by), place=place, servo=servo)
            for place, servo in enumerate(servos, start=1)
        ]

        async def work(job: RunningJob) -> dict[str, object]:
            run = ProfileRun(
                job=job, targets=targets, on_anomaly=options.on_anomaly, profile=profile, options=options,
                lease_id=lease_id, by=by,
            )  # fmt: skip
            return await run.work(self._execute(run))

        return self._jobs.start("profile", None, _steps(targets, options), work)

    async def _execute(self, run: ProfileRun) -> None:
        for target in run.targets:
            await run.step(target, "plan", self._plan)
        for target in run.failed:
            run.skip(target, Evidence("values_refused", "the values are not valid for this servo"))
        if run.stopped:
            title = run.failed[0].title
            text = f"nothing was written, because the values are not valid for {title}"
            run.skip_all(Evidence("other_refused", text, {"servo": title}))
        elif not run.options.dry_run:
            await (self._in_order if run.on_anomaly == "stop" else self._together)(run)

    async def _in_order(self, run: ProfileRun) -> None:
        """Write and save one servo after the other, up to the first that fails."""
        await run.each(run.targets, self._write_and_save)
        if run.stopped:
            title = run.failed[0].title
            run.skip_all(Evidence("other_failed", f"{title} failed", {"servo": title}))

    async def _together(self, run: ProfileRun) -> None:
        """Write all accepted servos at once. Save one after the other, because a save may move the horn."""
        accepted = [target for target in run.targets if target.problem is None]
        await run.together(accepted, "write", self._write, whole=True)
        for target in run.failed:
            run.skip(target, Evidence("failed_before", "it failed before"))
        if run.options.save:
            await run.each([target for target in accepted if target.problem is None], self._save_step)

    async def _write_and_save(self, run: ProfileRun, target: ProfileTarget) -> None:
        if await run.step(target, "write", self._write, whole=True) and run.options.save:
            await self._save_step(run, target)

    async def _save_step(self, run: ProfileRun, target: ProfileTarget) -> None:
        await run.step(target, "save", self._save)

    async def _plan(self, run: ProfileRun, target: ProfileTarget) -> Evidence:
        permission.check_writable(target.servo)
        target.values, target.left_out = self._profiles.values_for(run.profile, target.servo)
        self._changes.plan(target.servo, target.values, confirm=run.options.confirm)
        words = torque_in_rom.confirmed(run.options.confirm, target.values)
        if run.options.save:
            torque_in_rom.decide(target.servo, words, target.values)
        if run.options.dry_run:
            planned = await self._changes.edit(target.servo, target.values, run.write_options(words))
            target.changes, target.plan = planned.changes, planned.plan
            target.outcome = "planned"
        left = f", {len(target.left_out)} left out" if target.left_out else ""
        values = {"rows": len(target.values), "left_out": len(target.left_out)}
        return Evidence("planned", f"{len(target.values)} rows{left}", values)

    async def _write(self, run: ProfileRun, target: ProfileTarget) -> Evidence:
        outcome = await self._changes.apply(target.servo, target.values, run.write_options(run.options.confirm))
        target.outcome, target.changes = outcome.outcome, outcome.changes
        check_outcome(target.title, outcome)
        written = sum(one.verdict == "applied" for one in outcome.changes)
        return rows_written(written, len(outcome.changes))

    async def _save(self, run: ProfileRun, target: ProfileTarget) -> Evidence:
        self._leases.allow_write(run.lease_id, self._base.now(), target.servo.uid)
        words = torque_in_rom.confirmed(run.options.confirm, target.values)
        save = RestartOptions(run.lease_id, run.by, words, written=target.changes)
        job = self._restarting.start(target.servo, "save", save)
        target.job = job.id
        detail = f"The save of {target.title} was cancelled. The contents of its ROM are unknown."
        await self._jobs.succeeded(job, UnexpectedResult(detail, cause="save_cancelled", servo=target.title))
        target.saved = True
        return SAVED


def _steps(targets: Sequence[ProfileTarget], options: ApplyOptions) -> list[Step]:
    kinds: dict[str, str] = {}
    if not options.dry_run:
        kinds["write"] = "Written and read back"
        if options.save:
            kinds["save"] = "Saved"
    first = [target.step("plan", "Values checked") for target in targets]
    return first + [target.step(kind, text) for target in targets for kind, text in kinds.items()]


def _record(servo: Servo, profile: Profile, by: str) -> ServoRecord:
    record = ServoRecord(servo.uid, by=by)
    record.identify(servo)
    record.use(profile)
    return record
