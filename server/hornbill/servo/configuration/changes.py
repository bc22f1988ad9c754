"""Owns Changes: several rows at once, all or nothing: validate, write, read back, and undo on any failure."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

from hornbill.errors import (
    BadRequest,
    ForbiddenParameter,
    HornbillError,
    InvalidValue,
    NoAnswer,
    NotInThisModel,
    ReadOnly,
    StaleRevision,
    TorqueOn,
)
from hornbill.schema import scale
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import Value
from hornbill.servo import permission
from hornbill.servo.asking import WRITE, Asker
from hornbill.servo.hub import Hub, ServoChanged
from hornbill.servo.leases import Leases
from hornbill.servo.motion import Motion
from hornbill.servo.servo import Servo
from hornbill.servo.timebase import TimeBase
from hornbill.units import Raw

_ADDRESS = re.compile(r"0*x[0-9a-f]+|[0-9]+|[0-9a-f]+h")

MOVES_THE_HORN = frozenset(("reverse", "origin"))
"""Rows whose change turns the zero or the direction under a held position (features B70, B94)."""


@dataclass(frozen=True, slots=True)
class Change:
    """What became of one key. `verdict`: planned, applied, clamped, refused, no_answer, unchanged, rolled_back."""

    key: str
    before: Value
    requested: Value
    after: Value
    verdict: str


@dataclass(frozen=True, slots=True)
class Outcome:
    """`outcome`: applied, rolled_back or planned."""

    outcome: str
    changes: list[Change]
    failure: HornbillError | None = None


@dataclass(frozen=True, slots=True)
class _Write:
    row: Parameter
    before: Raw | None
    raw: Raw


def not_a_key(key: str) -> bool:
    """Whether somebody names the boot loader (0x49, in any spelling) or a register by its address: never keys."""
    plain = key.strip().casefold().replace("-", "_").replace(" ", "_")
    return plain in ("boot_loader", "bootloader", "booting_loader") or _ADDRESS.fullmatch(plain) is not None


class Changes:
    """Writes configuration rows. Motion rows go through Motion and are refused here."""

    def __init__(self, asker: Asker, hub: Hub, base: TimeBase, leases: Leases, motion: Motion) -> None:
        self._asker = asker
        self._hub = hub
        self._base = base
        self._leases = leases
        self._motion = motion

    def row(self, servo: Servo, key: str) -> Parameter:
        """The row of that key on this servo. Raises Unknown (no such key) or NotInThisModel."""
        if not_a_key(key):
            raise ForbiddenParameter(
                f"{key[:20]} is a register nothing in hornbill reads or writes. GET /api/v1/schema lists the keys.",
                key=key[:20],
            )
        known = servo.catalog.parameter(key)
        register = servo.registers.get(key)
        if register is not None:
            return register.parameter
        if servo.model is None:
            raise NotInThisModel(f"{servo.title} is of no known model: nothing is read from or written to it.", key=key)
        firmware = servo.firmware_text or "unknown"
        raise NotInThisModel(
            f"{servo.title} ({servo.model.name}, firmware {firmware}) does not have {key} ({known.name})."
            + (f" It came with {known.since}." if known.since != servo.catalog.firmware_steps[0] else ""),
            key=key,
        )

    def number(self, row: Parameter, value: object) -> float:
        """`value` as the number a command needs. Raises InvalidValue."""
        try:
            found = math.nan if isinstance(value, bool) or not isinstance(value, int | float) else float(value)
        except OverflowError:
            found = math.inf
        if not math.isfinite(found):
            raise InvalidValue(f"{row.label} is a number in {row.unit}. Enter {scale.allowed(row)}.", key=row.key)
        return found

    def plan(self, servo: Servo, values: Mapping[str, object]) -> dict[str, Raw]:
        """Raw values to write, every one checked. Raises the first problem; nothing is sent.

        Problems: Unknown, NotInThisModel, ReadOnly, OutOfRange, InvalidValue, TorqueOn.
        """
        rows = {key: self.row(servo, key) for key in values}
        known: dict[str, Raw | None] = dict(servo.raws())
        wanted: dict[str, Raw] = {}
        for key, row in sorted(rows.items(), key=lambda item: item[1].unit_when is not None):
            if row.group == "command":
                raise InvalidValue(
                    f"{key} moves the horn, so it is no configuration. Use POST /api/v1/servos/{servo.uid}/command.",
                    key=key,
                )
            if not row.writable:
                raise ReadOnly(f"{row.label} ({row.name}) can only be read.", key=key)
            try:
                raw = scale.to_raw(row, values[key], known)
            except BadRequest as error:
                error.facts.setdefault("key", key)
                raise
            if key in MOVES_THE_HORN and servo.raw("torque_mode") == 0 and raw != servo.raw(key):
                raise TorqueOn(
                    f"Changing {row.label.lower()} while torque is on would move the horn of {servo.title}. "
                    "Turn torque off first.",
                    key=key,
                )
            wanted[key] = known[key] = raw
        return wanted

    async def apply(
        self,
        servo: Servo,
        values: Mapping[str, object],
        lease_id: str | None,
        *,
        dry_run: bool = False,
        revision: str | None = None,
    ) -> Outcome:
        """Validate all, then write all, reading back; on any failure the old values are written back.

        Raises what `plan` raises, StaleRevision, LeaseHeld, Busy, NoAnswer (before anything was written).
        """
        async with servo.changing:  # or one's roll-back would undo what the other wrote meanwhile
            return await self._apply(servo, values, lease_id, dry_run=dry_run, revision=revision)

    async def _apply(
        self, servo: Servo, values: Mapping[str, object], lease_id: str | None, *, dry_run: bool, revision: str | None
    ) -> Outcome:
        self._check_revision(servo, revision)
        self._leases.allow_write(lease_id, self._base.now())
        for key in values:
            self.row(servo, key)
        permission.check_writable(servo)
        for key in values:
            await self._asker.read(servo, servo.registers[key].parameter)
        if MOVES_THE_HORN & set(values):
            await self._asker.read(servo, servo.registers["torque_mode"].parameter)
        self._check_revision(servo, revision)  # another tool may have written, and only now we know
        wanted = self.plan(servo, values)
        order = sorted(wanted, key=lambda key: key == "torque_mode")
        writes = [_Write(servo.registers[key].parameter, servo.raw(key), wanted[key]) for key in order]
        if wanted.get("torque_mode") == 0 and servo.raw("torque_mode") != 0:
            self._motion.may_move(servo, lease_id)
        if dry_run:
            return Outcome("planned", [self._change(servo, one, one.before, "planned") for one in writes])
        try:
            return await self._write_all(servo, writes, lease_id)
        finally:
            self._hub.tell(ServoChanged(servo.uid))

    @staticmethod
    def _check_revision(servo: Servo, revision: str | None) -> None:
        if revision is not None and revision != servo.revision:
            raise StaleRevision(
                f"{servo.title} was changed since revision {revision}; it is now at {servo.revision}. Read it again.",
                revision=servo.revision,
            )

    async def _write_all(self, servo: Servo, writes: list[_Write], lease_id: str | None) -> Outcome:
        done: list[_Write] = []
        changes: list[Change] = []
        for one in writes:
            if one.raw == one.before:
                changes.append(self._change(servo, one, one.raw, "unchanged"))
                continue
            done.append(one)
            try:
                after = await self._write(servo, one, lease_id)
            except HornbillError as error:
                verdict = "no_answer" if isinstance(error, NoAnswer) else "refused"
                failed = self._change(servo, one, servo.raw(one.row.key), verdict)
                undone = await self._undo(servo, done)
                kept = [undone.get(change.key, change) for change in changes]
                return Outcome("rolled_back", [*kept, replace(failed, after=undone[one.row.key].after)], error)
            changes.append(self._change(servo, one, after, "applied" if after == one.raw else "clamped"))
        return Outcome("applied", changes)

    async def _write(self, servo: Servo, one: _Write, lease_id: str | None) -> Raw:
        if one.row.key != "torque_mode":
            return await self._asker.write(servo, one.row, one.raw, WRITE)
        if one.raw == 0:
            return await self._motion.torque_on(servo, lease_id)
        return await self._motion.torque_away(servo, "off" if one.raw == 1 else "brake")

    async def _undo(self, servo: Servo, done: list[_Write]) -> dict[str, Change]:
        """Write the old values back, last first. Torque is never turned on again: that would move the horn."""
        undone: dict[str, Change] = {}
        for one in reversed(done):
            after = servo.raw(one.row.key)
            if one.before is not None and not (one.row.key == "torque_mode" and one.before == 0):
                try:
                    after = await self._asker.write(servo, one.row, one.before, WRITE)
                except HornbillError:
                    after = None
            verdict = "rolled_back" if after == one.before else "no_answer"
            undone[one.row.key] = self._change(servo, one, after, verdict)
        return undone

    @staticmethod
    def _change(servo: Servo, one: _Write, after: Raw | None, verdict: str) -> Change:
        values = servo.raws()

        def value(raw: Raw | None) -> Value:
            return None if raw is None else scale.to_value(one.row, raw, values)

        return Change(one.row.key, value(one.before), value(one.raw), value(after), verdict)
