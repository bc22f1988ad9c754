"""Atomic changes of several rows: check all, take a snapshot, write, verify, and roll back on failure."""

import asyncio
import logging
import math
import re
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import cast

from hornbill.domain.change import Change, Reason, Verdict
from hornbill.domain.note import Note
from hornbill.errors import (
    BadRequest,
    Busy,
    ForbiddenParameter,
    HornbillError,
    InvalidValue,
    NoResponse,
    NotInThisModel,
    ReadOnly,
    Refused,
    StaleRevision,
    StoreFailed,
    TorqueOn,
)
from hornbill.schema import scale
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import Value
from hornbill.servo.configuration import rules
from hornbill.servo.configuration.claims import Claims
from hornbill.servo.configuration.history import History
from hornbill.servo.configuration.restart_plan import RestartOptions
from hornbill.servo.configuration.restarting import Restarting
from hornbill.servo.configuration.writing import Outcome, Write, WriteOptions, Writing, change
from hornbill.servo.device import permission
from hornbill.servo.device.output import KEY, ON
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.motion import Motion
from hornbill.servo.runtime.hub import ReadingChanged, ServoChanged
from hornbill.servo.runtime.shielded import shielded
from hornbill.store.audit import NewAuditEntry
from hornbill.units import Raw, Uid

log = logging.getLogger(__name__)

_ADDRESS = re.compile(r"0*x[0-9a-f]+|[0-9]+|[0-9a-f]+h")


def not_a_key(key: str) -> bool:
    """Whether `key` names the boot loader (0x49, in any spelling) or a register by address. Neither is a key."""
    plain = key.strip().casefold().replace("-", "_").replace(" ", "_")
    return plain in ("boot_loader", "bootloader", "booting_loader") or _ADDRESS.fullmatch(plain) is not None


class Changes:
    """Writes configuration rows. Refuses motion rows, which belong to Motion."""

    def __init__(
        self,
        services: HostServices,
        motion: Motion,
        history: History,
        claims: Claims,
        restarting: Restarting,
    ) -> None:
        self._requests = services.requests
        self._hub = services.hub
        self._base = services.base
        self._leases = services.leases
        self._audit = services.audit
        self._motion = motion
        self._history = history
        self._claims = claims
        self._restarting = restarting
        self._writing = Writing(services, motion)

    def row(self, servo: Servo, key: str) -> Parameter:
        """Row of `key` on this servo. Raises Unknown (no such key), ForbiddenParameter or NotInThisModel."""
        if not_a_key(key):
            raise ForbiddenParameter(
                f"hornbill never reads or writes the register {key[:20]}.",
                key=key[:20],
                cause="register_forbidden",
            )
        known = servo.catalog.parameter(key)
        register = servo.registers.get(key)
        if register is not None:
            return register.parameter
        if servo.model is None:
            raise NotInThisModel(
                f"{servo.title} is not identified yet. Wait until it is ready.",
                key=key,
                cause="identification_incomplete",
                servo=servo.title,
            )
        firmware = servo.firmware_text or "unknown"
        raise NotInThisModel(
            f"{servo.title} ({servo.model.name}, firmware {firmware}) does not have {key} ({known.name})."
            + (f" It was added in {known.since}." if known.since != servo.catalog.firmware_steps[0] else ""),
            key=key,
            cause="not_in_firmware",
            servo=servo.title,
            firmware=firmware,
        )

    def number(self, row: Parameter, value: object) -> float:
        """`value` as the number for a command. Raises InvalidValue."""
        try:
            found = math.nan if isinstance(value, bool) or not isinstance(value, int | float) else float(value)
        except OverflowError:
            found = math.inf
        if not math.isfinite(found):
            raise InvalidValue(
                f"{row.label} is a number in {row.unit}. Enter {scale.allowed(row)}.",
                key=row.key,
                cause="not_a_number",
                unit=row.unit,
            )
        return found

    def plan(
        self,
        servo: Servo,
        values: Mapping[str, object],
        *,
        confirm: Collection[str] = (),
        leaving: Collection[Uid] = (),
    ) -> dict[str, Raw]:
        """Raw values to write, each checked against the last known state. Sends nothing.

        `confirm`: confirmed words of NeedsConfirmation (supply, temperature, multi_turn). `leaving`: servos whose IDs
        do not count as in use, because the same batch moves them. Raises the first problem: Unknown, NotInThisModel,
        ForbiddenParameter, ReadOnly, OutOfRange, InvalidValue, TorqueOn, Conflict, NeedsConfirmation.
        """
        rows = {key: self.row(servo, key) for key in values}
        permission.check_series(servo)
        now = servo.raws()
        known: dict[str, Raw | None] = dict(now)
        wanted: dict[str, Raw] = {}
        for key, row in sorted(rows.items(), key=lambda item: item[1].unit_when is not None):
            wanted[key] = known[key] = self._raw(servo, row, values[key], known)
        everywhere = {key: register.parameter for key, register in servo.registers.items()}
        for key in servo.catalog.unique:
            if key in wanted and wanted[key] not in (0, now.get(key)):
                rules.check_id(rows[key], wanted[key], self._claims.of(key, servo, leaving))
        rules.check_readings(everywhere, now, wanted, confirm)
        rules.check_turns(everywhere, now, wanted, confirm)
        return wanted

    def _raw(self, servo: Servo, row: Parameter, value: object, known: Mapping[str, Raw | None]) -> Raw:
        if row.group == "command":
            raise InvalidValue(
                f"{row.key} moves the horn, so it is not a configuration row. Use a motion command.",
                key=row.key,
                uid=servo.uid,
                cause="motion_command",
            )
        if not row.writable:
            raise ReadOnly(f"{row.label} ({row.name}) is read-only.", key=row.key, cause="read_only")
        try:
            raw = scale.to_raw(row, value, known)
        except BadRequest as error:
            error.facts.setdefault("key", row.key)
            raise
        if row.moves_horn and servo.raw(KEY) == ON and raw != servo.raw(row.key):
            raise TorqueOn(
                f"Changing {row.label.lower()} while torque is on would move the horn of {servo.title}. "
                "Turn torque off first.",
                key=row.key,
                cause="torque_on",
                servo=servo.title,
            )
        return raw

    async def edit(self, servo: Servo, values: Mapping[str, object], options: WriteOptions) -> Outcome:
        """`apply`, then save if `save` is set. Joins a running save of the same values.

        Raises the errors of `apply` and Restarting.check before anything is written. If the save cannot start after the
        write, the written values stay, and the outcome contains the failure.
        """
        if not options.save:
            return await self.apply(servo, values, options)
        if not options.dry_run and options.revision is None:
            job = self._restarting.save_in_progress(servo, values, options.lease_id)
            if job is not None:
                held = cast("Mapping[str, Value]", values)
                return Outcome("applied", [Change(key, v, v, v, "unchanged") for key, v in held.items()], job=job)
        wanted = RestartOptions(options.lease_id, confirm=options.confirm, values=values, leaving=options.leaving)
        self._restarting.check(servo, "save", wanted)
        outcome = await self.apply(servo, values, options)
        if outcome.outcome == "planned":
            raws = self.plan(servo, values, confirm=options.confirm, leaving=options.leaving)
            return replace(outcome, plan=await self._restarting.plan(servo, "save", replace(wanted, raws=raws)))
        if outcome.outcome != "applied":
            return outcome
        try:
            written = RestartOptions(options.lease_id, confirm=options.confirm, written=outcome.changes)
            return replace(outcome, job=self._restarting.start(servo, "save", written))
        except HornbillError as error:
            return replace(outcome, failure=error)

    async def apply(self, servo: Servo, values: Mapping[str, object], options: WriteOptions) -> Outcome:
        """Check all, take a snapshot, write all, read all back. On any failure restore the previous values.

        A value of torque_mode is staged: it stays the configured value even if a stop or a lease switches the output.
        With `save` and output off, torque on is left to the save: it needs no lease, and its verdict is "planned".

        Before the first write it raises the errors of `plan`, StaleRevision, LeaseHeld, Busy, Refused, NoResponse,
        BusDisconnected, StoreFailed, and for torque on LeaseRequired, Stopped, ConfigurationLost. Later failures are in
        the outcome.
        """
        lease_id, revision, dry_run = options.lease_id, options.revision, options.dry_run
        by = options.by or self._leases.who(lease_id, self._base.now())
        taken = None if dry_run else self._disable_torque(servo, values)
        if taken is not None:  # torque off never waits for another change and needs no lease
            self._check_revision(servo, revision)
            before = servo.configured(KEY)
            return self._staged(servo, await self._take_torque(servo, taken, by), taken, before, by)
        async with servo.changing:  # otherwise one change's rollback could undo another change
            self._check(servo, values, lease_id, revision)
            boot_count = servo.boot_count
            await self._read_before(servo, values)
            self._check(servo, values, lease_id, revision)  # the read may have shown a write by another tool
            wanted = self.plan(servo, values, confirm=options.confirm, leaving=options.leaving)
            torque, before = wanted.get(KEY), servo.configured(KEY)
            later = options.save and torque == ON and servo.raw(KEY) != ON
            writes = self._writes(servo, {key: raw for key, raw in wanted.items() if not later or key != KEY})
            if torque == ON and servo.raw(KEY) != ON and not later:
                self._motion.may_move(servo, lease_id)
            changing = [one.row.key for one in writes if one.raw != one.before]
            if torque is not None and torque != before and KEY not in changing:
                changing.append(KEY)
            if dry_run or not changing:
                same, other = "unchanged", "planned"
                listed = [
                    change(servo, writes, one, one.before, other if one.row.key in changing else same) for one in writes
                ]
                planned = Outcome("planned" if dry_run else "applied", listed)
                return planned if torque is None else self._with_torque(servo, planned, torque, before)
            with self._claims.reserved(servo, wanted):
                await self._take_snapshot(servo, options.reason or _reason(changing), by)
                self._check(servo, values, lease_id, None)
                if servo.boot_count != boot_count:
                    raise Busy(
                        f"{servo.title} restarted before anything was written. Read it again.",
                        cause="restarted_before_write",
                        servo=servo.title,
                    )
                writing = asyncio.create_task(self._writing.all_or_nothing(servo, writes, by, options))
                outcome = await shielded(writing)
                return outcome if torque is None else self._staged(servo, outcome, torque, before, by)

    def _staged(self, servo: Servo, outcome: Outcome, torque: Raw, before: Raw | None, by: str) -> Outcome:
        """Stage the requested 0x20 after a successful change, and add it to the outcome."""
        written = next((one.verdict for one in outcome.changes if one.key == KEY), None)
        if outcome.outcome != "applied" or written not in (None, "applied", "unchanged"):
            return outcome
        servo.stage_output(torque, by, self._base.now())
        self._hub.publish(ServoChanged(servo.uid))
        self._hub.publish(ReadingChanged(servo.uid, KEY))
        full = self._with_torque(servo, outcome, torque, before)
        staged = full.changes[-1]
        if written != "applied" and staged.verdict != "unchanged":  # a write already has its entry
            values = staged.before, staged.requested, staged.after
            self._audit.note(NewAuditEntry(by, "torque", staged.verdict, servo.uid, KEY, *values))
        return full

    @staticmethod
    def _with_torque(servo: Servo, outcome: Outcome, torque: Raw, before: Raw | None) -> Outcome:
        """The outcome with 0x20 as configured. `before` is the previously configured value, not the value in RAM."""
        row = servo.catalog.by_key[KEY]
        was = None if before is None else scale.to_value(row, before)
        wanted = scale.to_value(row, torque)
        left = outcome.outcome == "planned" or not any(one.key == KEY for one in outcome.changes)
        verdict = "unchanged" if before == torque else "planned" if left else "applied"
        after = was if outcome.outcome == "planned" else wanted
        others = [one for one in outcome.changes if one.key != KEY]
        return Outcome(outcome.outcome, [*others, Change(KEY, was, wanted, after, verdict)], outcome.failure)

    async def torque(self, servo: Servo, torque: Raw, lease_id: str | None, *, by: str | None = None) -> Raw:
        """Torque on (under a lease), off or brake (always), with an audit entry. Returns the 0x20 read back.

        Raises the errors of Motion.switch.
        """
        by = by or self._leases.who(lease_id, self._base.now())
        row, before = servo.catalog.by_key[KEY], servo.raw(KEY)
        shown, wanted = (None if raw is None else scale.to_value(row, raw) for raw in (before, torque))
        try:
            raw = await self._motion.switch(servo, torque, lease_id, by=by)
        except BadRequest:  # nothing was sent, or a stop intervened, which has its own entry
            raise
        except HornbillError as error:
            entry = NewAuditEntry(by, "torque", _verdict(error), servo.uid, KEY, shown, wanted, notes=(Note.of(error),))
            self._audit.note(entry)
            raise
        self._audit.note(
            NewAuditEntry(by, "torque", "applied", servo.uid, KEY, shown, wanted, scale.to_value(row, raw))
        )
        return raw

    def _disable_torque(self, servo: Servo, values: Mapping[str, object]) -> Raw | None:
        """The 0x20 of off or brake if it is the only requested value."""
        if set(values) != {KEY}:
            return None
        raw = self._raw(servo, self.row(servo, KEY), values[KEY], servo.raws())
        return None if raw == ON else raw

    async def _take_torque(self, servo: Servo, torque: Raw, by: str) -> Outcome:
        before = servo.raw(KEY)
        try:
            after, failure = await self.torque(servo, torque, None, by=by), None
        except HornbillError as error:
            after, failure = None, error
        row = servo.catalog.by_key[KEY]
        old, wanted, new = (None if raw is None else scale.to_value(row, raw) for raw in (before, torque, after))
        changed = Change(KEY, old, wanted, new, _verdict(failure))
        return Outcome("applied" if failure is None else "rolled_back", [changed], failure)

    def _check(self, servo: Servo, values: Mapping[str, object], lease_id: str | None, revision: str | None) -> None:
        self._check_revision(servo, revision)
        self._leases.allow_write(lease_id, self._base.now(), servo.uid)
        for key in values:
            self.row(servo, key)
        permission.check_writable(servo)

    @staticmethod
    def _check_revision(servo: Servo, revision: str | None) -> None:
        if revision is not None and revision != servo.revision:
            raise StaleRevision(
                f"{servo.title} changed since revision {revision}; it is now at {servo.revision}. Read it again.",
                revision=servo.revision,
                cause="changed_since_read",
                servo=servo.title,
            )

    async def _read_before(self, servo: Servo, values: Mapping[str, object]) -> None:
        """Read the rows to write and those they are checked against. Raises NoResponse, Refused, BusDisconnected."""
        rows = {key: register.parameter for key, register in servo.registers.items()}
        keys = [*values, *rules.to_read(rows, values)]
        if any(rows[key].moves_horn for key in values):
            keys.append(KEY)
        for key in values:
            other = servo.registers[key].parameter.unit_when
            keys += [] if other is None else [other.parameter]
        for key in dict.fromkeys(keys):
            register = servo.registers.get(key)
            if register is None:
                continue
            row = register.parameter
            try:
                await self._requests.read(servo, row)
            except Refused as error:
                raise Refused(
                    f"{servo.title} refused a read of {key} ({row.name}) before the write. Nothing was written. "
                    "Try again. If this repeats, the servo does not have this row.",
                    key=key,
                    cause="read_refused_before_write",
                    servo=servo.title,
                ) from error

    @staticmethod
    def _writes(servo: Servo, wanted: Mapping[str, Raw]) -> list[Write]:
        """In the requested order, torque last."""
        writes: list[Write] = []
        for key in sorted(wanted, key=lambda key: key == KEY):
            before = servo.raw(key)
            assert before is not None, f"{key} was not read before the write"
            writes.append(Write(servo.registers[key].parameter, before, wanted[key]))
        return writes

    async def _take_snapshot(self, servo: Servo, reason: Reason, by: str) -> None:
        try:
            await self._history.take(self._requests, servo, reason=reason, by=by)
        except HornbillError:
            raise
        except Exception as error:  # for example a full disk: without a snapshot the change could not be undone
            log.exception("No snapshot of %s", servo.title)
            raise StoreFailed(
                f"The snapshot of {servo.title} could not be stored, so nothing was written. "
                "Check the data folder and its disk.",
                cause="snapshot_not_stored",
                servo=servo.title,
            ) from error


def _reason(keys: list[str]) -> Reason:
    more = f" and {len(keys) - 1} more" if len(keys) > 1 else ""
    return Reason(f"before a change of {keys[0]}{more}", "change", {"key": keys[0], "more": len(keys) - 1})


def _verdict(failure: HornbillError | None) -> Verdict:
    if failure is None:
        return "applied"
    return "no_response" if isinstance(failure, NoResponse) else "refused"
