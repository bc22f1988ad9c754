"""Owns Applying: the job that brings many servos to one profile, unit by unit, each all or nothing."""

import asyncio
from collections.abc import Sequence
from copy import copy
from dataclasses import asdict, dataclass, field
from typing import Literal, TypeAlias

from hornbill.errors import Conflict, HornbillError, InvalidValue, NotAsWanted
from hornbill.schema.scale import Value
from hornbill.servo import permission
from hornbill.servo.configuration.changes import Changes
from hornbill.servo.configuration.profiles import LeftOut, Profile, Profiles
from hornbill.servo.configuration.saving import Saving
from hornbill.servo.configuration.writing import Change, Outcome
from hornbill.servo.fleet import Fleet
from hornbill.servo.jobs import Job, Jobs
from hornbill.servo.leases import Leases
from hornbill.servo.servo import Servo
from hornbill.servo.steps import Step
from hornbill.servo.timebase import TimeBase
from hornbill.servo.unbroken import unbroken
from hornbill.units import Uid

OnAnomaly: TypeAlias = Literal["stop", "continue"]

_IDS = ("servo_id", "node_id")


@dataclass(frozen=True, slots=True)
class Wish:
    """How a profile is to be applied. `on_anomaly` says what follows the first servo that did not do as told."""

    dry_run: bool = False
    save: bool = False
    on_anomaly: OnAnomaly = "stop"
    confirm: tuple[str, ...] = ()


@dataclass(slots=True)
class _Unit:
    """One servo of the job and how far it came. `outcome` in the words of a batch."""

    place: int
    servo: Servo
    outcome: str = "not_tried"
    values: dict[str, Value] = field(default_factory=dict[str, Value])
    left_out: list[LeftOut] = field(default_factory=list[LeftOut])
    changes: list[Change] = field(default_factory=list[Change])
    job: str | None = None
    saved: bool = False
    problem: HornbillError | None = None

    def shown(self) -> dict[str, object]:
        return {
            "uid": self.servo.uid, "outcome": self.outcome, "changes": [asdict(one) for one in self.changes],
            "left_out": [asdict(one) for one in self.left_out], "saved": self.saved, "job": self.job,
            "problem": None if self.problem is None else _problem(self.problem),
        }  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Run:
    """What every step of one job needs."""

    job: Job
    profile: Profile
    units: list[_Unit]
    wish: Wish
    lease_id: str | None
    by: str


class Applying:
    """Starts jobs of kind "profile"."""

    def __init__(
        self,
        profiles: Profiles,
        changes: Changes,
        saving: Saving,
        jobs: Jobs,
        leases: Leases,
        fleet: Fleet,
        base: TimeBase,
    ) -> None:
        self._profiles = profiles
        self._changes = changes
        self._saving = saving
        self._jobs = jobs
        self._leases = leases
        self._fleet = fleet
        self._base = base

    def start(self, name: str, uids: Sequence[Uid], lease_id: str | None, wish: Wish) -> Job:
        """Bring servos to a profile. Its result, whatever the end: `servos`, one entry each in the order given.

        All are planned before the first is written to; a servo that cannot take its values ends the job there, or
        with `continue` is left out. With `stop` one follows the other, and the first anomaly (a refusal, a roll-back,
        a clamped value, a save that failed) ends the job. With `continue` all are written at once, then saved one
        after the other, and the job fails at its end when any servo did. A servo with an anomaly is not saved.
        Cancelling lets what is being written to a servo come to its end.

        Raises Unknown (profile or servo), LeaseHeld, InvalidValue (a servo named twice), Conflict (a profile with an
        id, for several servos), Busy (another such job is at one of them).
        """
        profile = self._profiles.get(name)
        servos = [self._fleet.get(uid) for uid in uids]
        if len(set(uids)) < len(uids):
            raise InvalidValue("A servo is named twice. Name each once.")
        given = [key for key in _IDS if profile.values.get(key)]
        if given and len(servos) > 1:
            raise Conflict(
                f'The profile "{name}" holds {given[0]}, which no two servos may share. Apply it to one servo only.',
                key=given[0], requested=profile.values[given[0]],
            )  # fmt: skip
        now = self._base.now()
        self._leases.allow_write(lease_id, now)
        by = self._leases.who(lease_id, now)
        self._jobs.check_apart(uids)
        units = [_Unit(place, servo) for place, servo in enumerate(servos, start=1)]

        async def work(job: Job) -> dict[str, object]:
            return await self._work(_Run(job, profile, units, wish, lease_id, by))

        return self._jobs.start("profile", None, _steps(units, wish), work)

    async def _work(self, run: _Run) -> dict[str, object]:
        def result() -> dict[str, object]:
            return {
                "profile": run.profile.name, "dry_run": run.wish.dry_run,
                "servos": [unit.shown() for unit in run.units],
            }  # fmt: skip

        try:
            await self._plan_all(run)
            await (self._together if run.wish.on_anomaly == "continue" else self._in_order)(run)
        finally:  # also of a job that was cancelled: what was written stays written, and that is to be known
            run.job.result = result()
        _raise_first(run)
        return result()

    async def _plan_all(self, run: _Run) -> None:
        for unit in run.units:
            name = f"plan {unit.place}"
            run.job.begin(name)
            try:
                permission.check_writable(unit.servo)
                unit.values, unit.left_out = self._profiles.values_for(run.profile, unit.servo)
                self._changes.plan(unit.servo, unit.values, confirm=run.wish.confirm)
                if run.wish.dry_run:
                    planned = await self._apply(run, unit)
                    unit.changes = planned.changes
                    unit.outcome = "planned"
            except HornbillError as error:
                unit.outcome, unit.problem = "rejected", error
                run.job.fail(name, error.detail)
                continue
            left = f", {len(unit.left_out)} left out" if unit.left_out else ""
            run.job.done(name, f"{len(unit.values)} rows{left}")
        rejected = [unit for unit in run.units if unit.problem is not None]
        for unit in rejected:
            self._skip(run, unit, "its values cannot be written")
        if rejected and run.wish.on_anomaly == "stop":
            for unit in run.units:
                self._skip(run, unit, f"nothing was written: {rejected[0].servo.title} cannot take its values")
            _raise_first(run)

    async def _in_order(self, run: _Run) -> None:
        """One servo after the other, up to the first anomaly."""
        if run.wish.dry_run:
            return
        for unit in run.units:
            await unbroken(self._write(run, unit))
            if unit.problem is None and run.wish.save:
                await self._save(run, unit)
            if unit.problem is not None:
                for rest in run.units[unit.place - 1 :]:
                    self._skip(run, rest, f"{unit.servo.title} did not do as told")
                return

    async def _together(self, run: _Run) -> None:
        """All that can at once; saving, which restarts a servo and may move its horn, one after the other."""
        if run.wish.dry_run:
            return
        await asyncio.gather(*(unbroken(self._write(run, unit)) for unit in run.units if unit.problem is None))
        if not run.wish.save:
            return
        for unit in run.units:
            if unit.problem is None:
                await self._save(run, unit)
            else:
                self._skip(run, unit, "it did not do as told")

    async def _write(self, run: _Run, unit: _Unit) -> None:
        name = f"write {unit.place}"
        run.job.begin(name)
        try:
            outcome = await self._apply(run, unit)
        except HornbillError as error:
            unit.outcome, unit.problem = "rejected", error
            run.job.fail(name, error.detail)
            return
        unit.outcome, unit.changes, unit.problem = outcome.outcome, outcome.changes, outcome.failure
        clamped = [one for one in outcome.changes if one.verdict == "clamped"]
        if unit.problem is None and clamped:
            listed = ", ".join(f"{one.key} {one.requested} → {one.after}" for one in clamped)
            unit.problem = NotAsWanted(
                f"{unit.servo.title} holds other values than those written: {listed}.",
                differences=[{"key": one.key, "wanted": one.requested, "found": one.after} for one in clamped],
            )
        if unit.problem is not None:
            run.job.fail(name, unit.problem.detail)
            return
        written = sum(one.verdict == "applied" for one in outcome.changes)
        run.job.done(name, f"{written} rows written and read back, {len(outcome.changes) - written} as they were")

    async def _apply(self, run: _Run, unit: _Unit) -> Outcome:
        return await self._changes.apply(
            unit.servo, unit.values, run.lease_id, dry_run=run.wish.dry_run, confirm=run.wish.confirm, by=run.by,
            job=run.job.id, reason=f"profile {run.profile.name}",
        )  # fmt: skip

    async def _save(self, run: _Run, unit: _Unit) -> None:
        name = f"save {unit.place}"
        run.job.begin(name)
        try:
            self._leases.allow_write(run.lease_id, self._base.now())
            job = self._saving.save(unit.servo, run.lease_id, by=run.by, written=unit.changes)
            unit.job = job.id
            await self._jobs.wait(job)
            if job.error is not None:
                raise job.error
            if job.state != "succeeded":
                raise NotAsWanted(f"Saving {unit.servo.title} was cancelled. What its ROM holds is not known.")
        except HornbillError as error:
            unit.problem = error
            run.job.fail(name, error.detail)
            return
        unit.saved = True
        run.job.done(name, "in ROM, read back after the restart")

    @staticmethod
    def _skip(run: _Run, unit: _Unit, why: str) -> None:
        """Leave out what has not begun of a servo."""
        for step in run.job.steps:
            if step.uid == unit.servo.uid and step.state == "waiting":
                run.job.skip(step.name, why)


def _steps(units: Sequence[_Unit], wish: Wish) -> list[Step]:
    kinds = {"plan": "Values checked"}
    if not wish.dry_run:
        kinds["write"] = "Written and read back"
        if wish.save:
            kinds["save"] = "Saved"
    first = [Step(f"plan {unit.place}", f"{unit.servo.title}: {kinds['plan']}", uid=unit.servo.uid) for unit in units]
    rest = [
        Step(f"{kind} {unit.place}", f"{unit.servo.title}: {text}", uid=unit.servo.uid)
        for unit in units
        for kind, text in kinds.items()
        if kind != "plan"
    ]
    return first + rest


def _raise_first(run: _Run) -> None:
    """Raise the first servo's problem, if any has one; of several it says how many there are."""
    wrong = [unit for unit in run.units if unit.problem is not None]
    if not wrong:
        return
    assert wrong[0].problem is not None
    error = copy(wrong[0].problem)
    error.facts = {**error.facts, "uid": wrong[0].servo.uid, "uids": [unit.servo.uid for unit in wrong]}
    if len(run.units) > 1:
        error.detail = f"{len(wrong)} of {len(run.units)} servos did not take the profile. {error.detail}"
    raise error


def _problem(error: HornbillError) -> dict[str, object]:
    """An error as the job's result holds it: code, title, detail, and what facts JSON can hold."""
    plain: dict[str, object] = {
        key: one for key, one in error.facts.items() if isinstance(one, str | int | float | list | dict)
    }
    return {**plain, "code": error.code, "title": error.title, "detail": error.detail}
