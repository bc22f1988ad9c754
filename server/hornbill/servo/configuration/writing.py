"""Writes of one change, their verification, and rollback on failure."""

import asyncio
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from hornbill.domain.change import Change, Reason, SavePreview, Verdict
from hornbill.domain.note import Note
from hornbill.errors import BadRequest, BusDisconnected, HornbillError, NoResponse, Refused, UnexpectedResult
from hornbill.schema import scale
from hornbill.schema.parameter import Parameter
from hornbill.servo.configuration.proving import difference
from hornbill.servo.device import permission
from hornbill.servo.device.output import KEY, off_mode
from hornbill.servo.device.requests import READ, WRITE
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.motion import Motion
from hornbill.servo.runtime.hub import LogEvent, ServoChanged
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.store.audit import NewAuditEntry
from hornbill.units import Instant, Raw, Uid

KEEP_WRITING = replace(WRITE, tries=READ.tries)
"""With 20 % frame loss a write (three frames in each direction) succeeds in 0.26 of its tries: 10 tries fail once in 20
writes, 25 tries once in 2,000. After 3 s without a response a node counts as offline."""

UNDO_WITHIN_S = 10.0
"""Timeout of a rollback on a servo that became silent. It may be restarting: 3 s, then a soft start, during which
nothing is written."""

CHECK_PERIOD_S = 0.05


@dataclass(frozen=True, slots=True)
class WriteOptions:
    """Options of a write. `by` defaults to the lease holder; `by`, `job` and `reason` are for snapshot and audit.

    `save`: a save follows, so torque on is left to it. `confirm`: confirmed words of NeedsConfirmation (supply,
    temperature, multi_turn). `leaving`: servos whose IDs do not count as in use, because the same run moves them.
    """

    lease_id: str | None = None
    dry_run: bool = False
    save: bool = False
    revision: str | None = None
    confirm: Collection[str] = ()
    leaving: Collection[Uid] = ()
    by: str | None = None
    job: str | None = None
    reason: Reason | None = None


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of a change. `outcome`: applied, rolled_back or planned. `changes` excludes keys not reached before a
    rollback.

    `job`: the save that follows. `plan`: that save, after a dry run.
    """

    outcome: str
    changes: list[Change]
    failure: HornbillError | None = None
    job: RunningJob | None = None
    plan: SavePreview | None = None


@dataclass(frozen=True, slots=True)
class Write:
    """One row to write: raw value before, as just read, and raw value to write."""

    row: Parameter
    before: Raw
    raw: Raw


class Writing:
    """Writes already checked rows of one servo atomically, and audits them."""

    def __init__(self, services: HostServices, motion: Motion) -> None:
        self._requests = services.requests
        self._hub = services.hub
        self._base = services.base
        self._audit = services.audit
        self._motion = motion

    async def all_or_nothing(self, servo: Servo, listed: Sequence[Write], by: str, options: WriteOptions) -> Outcome:
        """Write all in this order, then read all back. On any failure restore the previous values in reverse order.

        Never raises HornbillError: a failure is in the outcome. If a servo acknowledges a write with another value, the
        row is `clamped` and stays. A later read must return the acknowledged value.
        """
        tried: list[Write] = []
        acknowledged: dict[str, Raw] = {}
        try:
            for one in listed:
                if one.raw == one.before:
                    continue
                tried.append(one)
                if one.row.key == KEY:
                    acknowledged[KEY] = await self._motion.switch(servo, one.raw, options.lease_id)
                else:
                    acknowledged[one.row.key] = await self._requests.write(servo, one.row, one.raw, KEEP_WRITING)
            await self._verify(servo, tried, acknowledged)
        except HornbillError as error:
            incomplete = len(acknowledged) < len(tried)
            refused = tried[-1].row.key if isinstance(error, Refused | BadRequest) and incomplete else ""
            held = await self._undo(servo, tried, refused, error)
            self._publish_not_restored(servo, tried, held)
            outcome = Outcome("rolled_back", self._undone(servo, listed, held, refused), error)
        else:
            changes: list[Change] = []
            for one in listed:
                after = acknowledged.get(one.row.key, one.before)
                verdict = "unchanged" if one.raw == one.before else "applied" if after == one.raw else "clamped"
                changes.append(change(servo, listed, one, after, verdict))
            outcome = Outcome("applied", changes)
        finally:
            self._hub.publish(ServoChanged(servo.uid))
        self._note(servo, outcome, by, options)
        return outcome

    def _note(self, servo: Servo, outcome: Outcome, by: str, options: WriteOptions) -> None:
        """One audit entry per written key. Commands and keep-alives are not audited: a rig sends 1,000 per second."""
        failure = () if outcome.failure is None else (Note.of(outcome.failure),)
        notes = (*(options.reason.notes if options.reason else ()), *failure)
        self._audit.note(
            *(
                NewAuditEntry(
                    by, "torque" if one.key == KEY else "write", one.verdict, servo.uid, one.key,
                    one.before, one.requested, one.after, notes, options.job,
                )
                for one in outcome.changes
                if one.verdict != "unchanged"
            )
        )  # fmt: skip

    async def _verify(self, servo: Servo, written: list[Write], acknowledged: Mapping[str, Raw]) -> None:
        """Read all rows. Raises UnexpectedResult if one differs from the acknowledged value, Refused, NoResponse."""
        wrong: list[tuple[dict[str, object], str]] = []
        for one in written:
            wanted, found = acknowledged[one.row.key], await self._requests.read(servo, one.row)
            if found != wanted:
                wrong.append(difference(servo, one.row.key, wanted, found, "is "))
        if wrong:
            raise UnexpectedResult(
                f"{servo.title} acknowledged all values, but some differ afterwards: "
                f"{'; '.join(text for _, text in wrong)}. It may have restarted, or another tool may write to it.",
                differences=[fact for fact, _ in wrong],
                cause="values_not_retained",
                servo=servo.title,
                keys=[fact["key"] for fact, _ in wrong],
            )

    async def _undo(
        self, servo: Servo, tried: list[Write], refused: str, error: HornbillError
    ) -> dict[str, Raw | None]:
        """Restore the values before `tried` in reverse order and read them back. Returns the values, None if unknown.

        A servo that became silent is written to only after its next status: a restart must be detected first, because
        nothing is written during soft start, and a value written before that would be mistaken for the ROM value.
        Torque is never turned on again, because that would move the horn.
        """
        held: dict[str, Raw | None] = {}
        remaining = {one.row.key: one for one in reversed(tried)}
        if self._leave_torque(servo, remaining.get(KEY)):
            remaining.pop(KEY)
            held[KEY] = servo.raw(KEY)
        until = self._base.now() + UNDO_WITHIN_S
        silent_since = self._base.now() if isinstance(error, NoResponse | UnexpectedResult) else None
        while remaining and self._base.now() < until:
            if self._ready(servo, silent_since):
                try:
                    boot_count = servo.boot_count
                    stuck = [key for key, one in remaining.items() if not await self._restore(servo, one)]
                    for key, one in list(remaining.items()):
                        held[key] = await self._found(servo, one, was_refused=key == refused)
                        if servo.boot_count == boot_count and (held[key] == one.before or key in stuck):
                            del remaining[key]
                except NoResponse:
                    silent_since = self._base.now()
                except BusDisconnected:
                    break
            if remaining:
                await asyncio.sleep(CHECK_PERIOD_S)
        return held | dict.fromkeys(remaining)

    @staticmethod
    def _leave_torque(servo: Servo, one: Write | None) -> bool:
        """Whether torque mode must not be restored: it was on, or torque was turned off meanwhile."""
        return one is not None and (one.before == 0 or servo.raw(KEY) not in (one.raw, None))

    @staticmethod
    def _ready(servo: Servo, silent_since: Instant | None) -> bool:
        try:
            permission.check_writable(servo)
        except HornbillError:
            return False
        return silent_since is None or (servo.status_at is not None and servo.status_at > silent_since)

    async def _restore(self, servo: Servo, one: Write) -> bool:
        """Write the previous value. Returns False if refused. Raises NoResponse, BusDisconnected."""
        try:
            if one.row.key == KEY:
                await self._motion.disable_torque(servo, off_mode(one.before))
            else:
                await self._requests.write(servo, one.row, one.before, KEEP_WRITING)
        except Refused:
            return False
        return True

    async def _found(self, servo: Servo, one: Write, *, was_refused: bool) -> Raw | None:
        """RAM value of a row, None if unknown. A row that refuses both write and read is unchanged."""
        try:
            return await self._requests.read(servo, one.row)
        except Refused:
            return one.before if was_refused else None

    @staticmethod
    def _undone(servo: Servo, listed: Sequence[Write], held: Mapping[str, Raw | None], refused: str) -> list[Change]:
        changes: list[Change] = []
        for one in listed:
            key = one.row.key
            if one.raw == one.before:
                changes.append(change(servo, listed, one, one.before, "unchanged"))
            elif key in held:
                changes.append(
                    change(servo, listed, one, held[key], _verdict(one, held[key], was_refused=key == refused))
                )
        return changes

    def _publish_not_restored(self, servo: Servo, tried: list[Write], held: Mapping[str, Raw | None]) -> None:
        lost = [one for one in tried if one.row.key != KEY and held[one.row.key] != one.before]
        if lost:
            names = ", ".join(one.row.label for one in lost)
            params: dict[str, object] = {"servo": servo.title, "keys": [one.row.key for one in lost]}
            text = f"Not all values of {servo.title} could be restored: {names}. Read it and restore the last snapshot."
            self._hub.publish(LogEvent("failure", "not_rolled_back", text, servo.uid, params))


def change(servo: Servo, writes: Iterable[Write], one: Write, after: Raw | None, verdict: Verdict) -> Change:
    """Result of one of these writes, in engineering values.

    The unit of 0x36 follows 0x37 (section 4.30), which may be among the writes. So each value is in the unit that
    applied to it: the previous value in the previous unit, the requested value in the requested unit.
    """
    now = servo.raws()
    before = {**now, **{each.row.key: each.before for each in writes}}
    wanted = {**now, **{each.row.key: each.raw for each in writes}}
    return Change(
        one.row.key, scale.to_value(one.row, one.before, before), scale.to_value(one.row, one.raw, wanted),
        None if after is None else scale.to_value(one.row, after, now), verdict,
    )  # fmt: skip


def _verdict(one: Write, held: Raw | None, *, was_refused: bool) -> Verdict:
    if held is None:
        return "no_response"
    if held == one.before:
        return "refused" if was_refused else "rolled_back"
    if one.row.key == KEY and one.raw == 0:
        return "rolled_back"  # off instead of brake, or the reverse: torque was turned off meanwhile
    return "applied" if held == one.raw else "clamped"
