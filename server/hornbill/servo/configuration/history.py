"""Owns History: taking a snapshot of what a servo holds, before every change and by hand."""

from hornbill.errors import Busy, NoAnswer, NotInThisModel
from hornbill.servo.asking import Asker
from hornbill.servo.configuration.audit import Audit
from hornbill.servo.identification import read_rows
from hornbill.servo.servo import SOFT_START_ROWS, Servo
from hornbill.store.audit import Entry
from hornbill.store.snapshots import Snapshot, Snapshots
from hornbill.units import Raw


class History:
    """Snapshots hold every row that ROM keeps (0x20 to 0x46, section 4.11), identity rows too, raw by key."""

    def __init__(self, snapshots: Snapshots, audit: Audit) -> None:
        self.snapshots = snapshots
        self._audit = audit

    async def take(self, asker: Asker, servo: Servo, *, reason: str, by: str, automatic: bool = True) -> Snapshot:
        """Keep what RAM holds now, and what is known of ROM. Rows whose reading is not current are read first.

        One made by hand reads every row: another tool may have written it since. An automatic one that would repeat
        the newest is not kept again: the answer is that one. Call it while nobody else can change the servo (its
        `changing` lock). Raises NoAnswer, BusDisconnected, NotInThisModel,
        and Busy during soft start, when five rows read temporary values (section 4.14), and after a restart.
        """
        if not servo.online:
            raise NoAnswer(f"{servo.title} is offline: what it holds cannot be read. Check its supply and the wiring.")
        if servo.model is None:
            raise NotInThisModel(f"{servo.title} is of no known model, so hornbill cannot tell what it holds.")
        if servo.soft_starting:
            raise Busy(
                f"{servo.title} is in soft start, so what it answers is not what it holds. Wait until it is over.",
                state=servo.state.value,
            )
        boots = servo.boots
        rows = [key for key, one in servo.registers.items() if one.parameter.rom]
        await read_rows(asker, servo, [key for key in rows if not automatic or _unread(servo, key)])
        if servo.boots != boots:
            raise Busy(f"{servo.title} restarted while it was read. Try again when it is ready.")
        return self.keep(servo, reason=reason, by=by, automatic=automatic)

    def keep(self, servo: Servo, *, reason: str, by: str, automatic: bool) -> Snapshot:
        """Keep what is known now, without asking the servo; rows that are not known are left out."""
        made = self.snapshots.add(
            servo.uid, reason=reason, by=by, automatic=automatic, model=servo.model.name if servo.model else None,
            firmware=servo.firmware, schema_revision=servo.catalog.revision, ram=held(servo), rom=servo.rom(),
            unless_same=automatic,
        )  # fmt: skip
        if not automatic:
            self._audit.note(Entry(by, "snapshot", "succeeded", servo.uid, after=made.id, detail=reason))
        return made

    def drop(self, snapshot: Snapshot, *, by: str) -> None:
        """Forget a snapshot. Raises Unknown (unknown_snapshot) when somebody else just did."""
        self.snapshots.drop(snapshot.id)
        self._audit.note(Entry(by, "snapshot", "dropped", snapshot.uid, before=snapshot.id, detail=snapshot.reason))


def held(servo: Servo) -> dict[str, Raw]:
    """What RAM is known to hold now of the rows that ROM keeps, raw by key: never a temporary value (4.14)."""
    return {
        key: one.raw
        for key, one in servo.registers.items()
        if one.raw is not None and one.parameter.rom and not _unread(servo, key)
    }


def _unread(servo: Servo, key: str) -> bool:
    """Whether what RAM holds in a row that ROM keeps is not known now."""
    one = servo.registers[key]
    return one.parameter.rom and (one.at is None or (servo.soft_starting and key in SOFT_START_ROWS))
