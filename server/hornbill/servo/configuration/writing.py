"""The writes of one change, the proof that they hold, and their undoing when anything fails."""

import asyncio
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from hornbill.domain.change import Change, Reason, SavePreview, Verdict
from hornbill.domain.note import Note
from hornbill.errors import BadRequest, BusDisconnected, HornbillError, NoResponse, NotAsWanted, Refused
from hornbill.schema import scale
from hornbill.schema.parameter import Parameter
from hornbill.servo.configuration.proving import difference
from hornbill.servo.device import permission
from hornbill.servo.device.output import KEY, taken_by
from hornbill.servo.device.requests import READ, WRITE
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.motion import Motion
from hornbill.servo.runtime.hub import LogEvent, ServoChanged
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.store.audit import NewAuditEntry
from hornbill.units import Instant, Raw, Uid

KEEP_WRITING = replace(WRITE, tries=READ.tries)
"""With a fifth of all frames lost a write (three frames each way) succeeds in 0.26 of its tries: 10 of them fail once
in 20, and 25 once in 2,000. 3 s without an answer is what a silent node is called offline after."""

UNDO_WITHIN_S = 10.0
"""How long a servo that fell silent is waited for, so that it can be put back: it may be restarting (3 s, and a soft
start after it, during which nothing is written)."""

LOOK_AGAIN_S = 0.05


@dataclass(frozen=True, slots=True)
class WriteOptions:
    """Who writes, and how. `by` is the lease's holder by default; `by`, `job` and `reason` are for snapshot and audit.

    `save`: a save follows, so that torque on is left to it. `confirm`: words of NeedsConfirmation (supply, temperature,
    multi_turn) that were answered with yes. `leaving`: servos whose IDs do not count as taken, because the same run
    moves them.
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
    """`outcome`: applied, rolled_back or planned. Of rolled_back, keys that were not come to are not in `changes`.

    `job` is the save that follows, `plan` what that would be after a dry run.
    """

    outcome: str
    changes: list[Change]
    failure: HornbillError | None = None
    job: RunningJob | None = None
    plan: SavePreview | None = None


@dataclass(frozen=True, slots=True)
class Write:
    """One row to write: raw values before, as just read, and wanted."""

    row: Parameter
    before: Raw
    raw: Raw


class Writing:
    """Writes rows of one servo that were checked before, all or nothing, and enters them in the audit."""

    def __init__(self, services: HostServices, motion: Motion) -> None:
        self._requests = services.requests
        self._hub = services.hub
        self._base = services.base
        self._audit = services.audit
        self._motion = motion

    async def all_or_nothing(self, servo: Servo, listed: Sequence[Write], by: str, options: WriteOptions) -> Outcome:
        """Write all in this order, then read all back; on any failure put back what was there, last first.

        Never raises HornbillError: what went wrong is in the outcome. A servo that answers a write with another value
        told so: that is `clamped`, and stays. What it answers afterwards must be what it answered then.
        """
        tried: list[Write] = []
        answers: dict[str, Raw] = {}
        try:
            for one in listed:
                if one.raw == one.before:
                    continue
                tried.append(one)
                if one.row.key == KEY:
                    answers[KEY] = await self._motion.switch(servo, one.raw, options.lease_id)
                else:
                    answers[one.row.key] = await self._requests.write(servo, one.row, one.raw, KEEP_WRITING)
            await self._prove(servo, tried, answers)
        except HornbillError as error:
            refused = tried[-1].row.key if isinstance(error, Refused | BadRequest) and len(answers) < len(tried) else ""
            held = await self._undo(servo, tried, refused, error)
            self._say_what_is_not_back(servo, tried, held)
            outcome = Outcome("rolled_back", self._undone(servo, listed, held, refused), error)
        else:
            changes: list[Change] = []
            for one in listed:
                after = answers.get(one.row.key, one.before)
                verdict = "unchanged" if one.raw == one.before else "applied" if after == one.raw else "clamped"
                changes.append(change(servo, listed, one, after, verdict))
            outcome = Outcome("applied", changes)
        finally:
            self._hub.publish(ServoChanged(servo.uid))
        self._note(servo, outcome, by, options)
        return outcome

    def _note(self, servo: Servo, outcome: Outcome, by: str, options: WriteOptions) -> None:
        """One audit row a key that was written. Commands and keep-alives have none: a rig sends 1,000 a second."""
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

    async def _prove(self, servo: Servo, written: list[Write], answers: Mapping[str, Raw]) -> None:
        """Raises NotAsWanted when a row does not hold what its write answered, Refused or NoResponse when unread."""
        wrong: list[tuple[dict[str, object], str]] = []
        for one in written:
            wanted, found = answers[one.row.key], await self._requests.read(servo, one.row)
            if found != wanted:
                wrong.append(difference(servo, one.row.key, wanted, found, "holds "))
        if wrong:
            raise NotAsWanted(
                f"{servo.title} took every value, and was then found to hold something else: "
                f"{'; '.join(text for _, text in wrong)}. It may have restarted, or another tool writes to it.",
                differences=[fact for fact, _ in wrong],
                cause="values_not_retained",
                servo=servo.title,
                keys=[fact["key"] for fact, _ in wrong],
            )

    async def _undo(
        self, servo: Servo, tried: list[Write], refused: str, error: HornbillError
    ) -> dict[str, Raw | None]:
        """Put back what `tried` held, last first, and read it back; what each row holds then, None where unknown.

        A servo that fell silent is written to again only when it was heard since: a restart must be noticed first, for
        nothing is written during soft start, and what is written before it is noticed would be taken for what ROM
        held. Torque is never turned on again: that would move the horn.
        """
        held: dict[str, Raw | None] = {}
        owed = {one.row.key: one for one in reversed(tried)}
        if self._keeps_torque(servo, owed.get(KEY)):
            owed.pop(KEY)
            held[KEY] = servo.raw(KEY)
        until = self._base.now() + UNDO_WITHIN_S
        silent_since = self._base.now() if isinstance(error, NoResponse | NotAsWanted) else None
        while owed and self._base.now() < until:
            if self._ready(servo, silent_since):
                try:
                    boots = servo.boots
                    stuck = [key for key, one in owed.items() if not await self._put_back(servo, one)]
                    for key, one in list(owed.items()):
                        held[key] = await self._found(servo, one, was_refused=key == refused)
                        if servo.boots == boots and (held[key] == one.before or key in stuck):
                            del owed[key]
                except NoResponse:
                    silent_since = self._base.now()
                except BusDisconnected:
                    break
            if owed:
                await asyncio.sleep(LOOK_AGAIN_S)
        return held | dict.fromkeys(owed)

    @staticmethod
    def _keeps_torque(servo: Servo, one: Write | None) -> bool:
        """Whether torque mode is not for us to put back: it was on, or somebody took torque away meanwhile."""
        return one is not None and (one.before == 0 or servo.raw(KEY) not in (one.raw, None))

    @staticmethod
    def _ready(servo: Servo, silent_since: Instant | None) -> bool:
        try:
            permission.check_writable(servo)
        except HornbillError:
            return False
        return silent_since is None or (servo.status_at is not None and servo.status_at > silent_since)

    async def _put_back(self, servo: Servo, one: Write) -> bool:
        """Whether the servo took it. Raises NoResponse, BusDisconnected."""
        try:
            if one.row.key == KEY:
                await self._motion.torque_away(servo, taken_by(one.before))
            else:
                await self._requests.write(servo, one.row, one.before, KEEP_WRITING)
        except Refused:
            return False
        return True

    async def _found(self, servo: Servo, one: Write, *, was_refused: bool) -> Raw | None:
        """What RAM holds. A row that refuses to be read as it refused to be written was never changed."""
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

    def _say_what_is_not_back(self, servo: Servo, tried: list[Write], held: Mapping[str, Raw | None]) -> None:
        lost = [one for one in tried if one.row.key != KEY and held[one.row.key] != one.before]
        if lost:
            names = ", ".join(one.row.label for one in lost)
            params: dict[str, object] = {"servo": servo.title, "keys": [one.row.key for one in lost]}
            text = f"{servo.title} could not be put back as it was: {names}. Read it, and restore the last snapshot."
            self._hub.publish(LogEvent("failure", "not_rolled_back", text, servo.uid, params))


def change(servo: Servo, writes: Iterable[Write], one: Write, after: Raw | None, verdict: Verdict) -> Change:
    """What becomes of one of these writes, in engineering values.

    The unit of 0x36 follows 0x37 (section 4.30), which may be among the writes: what 0x36 held is shown in the unit
    it had then, what was asked for in the unit it was asked for in.
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
        return "rolled_back"  # off is what brake was to become, or the other way: somebody took torque away
    return "applied" if held == one.raw else "clamped"
