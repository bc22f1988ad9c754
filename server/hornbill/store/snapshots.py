"""Owns Snapshots: what each servo held at which instant, for as long as there is room."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from hornbill.errors import Unknown
from hornbill.store.database import Database
from hornbill.store.tables import HIGHEST_ID, SnapshotRow
from hornbill.units import Uid

AUTOMATIC_KEPT = 200
"""Automatic snapshots kept of one servo, the newest; those made by hand stay until somebody drops them."""


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One snapshot; `at` in seconds since 1970 (UTC), `ram` and `rom` raw by key, `firmware` as 0x52 reads."""

    id: int
    uid: Uid
    at: float
    reason: str
    by: str
    automatic: bool
    model: str | None
    firmware: int | None
    schema_revision: str
    ram: Mapping[str, int]
    rom: Mapping[str, int]


class Snapshots:
    """The history of every servo. Every method has been committed when it returns."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        """`wall` gives seconds since 1970 (UTC)."""
        self._database = database
        self._wall = wall

    def add(
        self,
        uid: Uid,
        *,
        reason: str,
        by: str,
        automatic: bool,
        model: str | None,
        firmware: int | None,
        schema_revision: str,
        ram: Mapping[str, int],
        rom: Mapping[str, int],
    ) -> Snapshot:
        """Keep one. The oldest automatic ones of the servo beyond `AUTOMATIC_KEPT` are dropped."""
        with self._database.transaction() as session:
            row = SnapshotRow(
                uid=uid, at=self._wall(), reason=reason[:200], by=by[:80], automatic=automatic, model=model,
                firmware=firmware, schema_revision=schema_revision, ram=dict(ram), rom=dict(rom),
            )  # fmt: skip
            session.add(row)
            session.flush()
            mine = SnapshotRow.uid == uid, SnapshotRow.automatic.is_(True)
            beyond = (
                select(SnapshotRow.id).where(*mine).order_by(SnapshotRow.id.desc()).offset(AUTOMATIC_KEPT).limit(1000)
            )
            old = session.scalars(beyond).all()
            if old:
                session.execute(delete(SnapshotRow).where(SnapshotRow.id.in_(old)))
            return _snapshot(row)

    def of(self, uid: Uid, *, limit: int = 1000) -> list[Snapshot]:
        """A servo's snapshots, newest first."""
        with self._database.reading() as session:
            found = session.scalars(
                select(SnapshotRow).where(SnapshotRow.uid == uid).order_by(SnapshotRow.id.desc()).limit(limit)
            )
            return [_snapshot(row) for row in found]

    def latest(self, uid: Uid) -> Snapshot | None:
        """A servo's newest snapshot."""
        return next(iter(self.of(uid, limit=1)), None)

    def get(self, snapshot_id: int) -> Snapshot:
        """One snapshot. Raises Unknown (unknown_snapshot)."""
        with self._database.reading() as session:
            row = _row(session, snapshot_id)
            return _snapshot(row)

    def drop(self, snapshot_id: int) -> None:
        """Forget one. Raises Unknown (unknown_snapshot)."""
        with self._database.transaction() as session:
            row = _row(session, snapshot_id)
            session.delete(row)

    def drop_all(self, uid: Uid) -> int:
        """Forget every one of a servo; how many there were."""
        with self._database.transaction() as session:
            ids = session.scalars(select(SnapshotRow.id).where(SnapshotRow.uid == uid)).all()
            session.execute(delete(SnapshotRow).where(SnapshotRow.uid == uid))
            return len(ids)

    def counts(self) -> dict[Uid, int]:
        """How many there are of each servo."""
        with self._database.reading() as session:
            found = session.execute(select(SnapshotRow.uid, func.count()).group_by(SnapshotRow.uid))
            return {Uid(uid): int(count) for uid, count in found}


def _row(session: Session, snapshot_id: int) -> SnapshotRow:
    row = session.get(SnapshotRow, snapshot_id) if 0 < snapshot_id <= HIGHEST_ID else None
    if row is None:
        raise Unknown("unknown_snapshot", f"There is no snapshot {snapshot_id}.", snapshot=snapshot_id)
    return row


def _snapshot(row: SnapshotRow) -> Snapshot:
    return Snapshot(
        row.id, Uid(row.uid), row.at, row.reason, row.by, row.automatic, row.model, row.firmware,
        row.schema_revision, dict(row.ram), dict(row.rom),
    )  # fmt: skip
