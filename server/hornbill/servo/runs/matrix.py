"""Batch of parameters × servos: read and planned together, each servo changed atomically."""

import asyncio
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from hornbill.domain.change import Change, Reason
from hornbill.errors import Conflict, HornbillError, UnexpectedResult
from hornbill.servo.configuration.changes import Changes
from hornbill.servo.configuration.record import ServoRecord
from hornbill.servo.configuration.restart_plan import RestartOptions
from hornbill.servo.configuration.restarting import Restarting
from hornbill.servo.configuration.writing import UNDO_WITHIN_S, Outcome, WriteOptions
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.identification import read_rows
from hornbill.servo.device.output import KEY
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.runs.fleet_run import FleetRun, WrittenTarget
from hornbill.servo.runs.id_exchange import IdExchange, IdMove
from hornbill.servo.runs.id_order import check_ids, moves
from hornbill.servo.runtime.hub import LogEvent
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.shielded import shielded
from hornbill.units import Uid

Values = Mapping[str, object]
REASON = Reason("matrix", "matrix")


@dataclass(slots=True, kw_only=True)
class MatrixTarget(WrittenTarget):
    """One servo of a batch. `job`: its save."""

    values: Values
    servo: Servo | None = None
    job: RunningJob | None = None

    @property
    def accepted(self) -> bool:
        """Whether it may be written."""
        return self.outcome == "planned"

    @property
    def ids(self) -> Collection[str]:
        """Rows with a number that must be unique."""
        return () if self.servo is None else self.servo.catalog.unique

    def wants(self, key: str) -> int | None:
        """The requested ID, after planning. None if it does not change."""
        requested = (one.requested for one in self.changes if one.key == key and one.requested != one.before)
        return next((int(value) for value in requested if isinstance(value, int | float)), None)


@dataclass(frozen=True, slots=True)
class MatrixOptions:
    """Options of a batch; see `Changes.apply`."""

    lease_id: str | None
    revisions: Mapping[str, str]
    confirm: Collection[str] = ()
    dry_run: bool = False
    save: bool = False
    all_or_none: bool = False


@dataclass(slots=True, kw_only=True)
class MatrixRun(FleetRun[MatrixTarget]):
    """One batch. `leaving`: servos whose IDs do not count as in use, because it moves them. `tied`: servos that
    exchange IDs and are changed all or none.
    """

    options: MatrixOptions
    leaving: Sequence[Uid]
    tied: Collection[Uid] = ()

    @property
    def accepted(self) -> list[MatrixTarget]:
        """The targets that may be written."""
        return [target for target in self.targets if target.accepted]

    def write_options(self, target: MatrixTarget) -> WriteOptions:
        """Options for writing a servo."""
        return WriteOptions(
            self.options.lease_id, save=self.options.save, revision=self.options.revisions.get(target.uid),
            confirm=self.options.confirm, leaving=self.leaving, reason=REASON,
        )  # fmt: skip


class Matrix:
    """Reads and changes many servos. Servos that exchange IDs are changed all or none."""

    def __init__(
        self,
        services: HostServices,
        fleet: Fleet,
        changes: Changes,
        restarting: Restarting,
    ) -> None:
        self._requests = services.requests
        self._hub = services.hub
        self._base = services.base
        self._leases = services.leases
        self._fleet = fleet
        self._changes = changes
        self._restarting = restarting

    async def read(self, uids: Sequence[Uid], keys: Collection[str] | None) -> dict[Uid, HornbillError]:
        """Read rows (default: all) of many servos at once. Returns the problems by servo."""

        async def one(uid: Uid) -> HornbillError | None:
            try:
                servo = self._fleet.get(uid)
                await read_rows(self._requests, servo, [key for key in servo.registers if keys is None or key in keys])
            except HornbillError as error:
                return error
            return None

        found = await asyncio.gather(*(one(uid) for uid in uids))
        return {uid: problem for uid, problem in zip(uids, found, strict=True) if problem is not None}

    async def write(self, values: Mapping[Uid, Values], options: MatrixOptions) -> Sequence[MatrixTarget]:
        """Plan all servos, then write those that were not rejected. Returns the results in the same order.

        Raises LeaseHeld before anything is sent. All other problems belong to a servo.
        """
        self._leases.allow_write(options.lease_id, self._base.now(), *values)
        targets = [
            MatrixTarget(record=ServoRecord(uid), place=place, values=requested)
            for place, (uid, requested) in enumerate(values.items(), 1)
        ]
        run = MatrixRun(targets=targets, options=options, leaving=list(values))
        await self._plan_all(run)
        if options.all_or_none and run.failed:
            for target in run.accepted:
                target.outcome, target.changes = "not_tried", []
        elif not options.dry_run:
            accepted = run.accepted
            await shielded(self._write_all(run, accepted))  # an exchange of IDs must be completed
            if options.save:
                self._save(run, accepted)
        return targets

    async def _plan_all(self, run: MatrixRun) -> None:
        """Plan until no rejection affects another plan: a rejected servo retains an ID that another one requested."""
        await run.together(run.targets, "plan", self._plan)
        while True:
            self._check_ids(run)
            run.leaving = _leaving(run.accepted)
            moving = [target for target in run.accepted if any(target.wants(key) for key in target.ids)]
            await run.together(moving, "plan", self._plan)
            if all(target.accepted for target in moving):
                return

    async def _plan(self, run: MatrixRun, target: MatrixTarget) -> None:
        target.servo = self._fleet.get(target.uid)
        target.record.identify(target.servo)
        options = replace(run.write_options(target), dry_run=True)
        if run.options.dry_run:
            planned = await self._changes.edit(target.servo, target.values, options)
            target.changes, target.plan = planned.changes, planned.plan
        else:
            if run.options.save:
                save = RestartOptions(run.options.lease_id, confirm=run.options.confirm, values=target.values)
                self._restarting.check(target.servo, "save", save)
            target.changes = (await self._changes.apply(target.servo, target.values, options)).changes
        target.outcome = "planned"

    def _check_ids(self, run: MatrixRun) -> None:
        """Reject servos that request an ID requested or retained by another one."""
        for key in self._fleet.catalog.unique:
            while True:
                accepted = run.accepted
                try:
                    check_ids(_ids(run.targets, key), _wanted(accepted, key))
                    break
                except Conflict as conflict:
                    conflict.facts["key"] = key
                    for target in accepted:
                        if target.uid in conflict.facts["uids"]:  # pyright: ignore[reportOperatorIssue] - a list
                            target.fail(conflict)

    async def _write_all(self, run: MatrixRun, accepted: Sequence[MatrixTarget]) -> None:
        run.leaving = _leaving(accepted)
        run.tied = {
            uid for key in self._fleet.catalog.unique for uid in _tied(_ids(accepted, key), _wanted(accepted, key))
        }
        await run.together(accepted, "write", self._write)
        tied = [target for target in accepted if target.uid in run.tied]
        if tied:
            await self._swap(run, tied)

    async def _write(self, run: MatrixRun, target: MatrixTarget) -> None:
        """Write the rows of one servo, except the IDs of tied servos, which are written last."""
        tied = target.ids if target.uid in run.tied else ()
        later = [change for change in target.changes if change.key in tied]
        values = {key: value for key, value in target.values.items() if key not in tied}
        written: list[Change] = []
        if values:
            outcome = await self._apply(target, values, run.write_options(target))
            if outcome.failure is not None:
                target.outcome, target.changes = outcome.outcome, outcome.changes
                raise outcome.failure
            written = outcome.changes
        target.outcome, target.changes = "applied", [*written, *later]

    async def _swap(self, run: MatrixRun, tied: list[MatrixTarget]) -> None:
        """Write the IDs of tied servos after all their other rows. On a failure roll back everything."""
        run.options = replace(run.options, revisions={})
        failure = next((one.problem for one in tied if one.outcome != "applied"), None)
        titles = ", ".join(one.title for one in tied)
        if failure is None:
            failure = await self._exchange(run, tied)
        if failure is None:
            for one in tied:
                one.changes = _with_ids(one, "applied")
            return
        for one in tied:
            if one.outcome == "applied":
                await self._roll_back(run, one)
                one.problem = Conflict(
                    f"The exchange of IDs among {titles} failed: {failure.detail}",
                    cause="id_exchange_failed",
                    titles=titles,
                    failure=failure.code,
                )
                one.outcome = "rolled_back"

    async def _exchange(self, run: MatrixRun, tied: Sequence[MatrixTarget]) -> HornbillError | None:
        """Write the IDs of tied servos in RAM, one by one. Returns the failure after which all were rolled back."""
        exchange, write = IdExchange(), partial(self._write_id, run)
        servos = {one.uid: one.servo for one in tied if one.servo is not None}
        try:
            for key in self._fleet.catalog.unique:
                now = _ids(tied, key)
                for uid, number in moves(now, _wanted(tied, key)):
                    await exchange.move(IdMove(servos[uid], key, now[uid], number), write)
                    now[uid] = number
        except HornbillError as failure:
            undone = await exchange.roll_back(write, UNDO_WITHIN_S)
            stuck = [
                f"{one.servo.title} ({one.key} {one.number} instead of {one.before})"
                for one, problem in undone
                if problem is not None
            ]
            if stuck:
                text = f"IDs not restored: {', '.join(stuck)}. Read these servos and write their IDs again."
                self._hub.publish(LogEvent("failure", "not_rolled_back", text, params={"ids": stuck}))
            return failure
        return None

    async def _roll_back(self, run: MatrixRun, one: MatrixTarget) -> None:
        """Restore the rows other than IDs, which the swap restores."""
        before = {change.key: change.before for change in one.changes if change.verdict in ("applied", "clamped")}
        before = {key: value for key, value in before.items() if key not in one.ids and value is not None}
        if before.get(KEY) == "on":  # a rollback never turns torque on
            del before[KEY]
        verdict = "rolled_back"
        if before:
            try:
                outcome = await self._apply(one, before, replace(run.write_options(one), leaving=()))
                verdict = "rolled_back" if outcome.failure is None else "no_response"
            except HornbillError:
                verdict = "no_response"
        one.changes = [
            replace(change, after=change.before if verdict == "rolled_back" else None, verdict=verdict)
            if change.key in before else change
            for change in _with_ids(one, "rolled_back")
        ]  # fmt: skip

    async def _write_id(self, run: MatrixRun, move: IdMove) -> None:
        target = next(one for one in run.targets if one.uid == move.servo.uid)
        outcome = await self._apply(target, {move.key: move.number}, run.write_options(target))
        if outcome.failure is not None:
            raise outcome.failure
        if any(change.verdict == "clamped" for change in outcome.changes):
            raise UnexpectedResult(
                f"{target.title} did not accept {move.number} as {move.key}.",
                key=move.key,
                cause="id_not_accepted",
                servo=target.title,
                number=move.number,
            )

    async def _apply(self, target: MatrixTarget, values: Values, options: WriteOptions) -> Outcome:
        assert target.servo is not None
        return await self._changes.apply(target.servo, values, options)

    def _save(self, run: MatrixRun, accepted: Sequence[MatrixTarget]) -> None:
        for target in accepted:
            if target.outcome == "applied" and target.servo is not None:
                try:
                    save = RestartOptions(run.options.lease_id, confirm=run.options.confirm, written=target.changes)
                    target.job = self._restarting.start(target.servo, "save", save)
                except HornbillError as problem:  # the write stays, and the failed save is reported
                    target.problem = problem


def _ids(entries: Sequence[MatrixTarget], key: str) -> dict[Uid, int]:
    return {one.uid: one.servo.raw(key) or 0 for one in entries if one.servo is not None}


def _wanted(entries: Sequence[MatrixTarget], key: str) -> dict[Uid, int]:
    return {one.uid: number for one in entries if (number := one.wants(key)) is not None}


def _leaving(entries: Sequence[MatrixTarget]) -> list[Uid]:
    return [one.uid for one in entries if any(one.wants(key) is not None for key in one.ids)]


def _tied(ids: Mapping[Uid, int], wanted: Mapping[Uid, int]) -> set[Uid]:
    """Servos that request an ID in use by another one, and the servos that use it."""
    found: set[Uid] = set()
    for uid, number in wanted.items():
        holders = {other for other, held in ids.items() if number and held == number and other != uid}
        found |= holders | {uid} if holders else set()
    return found


def _with_ids(one: MatrixTarget, verdict: str) -> list[Change]:
    done = verdict == "applied"
    return [
        replace(change, after=change.requested if done else change.before, verdict=verdict)
        if change.key in one.ids and change.requested != change.before
        else replace(change, verdict="unchanged") if change.key in one.ids else change
        for change in one.changes
    ]  # fmt: skip
