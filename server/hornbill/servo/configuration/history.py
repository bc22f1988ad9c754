"""Snapshots of a servo's configuration, before each change and on request."""

from collections.abc import Mapping
from functools import partial
from typing import Any, cast

from hornbill.domain.change import Reason, ReasonCode
from hornbill.domain.fields import Param
from hornbill.errors import Busy, NoResponse
from hornbill.servo.device.identification import read_rows
from hornbill.servo.device.requests import ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.audit import Audit
from hornbill.store.audit import NewAuditEntry
from hornbill.store.snapshots import StoredSnapshot
from hornbill.store.store import Store
from hornbill.store.tables import Json
from hornbill.units import Raw


class History:
    """Takes and deletes snapshots: all rows stored in ROM (0x20 to 0x46, section 4.11) with identity, raw by key."""

    def __init__(self, store: Store, audit: Audit) -> None:
        self._store = store
        self.snapshots = store.snapshots
        self._audit = audit

    async def take(
        self, requests: ServoRequests, servo: Servo, *, reason: Reason, by: str, automatic: bool = True
    ) -> StoredSnapshot:
        """Store the RAM values and the known ROM values. Rows without a current reading are read first.

        A manual snapshot reads every row, because another tool may have written it. An automatic one that equals the
        newest is not stored again; the newest is returned. Call it under the servo's `changing` lock. Raises
        NoResponse, BusDisconnected, and Busy after a restart and during soft start, when five rows read temporary
        values (section 4.14).
        """
        if not servo.online:
            raise NoResponse(
                f"{servo.title} is offline and cannot be read. Check its supply and wiring.",
                cause="offline",
                servo=servo.title,
            )
        if servo.soft_starting:
            raise Busy(
                f"{servo.title} is in soft start, so its readings are temporary. Wait until soft start has finished.",
                state=servo.state.value,
                cause="read_during_soft_start",
                servo=servo.title,
            )
        boot_count = servo.boot_count
        rows = [key for key, one in servo.registers.items() if one.parameter.rom]
        await read_rows(requests, servo, [key for key in rows if not automatic or _unread(servo, key)])
        if servo.boot_count != boot_count:
            raise Busy(
                f"{servo.title} restarted during the read. Try again when it is ready.",
                cause="restarted_during_read",
                servo=servo.title,
            )
        return await self.store_known(servo, reason=reason, by=by, automatic=automatic)

    async def store_known(self, servo: Servo, *, reason: Reason, by: str, automatic: bool) -> StoredSnapshot:
        """Store the known values without reading the servo. Unknown rows are left out.

        While the database is unreachable, an automatic snapshot waits in memory; its ID is then 0. Raises
        StoreFailed.
        """
        values: dict[str, Any] = {
            "reason": reason.text, "by": by, "automatic": automatic,
            "model": servo.model.name if servo.model else None, "firmware": servo.firmware,
            "schema_revision": servo.catalog.revision, "ram": configured_values(servo), "rom": servo.rom(),
            "reason_code": reason.code, "reason_params": cast("Mapping[str, Json]", reason.params),
        }  # fmt: skip
        add = partial(self.snapshots.add, servo.uid, unless_same=automatic, **values)
        made = await (self._store.run_or_later(add) if automatic else self._store.run(add))
        if made is None:
            made = StoredSnapshot(0, servo.uid, self._store.now(), **values)
        if not automatic:
            self._audit.note(_entry(made, by, "succeeded", after=made.id))
        return made

    async def drop(self, snapshot: StoredSnapshot, *, by: str) -> None:
        """Delete a snapshot. Raises Unknown (unknown_snapshot) if it was deleted already."""
        await self._store.run(self.snapshots.drop, snapshot.id)
        self._audit.note(_entry(snapshot, by, "dropped", before=snapshot.id))


def _entry(
    one: StoredSnapshot, by: str, outcome: str, *, before: int | None = None, after: int | None = None
) -> NewAuditEntry:
    code, params = cast("ReasonCode | None", one.reason_code), cast("dict[str, Param]", dict(one.reason_params or {}))
    notes = Reason(one.reason, code, params).notes
    return NewAuditEntry(by, "snapshot", outcome, one.uid, None, before, None, after, notes)


def configured_values(servo: Servo) -> dict[str, Raw]:
    """Known configured values of the rows stored in ROM, raw by key. Never a temporary value (4.14)."""
    return {
        key: raw
        for key, one in servo.registers.items()
        if one.parameter.rom and not _unread(servo, key) and (raw := servo.configured(key)) is not None
    }


def _unread(servo: Servo, key: str) -> bool:
    """Whether the RAM value of a row stored in ROM is unknown."""
    one = servo.registers[key]
    return one.parameter.rom and (one.at is None or servo.temporary(key))
