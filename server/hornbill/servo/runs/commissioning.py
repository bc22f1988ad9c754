"""Job that assigns names, IDs and values to new servos."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import cast

from hornbill.domain.change import Change, SavePreview
from hornbill.errors import Conflict, HornbillError
from hornbill.servo.configuration import record as records
from hornbill.servo.configuration import rules
from hornbill.servo.configuration.claims import Claims
from hornbill.servo.configuration.record import ServoRecord
from hornbill.servo.device import permission
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.profiles.profiles import Profiles
from hornbill.servo.runs.commission_request import CommissionRequest, Wanted, check_wanted, wanted_values
from hornbill.servo.runs.commission_run import CommissionRun, CommissionTarget, CommissionWriter
from hornbill.servo.runs.commission_steps import CommissionSteps
from hornbill.servo.runs.fleet_run import OnAnomaly
from hornbill.servo.runs.id_order import IdTurn, order_ids
from hornbill.servo.runs.id_parking import PARK_STEPS
from hornbill.servo.runtime.jobs import RunningJob, Work
from hornbill.servo.runtime.steps import Step
from hornbill.servo.torque_off.stop import StopControl
from hornbill.store.tables import Json
from hornbill.units import Raw, Uid

STEPS = {
    "identify": "Horn wiggled",
    "write": "Label, IDs and values written and read back",
    "save": "Saved",
    "verify": "Verified as planned",
}
CHECK = "Still as planned"
PARKED = {
    "servo_id": "Servo ID set to 0 to free it for its next servo",
    "node_id": "Node ID set to dynamic and saved, to free it for its next servo",
}


@dataclass(frozen=True, slots=True)
class CommissionOptions:
    """Options of commissioning. `profile`: name of the profile to write, copied when the job starts."""

    profile: str | None
    save: bool
    identify: bool
    on_anomaly: OnAnomaly = "stop"
    confirm: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class NewServo:
    """A servo that appears new: servo ID 0 and no nickname. `servo_id`: the lowest free ID not proposed to another."""

    servo: Servo
    servo_id: int | None


@dataclass(slots=True)
class Planned:
    """Plan for one servo: the changes, and with a save the ROM changes."""

    servo: Servo
    changes: list[Change] = field(default_factory=list[Change])
    save: SavePreview | None = None


class CommissioningJobs:
    """Starts and resumes jobs of kind "commissioning"."""

    def __init__(
        self,
        services: HostServices,
        fleet: Fleet,
        stop: StopControl,
        profiles: Profiles,
        claims: Claims,
        writer: CommissionWriter,
        steps: CommissionSteps,
    ) -> None:
        self._jobs = services.jobs
        self._base = services.base
        self._leases = services.leases
        self._fleet = fleet
        self._stop = stop
        self._profiles = profiles
        self._claims = claims
        self._writer = writer
        self._steps = steps

    def candidates(self) -> list[NewServo]:
        """Servos on the bus that appear new, sorted by serial number, each with a proposed servo ID."""
        new = [one for one in self._fleet.all() if one.online and one.servo_id == 0 and not one.label]
        taken: set[int] = set()
        found: list[NewServo] = []
        for servo in sorted(new, key=lambda one: (one.serial or "", one.uid)):
            claimed = taken | {claim.number for claim in self._claims.of("servo_id", servo)}
            number = rules.first_free(servo.catalog.by_key["servo_id"], claimed)
            if number is not None:
                taken.add(number)
            found.append(NewServo(servo, number))
        return found

    def start(self, wanted: Sequence[Wanted], lease_id: str | None, options: CommissionOptions) -> RunningJob:
        """Commission servos one by one, each atomically. `Job.result` has `servos`, one record each as requested.

        Each target: identify (wiggle) if requested → label, IDs and profile values in one change → save → read back RAM
        and ROM, on the static node ID if one was given. Identity rows of a profile are left out. IDs are exchanged
        without duplicates in between: see `order_ids`.

        Everything is checked first; after an error nothing is written. Raises Unknown (servo, profile), LeaseHeld,
        Stopped, InvalidValue, Conflict, OutOfRange, NotInThisModel, NeedsConfirmation, Busy, NoResponse, TorqueOn.
        """
        request, order = self._checked(wanted, lease_id, options)
        targets = [
            CommissionTarget(record=ServoRecord(one.uid), place=place, wanted=one)
            for place, one in enumerate(wanted, start=1)
        ]
        for target in targets:
            target.record.identify(self._fleet.get(target.uid))
        steps, work = _steps(targets, order, request), self._work(targets, order, request, lease_id, set())
        return self._jobs.start("commissioning", None, steps, work, cast("Mapping[str, Json]", request.document()))

    async def plan(self, wanted: Sequence[Wanted], lease_id: str | None, options: CommissionOptions) -> list[Planned]:
        """Dry run of `start` with all its checks, servo by servo. Sends only reads."""
        request, _ = self._checked(wanted, lease_id, options)
        return [await self._plan_one(request, one, self._fleet.get(one.uid), lease_id) for one in wanted]

    async def _plan_one(self, request: CommissionRequest, one: Wanted, servo: Servo, lease_id: str | None) -> Planned:
        values = wanted_values(self._profiles, request, one, servo)
        planned = await self._writer.plan(servo, request, lease_id, values)
        return Planned(servo, planned.changes, planned.plan)

    def resumer(self, job: RunningJob) -> Work:
        """Resume a job: finished targets are read again, interrupted ones are repeated, the others follow.

        Servos are found by unique ID, on any node ID. Raises LeaseHeld, Stopped, and Conflict if another servo has
        since got one of the IDs. A missing servo is an anomaly of its steps.
        """
        assert job.request is not None
        request = CommissionRequest.from_document(job.request)
        self._check_leave(request, job.lease_id)
        stored = records.of_result(job.result)
        done = {uid for uid, record in stored.items() if record.verdict == "done"}
        rest = [one for one in request.wanted if one.uid not in done]
        for one in rest:
            if self._fleet.knows(one.uid):
                self._check_ids(request, one, self._fleet.get(one.uid))
        order = self._order(rest)
        targets: list[CommissionTarget] = []
        for place, one in enumerate(request.wanted, start=1):
            record, finished = stored.get(one.uid) or ServoRecord(one.uid), one.uid in done
            record = record if finished else _reset(record)
            targets.append(CommissionTarget(record=record, place=place, wanted=one, finished=finished))
        pinned = {Uid(str(uid)) for uid in cast("list[object]", (job.result or {}).get("pinned", []))}
        job.steps[:] = _steps(targets, order, request)
        return self._work(targets, order, request, job.lease_id, pinned)

    def _work(
        self,
        targets: Sequence[CommissionTarget],
        order: Sequence[IdTurn],
        request: CommissionRequest,
        lease_id: str | None,
        pinned: set[Uid],
    ) -> Work:
        by = self._leases.who(lease_id, self._base.now())

        async def work(job: RunningJob) -> dict[str, object]:
            run = CommissionRun(
                job=job, targets=targets, on_anomaly=request.on_anomaly, request=request, order=order,
                lease_id=lease_id, by=by, pinned=pinned,
            )  # fmt: skip
            return await run.work(self._steps.execute(run))

        return work

    def _check_leave(self, request: CommissionRequest, lease_id: str | None) -> None:
        self._leases.allow_write(lease_id, self._base.now(), *request.uids)
        self._jobs.check_apart(request.uids)
        if request.save or request.identify:
            self._stop.check()

    def _checked(
        self, wanted: Sequence[Wanted], lease_id: str | None, options: CommissionOptions
    ) -> tuple[CommissionRequest, list[IdTurn]]:
        """The checked request with its `torque`, and its order. Raises the first problem."""
        check_wanted(wanted)
        servos = {one.uid: self._fleet.get(one.uid) for one in wanted}
        profile = None if options.profile is None else asdict(self._profiles.get(options.profile))
        request = CommissionRequest(
            tuple(wanted), profile, options.save, options.identify, options.on_anomaly, tuple(options.confirm)
        )
        self._check_leave(request, lease_id)
        torque = {one.uid: self._check_servo(request, one, servos[one.uid], lease_id) for one in request.wanted}
        order = self._order(request.wanted)
        if not request.save and any(turn.parked == "node_id" for turn in order):
            raise _needs_save()
        return replace(request, torque=torque), order

    def _check_servo(self, request: CommissionRequest, one: Wanted, servo: Servo, lease_id: str | None) -> Raw | None:
        """Check one servo's part of the request. Returns the 0x20 to save. Sends nothing. Raises the first problem."""
        permission.check_free(servo, self._jobs)
        try:
            (permission.check_movable if request.identify else permission.check_writable)(servo)
            values = wanted_values(self._profiles, request, one, servo)
            torque = None
            if request.save:
                torque = self._writer.check_save(servo, request, lease_id, values)
            self._check_ids(request, one, servo)
            self._writer.check_values(servo, request, values)
        except HornbillError as error:
            error.facts.setdefault("uid", servo.uid)
            raise
        return torque

    def _check_ids(self, request: CommissionRequest, one: Wanted, servo: Servo) -> None:
        """Raises Conflict for an ID that another servo retains: one not in the request, or without a new ID there."""
        for key, number in one.ids.items():
            if not number:
                continue
            leaving = [each.uid for each in request.wanted if getattr(each, key) is not None]
            rules.check_id(servo.catalog.by_key[key], number, self._claims.of(key, servo, leaving))
            if key == "node_id" and not request.save:
                holder = next((s for s in self._fleet.all() if s.node_id == number and s.uid != servo.uid), None)
                if holder is not None:
                    raise _needs_save()

    def _order(self, wanted: Sequence[Wanted]) -> list[IdTurn]:
        known = {one.uid: self._fleet.get(one.uid) for one in wanted if self._fleet.knows(one.uid)}
        held = {
            "node_id": {uid: servo.node_id for uid, servo in known.items()},  # takes effect at a restart
            "servo_id": {uid: servo.servo_id for uid, servo in known.items()},
        }
        return order_ids({one.uid: one.ids for one in wanted}, held)


def _steps(targets: Sequence[CommissionTarget], order: Sequence[IdTurn], request: CommissionRequest) -> list[Step]:
    by_uid = {target.uid: target for target in targets}
    found = [target.step("check", CHECK) for target in targets if target.finished]
    for turn in order:
        target = by_uid[turn.uid]
        if turn.parked is None:
            found += [target.step(kind, STEPS[kind]) for kind in request.kinds]
        else:
            found.append(target.step(PARK_STEPS[turn.parked], PARKED[turn.parked]))
    return found


def _reset(record: ServoRecord) -> ServoRecord:
    """The record of a servo to repeat: its identity without its results."""
    return ServoRecord(
        record.uid, record.title, record.label, record.serial, record.model, record.firmware, record.hardware_version,
        record.production_date, record.servo_id, record.node_id,
    )  # fmt: skip


def _needs_save() -> Conflict:
    return Conflict(
        "A requested node ID is in use by another servo of this request, which frees it only after a save. Use save in "
        "the same request.",
        cause="node_id_not_free_yet",
    )
