"""Take a snapshot of what a servo holds, before every change and by hand."""

from collections.abc import Mapping
from typing import cast

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
    """Snapshots hold every row that ROM keeps (0x20 to 0x46, section 4.11), identity rows too, raw by key."""

    def __init__(self, store: Store, audit: Audit) -> None:
        self._store = store
        self.snapshots = store.snapshots
        self._audit = audit

    async def take(
        self, requests: ServoRequests, servo: Servo, *, reason: Reason, by: str, automatic: bool = True
    ) -> StoredSnapshot:
        """Keep what RAM holds now, and what is known of ROM. Rows whose reading is not current are read first.

        One made by hand reads every row: another tool may have written it since. An automatic one that would repeat
        the newest is not kept again: the answer is that one. Call it while nobody else can change the servo (its
        `changing` lock). Raises NoResponse, BusDisconnected,
        and Busy during soft start, when five rows read temporary values (section 4.14), and after a restart.
        """
        if not servo.online:
            raise NoResponse(
                f"{servo.title} is offline: what it holds cannot be read. Check its supply and the wiring.",
                cause="offline",
                servo=servo.title,
            )
        if servo.soft_starting:
            raise Busy(
                f"{servo.title} is in soft start, so what it answers is not what it holds. Wait until it is over.",
                state=servo.state.value,
                cause="soft_start_reads",
                servo=servo.title,
            )
        boots = servo.boots
        rows = [key for key, one in servo.registers.items() if one.parameter.rom]
        await read_rows(requests, servo, [key for key in rows if not automatic or _unread(servo, key)])
        if servo.boots != boots:
            raise Busy(
                f"{servo.title} restarted while it was read. Try again when it is ready.",
                cause="restarted_while_read",
                servo=servo.title,
            )
        return await self.keep(servo, reason=reason, by=by, automatic=automatic)

    async def keep(self, servo: Servo, *, reason: Reason, by: str, automatic: bool) -> StoredSnapshot:
        """Keep what is known now, without asking the servo; rows that are not known are left out."""
        made = await self._store.run(
            self.snapshots.add, servo.uid, reason=reason.text, by=by, automatic=automatic,
            model=servo.model.name if servo.model else None, firmware=servo.firmware,
            schema_revision=servo.catalog.revision, ram=held(servo), rom=servo.rom(), unless_same=automatic,
            reason_code=reason.code, reason_params=cast("Mapping[str, Json]", reason.params),
        )  # fmt: skip
        if not automatic:
            self._audit.note(_entry(made, by, "succeeded", after=made.id))
        return made

    async def drop(self, snapshot: StoredSnapshot, *, by: str) -> None:
        """Forget a snapshot. Raises Unknown (unknown_snapshot) when somebody else just did."""
        await self._store.run(self.snapshots.drop, snapshot.id)
        self._audit.note(_entry(snapshot, by, "dropped", before=snapshot.id))


def _entry(
    one: StoredSnapshot, by: str, outcome: str, *, before: int | None = None, after: int | None = None
) -> NewAuditEntry:
    code, params = cast("ReasonCode | None", one.reason_code), cast("dict[str, Param]", dict(one.reason_params or {}))
    notes = Reason(one.reason, code, params).notes
    return NewAuditEntry(by, "snapshot", outcome, one.uid, None, before, None, after, notes)


def held(servo: Servo) -> dict[str, Raw]:
    """What the rows that ROM keeps are known to be configured to now, raw by key: never a temporary value (4.14)."""
    return {
        key: raw
        for key, one in servo.registers.items()
        if one.parameter.rom and not _unread(servo, key) and (raw := servo.configured(key)) is not None
    }


def _unread(servo: Servo, key: str) -> bool:
    """Whether what RAM holds in a row that ROM keeps is not known now."""
    one = servo.registers[key]
    return one.parameter.rom and (one.at is None or servo.temporary(key))
