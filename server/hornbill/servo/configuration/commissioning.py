"""Owns Commissioning: the job that turns new servos, all alike on one bus, into servos with names, ids and values."""

import asyncio
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import asdict, dataclass
from typing import Any, Literal, TypeAlias, cast

from hornbill.errors import Conflict, HornbillError, Interrupted, NotInThisModel, Unknown
from hornbill.servo import permission
from hornbill.servo.configuration import rules
from hornbill.servo.configuration import sheet as sheets
from hornbill.servo.configuration.changes import Changes
from hornbill.servo.configuration.claims import Claims
from hornbill.servo.configuration.commission_plan import Stage, Wanted, check_unique, stages
from hornbill.servo.configuration.commission_run import Request, Run, Unit, wanted_values
from hornbill.servo.configuration.commissioning_unit import Crew
from hornbill.servo.configuration.parking import Parking
from hornbill.servo.configuration.profiles import Profile, Profiles
from hornbill.servo.configuration.saving import Saving
from hornbill.servo.configuration.sheet import Sheet
from hornbill.servo.fleet import Fleet
from hornbill.servo.jobs import Job, Jobs, Work
from hornbill.servo.leases import Leases
from hornbill.servo.servo import Servo
from hornbill.servo.steps import Step
from hornbill.servo.stop import Stop
from hornbill.servo.timebase import TimeBase
from hornbill.store.tables import Json
from hornbill.units import Uid

OnAnomaly: TypeAlias = Literal["stop", "continue"]

STEPS = {
    "identify": "Horn wiggled",
    "write": "Named, ids and values written and read back",
    "save": "Saved",
    "verify": "Found to hold what was wanted",
}
CHECK = "Still holds what was wanted"
ASIDE = "Servo ID parked on 0, its next owner comes first"
AWAY = "Node ID parked on dynamic and saved, its next owner comes first"


@dataclass(frozen=True, slots=True)
class Candidate:
    """A servo that looks new: servo id 0 and no name. `servo_id` is the lowest that is free, after those before it."""

    servo: Servo
    servo_id: int | None


class Commissioning:
    """Starts and resumes jobs of kind "commissioning"."""

    def __init__(
        self,
        jobs: Jobs,
        fleet: Fleet,
        base: TimeBase,
        leases: Leases,
        stop: Stop,
        profiles: Profiles,
        changes: Changes,
        saving: Saving,
        claims: Claims,
        parking: Parking,
        crew: Crew,
    ) -> None:
        self._jobs = jobs
        self._fleet = fleet
        self._base = base
        self._leases = leases
        self._stop = stop
        self._profiles = profiles
        self._changes = changes
        self._saving = saving
        self._claims = claims
        self._parking = parking
        self._crew = crew
        jobs.resumers["commissioning"] = self.resumer

    def candidates(self) -> list[Candidate]:
        """The servos on the bus that look new, in the order of their serials, each with an id to give it."""
        low, high = rules.GIVEN_IDS["servo_id"]
        new = [one for one in self._fleet.all() if one.online and one.servo_id == 0 and not one.label]
        taken: set[int] = set()
        found: list[Candidate] = []
        for servo in sorted(new, key=lambda one: (one.serial or "", one.uid)):
            claimed = taken | {claim.number for claim in self._claims.of("servo_id", servo)}
            number = next((each for each in range(low, high + 1) if each not in claimed), None)
            if number is not None:
                taken.add(number)
            found.append(Candidate(servo, number))
        return found

    def start(
        self,
        wanted: Sequence[Wanted],
        lease_id: str | None,
        *,
        profile: str | None,
        save: bool,
        identify: bool,
        on_anomaly: OnAnomaly,
        confirm: Sequence[str] = (),
    ) -> Job:
        """Commission servos one by one, each all or nothing; `Job.result` has `units`, one sheet each as requested.

        A unit: identify (wiggle) if asked → label, ids and the profile's values in one change → save → read back what
        RAM and ROM hold, under the static node id if one was given. Identity rows of a profile are left out. Ids are
        exchanged without a clash on the way: see `stages`.

        Everything is checked first, and nothing written when anything is wrong. Raises Unknown (servo, profile),
        LeaseHeld, Stopped, InvalidValue, Conflict, OutOfRange, NotInThisModel, NeedsConfirmation, Busy, NoAnswer,
        TorqueOn.
        """
        check_unique(wanted)
        servos = {one.uid: self._fleet.get(one.uid) for one in wanted}
        taken = None if profile is None else self._profiles.get(profile)
        request = Request(tuple(wanted), _kept(taken), save, identify, on_anomaly, tuple(confirm))
        self._check_leave(request, lease_id)
        for one in wanted:
            self._check_servo(request, one, servos[one.uid], lease_id)
        order = self._order(wanted)
        if not save and any(stage.kind == "away" for stage in order):
            raise _needs_save()
        units = [Unit(place, one, Sheet(one.uid)) for place, one in enumerate(wanted, start=1)]
        for unit in units:
            unit.sheet.identify(servos[unit.wanted.uid])
        steps = _steps(units, order, request)
        by = self._leases.who(lease_id, self._base.now())

        async def work(job: Job) -> dict[str, object]:
            return await self._work(Run(job, request, units, order, lease_id, by))

        return self._jobs.start("commissioning", None, steps, work, cast("Mapping[str, Json]", request.document()))

    def resumer(self, job: Job) -> Work:
        """Go on with a job: what was finished is read again, what was cut off is done anew, the rest follows.

        Servos are found by their uid, wherever they are now. Raises LeaseHeld, Stopped, and Conflict when an id has
        been taken by somebody else meanwhile; a servo that is missing is an anomaly when its turn comes.
        """
        assert job.request is not None
        request = Request.from_document(job.request)
        self._check_leave(request, job.lease_id)
        kept = {one.uid: one for one in _sheets(job)}
        done = {uid for uid, sheet in kept.items() if sheet.verdict == "done"}
        rest = [one for one in request.wanted if one.uid not in done]
        for one in rest:
            if self._fleet.knows(one.uid):
                self._check_ids(request, one, self._fleet.get(one.uid))
        order = self._order(rest)
        units: list[Unit] = []
        for place, one in enumerate(request.wanted, start=1):
            sheet = kept.get(one.uid) or Sheet(one.uid)
            units.append(Unit(place, one, sheet if one.uid in done else _anew(sheet), finished=one.uid in done))
        pins = {Uid(str(uid)) for uid in cast("list[object]", (job.result or {}).get("pinned", []))}
        by = self._leases.who(job.lease_id, self._base.now())
        job.steps[:] = _steps(units, order, request)

        async def work(resumed: Job) -> dict[str, object]:
            return await self._work(Run(resumed, request, units, order, resumed.lease_id, by, pinned=pins))

        return work

    def _check_leave(self, request: Request, lease_id: str | None) -> None:
        self._leases.allow_write(lease_id, self._base.now())
        self._jobs.check_apart(request.uids)
        if request.save or request.identify:
            self._stop.check()

    def _check_servo(self, request: Request, one: Wanted, servo: Servo, lease_id: str | None) -> None:
        """Raises what speaks against this servo's part. Nothing is sent."""
        self._jobs.check_free(servo)
        try:
            (permission.check_movable if request.identify else permission.check_writable)(servo)
            if request.save:
                self._saving.check(servo, lease_id)
            if servo.model is None:
                raise NotInThisModel(f"{servo.title} is of no known model: nothing is written to it.")
            self._check_ids(request, one, servo)
            values = wanted_values(self._profiles, request, one, servo)
            self._changes.plan(servo, values, confirm=request.confirm, leaving=request.uids)
        except HornbillError as error:
            error.facts.setdefault("uid", servo.uid)
            raise

    def _check_ids(self, request: Request, one: Wanted, servo: Servo) -> None:
        """Raises Conflict for an id of anybody who keeps it: who is not in the request, or has no new one there."""
        for key, number in (("servo_id", one.servo_id), ("node_id", one.node_id)):
            if not number:
                continue
            leaving = [each.uid for each in request.wanted if getattr(each, key) is not None]
            rules.check_id(servo.catalog.by_key[key], number, self._claims.of(key, servo, leaving))
            if key == "node_id" and not request.save:
                holder = next((s for s in self._fleet.all() if s.node_id == number and s.uid != servo.uid), None)
                if holder is not None:
                    raise _needs_save()

    def _order(self, wanted: Sequence[Wanted]) -> list[Stage]:
        known = {one.uid: self._fleet.get(one.uid) for one in wanted if self._fleet.knows(one.uid)}
        servo_ids = {uid: servo.servo_id for uid, servo in known.items()}
        return stages(wanted, servo_ids, {uid: servo.node_id for uid, servo in known.items()})

    async def _work(self, run: Run) -> dict[str, object]:
        try:
            return await self._stages(run)
        except asyncio.CancelledError:
            self._parking.say_parked(run)
            raise

    async def _stages(self, run: Run) -> dict[str, object]:
        run.tell()
        for unit in run.units:
            if unit.finished:
                await self._crew.check(run, unit)
        for stage in run.order:
            if run.stopped:
                break
            unit = run.unit(stage.uid)
            match stage.kind:
                case "unit":
                    await self._crew.commission(run, unit)
                case "aside":
                    await self._parking.aside(run, unit)
                case "away":
                    await self._parking.away(run, unit)
        await self._crew.clear_up(run)
        run.tell()
        _raise_first(run)
        return run.result()


def _kept(profile: Profile | None) -> dict[str, Any] | None:
    """The profile as it is now: whoever changes it while the job is under way does not make two kinds of servos."""
    return None if profile is None else asdict(profile)


def _steps(units: Sequence[Unit], order: Sequence[Stage], request: Request) -> list[Step]:
    kinds = request.kinds
    by_uid = {unit.wanted.uid: unit for unit in units}
    found: list[Step] = []

    def add(kind: str, unit: Unit, text: str) -> None:
        found.append(Step(f"{kind} {unit.place}", f"{unit.title}: {text}", uid=unit.wanted.uid))

    for unit in units:
        if unit.finished:
            add("check", unit, CHECK)
    for stage in order:
        unit = by_uid[stage.uid]
        if stage.kind == "unit":
            for kind in kinds:
                add(kind, unit, STEPS[kind])
        else:
            add(stage.kind, unit, ASIDE if stage.kind == "aside" else AWAY)
    return found


def _sheets(job: Job) -> list[Sheet]:
    units = (job.result or {}).get("units")
    return [sheets.from_document(one) for one in cast("list[Mapping[str, Any]]", units or [])]


def _anew(sheet: Sheet) -> Sheet:
    """The sheet of a servo that is done anew: who it is stays, what was proved does not."""
    return Sheet(
        sheet.uid, sheet.title, sheet.label, sheet.serial, sheet.model, sheet.firmware, sheet.hardware_version,
        sheet.production_date, sheet.servo_id, sheet.node_id,
    )  # fmt: skip


def _needs_save() -> Conflict:
    return Conflict(
        "A node ID that is asked for is in use by another servo of this request, which leaves it only when it is "
        "saved. Ask with save: true."
    )


def _raise_first(run: Run) -> None:
    """Raise the first servo's problem, if any has one; of several it says how many there are."""
    wrong = [unit for unit in run.units if unit.problem is not None]
    if not wrong:
        return
    first = wrong[0].problem
    assert first is not None
    error = copy(first)
    if isinstance(error, Unknown | Interrupted):
        error = HornbillError(first.detail)
    error.facts = {**first.facts, "uid": wrong[0].wanted.uid, "uids": [unit.wanted.uid for unit in wrong]}
    if len(run.units) > 1:
        error.detail = f"{len(wrong)} of {len(run.units)} servos failed. {first.detail}"
    raise error
