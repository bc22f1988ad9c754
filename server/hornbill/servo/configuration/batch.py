"""Owns Batch: parameters × servos as one: read together, planned together, each servo changed all or nothing."""

import asyncio
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

from hornbill.errors import Conflict, HornbillError, NotAsWanted
from hornbill.servo.asking import Asker
from hornbill.servo.configuration import torque_in_rom
from hornbill.servo.configuration.changes import Changes
from hornbill.servo.configuration.ordering import moves
from hornbill.servo.configuration.saving import Saving
from hornbill.servo.configuration.swapping import IDS, Moved, Swap
from hornbill.servo.configuration.writing import Change, Outcome
from hornbill.servo.fleet import Fleet
from hornbill.servo.hub import Hub
from hornbill.servo.identification import read_rows
from hornbill.servo.jobs import Job
from hornbill.servo.leases import Leases
from hornbill.servo.servo import Servo
from hornbill.servo.timebase import TimeBase
from hornbill.servo.unbroken import unbroken
from hornbill.units import Uid

Values = Mapping[str, object]
REASON = "matrix"


@dataclass(slots=True)
class Entry:
    """One servo of a batch. `outcome`: planned, rejected, not_tried, applied or rolled_back."""

    uid: Uid
    values: Values
    servo: Servo | None = None
    outcome: str = "planned"
    changes: list[Change] = field(default_factory=list[Change])
    problem: HornbillError | None = None
    job: Job | None = None

    @property
    def accepted(self) -> bool:
        """Whether it may be written."""
        return self.outcome == "planned"

    def reject(self, problem: HornbillError) -> None:
        """It may not be written."""
        self.outcome, self.problem, self.changes = "rejected", problem, []

    def wants(self, key: str) -> int | None:
        """The id asked for, once it is planned; None when it is not to change."""
        asked = (one.requested for one in self.changes if one.key == key and one.requested != one.before)
        return next((int(value) for value in asked if isinstance(value, int | float)), None)


@dataclass(frozen=True, slots=True)
class Order:
    """How a batch is written; see `Changes.apply`."""

    lease_id: str | None
    revisions: Mapping[str, str]
    confirm: Collection[str] = ()
    dry_run: bool = False
    save: bool = False
    all_or_none: bool = False


class Batch:
    """Reads and changes many servos. Those that pass ids to one another are changed all or none."""

    def __init__(
        self, asker: Asker, hub: Hub, base: TimeBase, leases: Leases, fleet: Fleet, changes: Changes, saving: Saving
    ) -> None:
        self._asker = asker
        self._hub = hub
        self._base = base
        self._leases = leases
        self._fleet = fleet
        self._changes = changes
        self._saving = saving

    async def read(self, uids: Sequence[Uid], keys: Collection[str] | None) -> dict[Uid, HornbillError]:
        """Read rows (all unless named) of many servos from the bus at once; the problem of each that has one."""

        async def one(uid: Uid) -> HornbillError | None:
            try:
                servo = self._fleet.get(uid)
                await read_rows(self._asker, servo, [key for key in servo.registers if keys is None or key in keys])
            except HornbillError as error:
                return error
            return None

        found = await asyncio.gather(*(one(uid) for uid in uids))
        return {uid: problem for uid, problem in zip(uids, found, strict=True) if problem is not None}

    async def write(self, values: Mapping[Uid, Values], order: Order) -> list[Entry]:
        """Plan every servo, then write those that were not rejected; what became of each, in the same order.

        Raises LeaseHeld, before anything was sent; every other problem is the servo's.
        """
        self._leases.allow_write(order.lease_id, self._base.now())
        entries = [Entry(uid, asked) for uid, asked in values.items()]
        await self._plan(entries, order)
        accepted = [one for one in entries if one.accepted]
        if order.all_or_none and len(accepted) < len(entries):
            for one in accepted:
                one.outcome, one.changes = "not_tried", []
            return entries
        if not order.dry_run:
            await unbroken(self._write(accepted, order))  # ids are not left half way
            if order.save:
                self._save(accepted, order)
        return entries

    async def _plan(self, entries: list[Entry], order: Order) -> None:
        """Until no rejection changes another's plan: who does not leave its id keeps it from who wants it."""
        await asyncio.gather(*(self._plan_one(one, order, [one.uid for one in entries]) for one in entries))
        while True:
            self._check_ids(entries)
            accepted = [one for one in entries if one.accepted]
            leaving = _leaving(accepted)
            moving = [one for one in accepted if any(one.wants(key) for key in IDS)]
            await asyncio.gather(*(self._plan_one(one, order, leaving) for one in moving))
            if all(one.accepted for one in moving):
                return

    async def _plan_one(self, one: Entry, order: Order, leaving: Collection[Uid]) -> None:
        try:
            one.servo = self._fleet.get(one.uid)
            if order.save and not order.dry_run:
                self._saving.check(one.servo, order.lease_id)
                await torque_in_rom.require(self._asker, one.servo, order.confirm, one.values)
            one.changes = (await self._apply(one, one.values, order, leaving, dry_run=True)).changes
        except HornbillError as problem:
            one.reject(problem)

    @staticmethod
    def _check_ids(entries: list[Entry]) -> None:
        """Reject who wants what another one of the batch wants, or has and keeps."""
        for key in IDS:
            while True:
                accepted = [one for one in entries if one.accepted]
                try:
                    moves(_ids(entries, key), _wanted(accepted, key))
                    break
                except Conflict as conflict:
                    conflict.facts["key"] = key
                    for one in accepted:
                        if one.uid in conflict.facts["uids"]:  # pyright: ignore[reportOperatorIssue] - a list
                            one.reject(conflict)

    async def _write(self, accepted: list[Entry], order: Order) -> None:
        leaving = _leaving(accepted)
        swapped = {uid for key in IDS for uid in _tied(_ids(accepted, key), _wanted(accepted, key))}
        await asyncio.gather(*(self._write_one(one, order, leaving, whole=one.uid not in swapped) for one in accepted))
        tied = [one for one in accepted if one.uid in swapped]
        if tied:
            await self._swap(tied, order, leaving)

    async def _write_one(self, one: Entry, order: Order, leaving: Collection[Uid], *, whole: bool) -> None:
        values = {key: value for key, value in one.values.items() if whole or key not in IDS}
        one.outcome = "applied"
        later = [] if whole else [change for change in one.changes if change.key in IDS]
        if not values:
            one.changes = later
            return
        try:
            outcome = await self._apply(one, values, order, leaving)
        except HornbillError as problem:
            one.reject(problem)
            return
        one.outcome, one.changes, one.problem = outcome.outcome, outcome.changes, outcome.failure
        if outcome.outcome == "applied":
            one.changes = [*outcome.changes, *later]

    async def _swap(self, tied: list[Entry], order: Order, leaving: Collection[Uid]) -> None:
        """Their ids, last, when all their other rows are written; else everything of all of them is put back."""
        order = replace(order, revisions={})
        failure = next((one.problem for one in tied if one.outcome != "applied"), None)
        titles = ", ".join(one.servo.title for one in tied if one.servo is not None)
        if failure is None:
            swap = Swap(self._hub, lambda moved: self._move(moved, order, leaving))
            ids = {key: (_ids(tied, key), _wanted(tied, key)) for key in IDS}
            failure = await swap.run({one.uid: one.servo for one in tied if one.servo is not None}, ids)
        if failure is None:
            for one in tied:
                one.changes = _with_ids(one, "applied")
            return
        for one in tied:
            if one.outcome == "applied":
                await self._put_back(one, order)
                one.problem = Conflict(
                    f"{titles} pass ids to one another, and it failed: {failure.detail}", cause=failure.code
                )
                one.outcome = "rolled_back"

    async def _put_back(self, one: Entry, order: Order) -> None:
        """What was written before the ids were to be; ids are put back by the swap."""
        before = {change.key: change.before for change in one.changes if change.verdict in ("applied", "clamped")}
        before = {key: value for key, value in before.items() if key not in IDS and value is not None}
        verdict = "rolled_back"
        if before:
            try:
                outcome = await self._apply(one, before, order, ())
                verdict = "rolled_back" if outcome.failure is None else "no_answer"
            except HornbillError:
                verdict = "no_answer"
        one.changes = [
            replace(change, after=change.before if verdict == "rolled_back" else None, verdict=verdict)
            if change.key in before else change
            for change in _with_ids(one, "rolled_back")
        ]  # fmt: skip

    async def _move(self, moved: Moved, order: Order, leaving: Collection[Uid]) -> Outcome:
        entry = Entry(moved.servo.uid, {}, moved.servo)
        outcome = await self._apply(entry, {moved.key: moved.number}, order, leaving)
        if outcome.failure is None and any(change.verdict == "clamped" for change in outcome.changes):
            raise NotAsWanted(f"{moved.servo.title} did not take {moved.number} as {moved.key}.", key=moved.key)
        return outcome

    async def _apply(
        self, one: Entry, values: Values, order: Order, leaving: Collection[Uid], *, dry_run: bool = False
    ) -> Outcome:
        assert one.servo is not None
        return await self._changes.apply(
            one.servo, values, order.lease_id, dry_run=dry_run, revision=order.revisions.get(one.uid),
            confirm=order.confirm, leaving=leaving, reason=REASON,
        )  # fmt: skip

    def _save(self, accepted: list[Entry], order: Order) -> None:
        for one in accepted:
            if one.outcome == "applied" and one.servo is not None:
                try:
                    one.job = self._saving.save(one.servo, order.lease_id, written=one.changes)
                except HornbillError as problem:  # what was written stays written, and that is what must be said
                    one.problem = problem


def _ids(entries: list[Entry], key: str) -> dict[Uid, int]:
    return {one.uid: one.servo.raw(key) or 0 for one in entries if one.servo is not None}


def _wanted(entries: list[Entry], key: str) -> dict[Uid, int]:
    return {one.uid: number for one in entries if (number := one.wants(key)) is not None}


def _leaving(entries: list[Entry]) -> list[Uid]:
    return [one.uid for one in entries if any(one.wants(key) is not None for key in IDS)]


def _tied(ids: Mapping[Uid, int], wanted: Mapping[Uid, int]) -> set[Uid]:
    """Who wants an id that another has now, and who has it."""
    found: set[Uid] = set()
    for uid, number in wanted.items():
        holders = {other for other, held in ids.items() if number and held == number and other != uid}
        found |= holders | {uid} if holders else set()
    return found


def _with_ids(one: Entry, verdict: str) -> list[Change]:
    done = verdict == "applied"
    return [
        replace(change, after=change.requested if done else change.before, verdict=verdict)
        if change.key in IDS and change.requested != change.before
        else replace(change, verdict="unchanged") if change.key in IDS else change
        for change in one.changes
    ]  # fmt: skip
