"""What each servo held at which instant, for as long as there is room."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Final

from sqlalchemy import Connection, Row, bindparam, delete, func, insert, select
from sqlalchemy.orm import Session

from hornbill.errors import Unknown
from hornbill.store.database import Database
from hornbill.store.tables import HIGHEST_ID, Json, SnapshotRow
from hornbill.units import Uid

AUTOMATIC_KEPT = 200
"""Automatic snapshots kept of one servo, the newest; those made by hand stay until somebody drops them."""
PRUNED_EVERY = 20
"""How many are added until the oldest are looked for, which costs more than all else of keeping one."""


@dataclass(frozen=True, slots=True)
class StoredSnapshot:
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
    reason_code: str | None = None
    reason_params: Mapping[str, Json] = field(default_factory=dict[str, "Json"])


_ADD: Final = insert(SnapshotRow)
_NEWEST: Final = (
    select(SnapshotRow.__table__)
    .where(SnapshotRow.uid == bindparam("whose"))
    .order_by(SnapshotRow.id.desc())
    .limit(1)
)  # fmt: skip


class Snapshots:
    """The history of every servo. Every method has been committed when it returns."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        """`wall` gives seconds since 1970 (UTC)."""
        self._database = database
        self._wall = wall
        self._unpruned: dict[Uid, int] = {}

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
        reason_code: str | None = None,
        reason_params: Mapping[str, Json] | None = None,
        unless_same: bool = False,
    ) -> StoredSnapshot:
        """Keep one; `unless_same`: but if the servo's newest has the same values, that one is the answer.

        The oldest automatic ones of the servo beyond `AUTOMATIC_KEPT` are dropped, now and then.
        """
        made = StoredSnapshot(
            0, uid, self._wall(), reason[:200], by[:80], automatic, model, firmware, schema_revision,
            dict(ram), dict(rom), reason_code, dict(reason_params or {}),
        )  # fmt: skip
        with self._database.writing() as connection:
            newest = connection.execute(_NEWEST, {"whose": uid}).first() if unless_same else None
            if newest is not None and (newest.ram, newest.rom) == (made.ram, made.rom):
                return _snapshot(newest)
            values = asdict(made)
            del values["id"]
            number = connection.execute(_ADD, values).inserted_primary_key
            assert number is not None
            unpruned = self._unpruned.get(uid, PRUNED_EVERY) + 1
            if unpruned >= PRUNED_EVERY:
                _prune(connection, uid)
                unpruned = 0
        self._unpruned[uid] = unpruned
        return replace(made, id=int(number[0]))

    def of(self, uid: Uid, *, limit: int = 1000) -> list[StoredSnapshot]:
        """A servo's snapshots, newest first."""
        with self._database.reading() as session:
            found = session.scalars(
                select(SnapshotRow).where(SnapshotRow.uid == uid).order_by(SnapshotRow.id.desc()).limit(limit)
            )
            return [_snapshot(row) for row in found]

    def latest(self, uid: Uid) -> StoredSnapshot | None:
        """A servo's newest snapshot."""
        return next(iter(self.of(uid, limit=1)), None)

    def get(self, snapshot_id: int) -> StoredSnapshot:
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


def _prune(connection: Connection, uid: Uid) -> None:
    mine = SnapshotRow.uid == uid, SnapshotRow.automatic.is_(True)
    beyond = select(SnapshotRow.id).where(*mine).order_by(SnapshotRow.id.desc()).offset(AUTOMATIC_KEPT).limit(1000)
    old = connection.scalars(beyond).all()
    if old:
        connection.execute(delete(SnapshotRow).where(SnapshotRow.id.in_(old)))


def _row(session: Session, snapshot_id: int) -> SnapshotRow:
    row = session.get(SnapshotRow, snapshot_id) if 0 < snapshot_id <= HIGHEST_ID else None
    if row is None:
        raise Unknown(
            "unknown_snapshot", f"There is no snapshot {snapshot_id}.", snapshot=snapshot_id, cause="no_such_snapshot"
        )
    return row


def _snapshot(row: SnapshotRow | Row[Any]) -> StoredSnapshot:
    return StoredSnapshot(
        row.id, Uid(row.uid), row.at, row.reason, row.by, row.automatic, row.model, row.firmware,
        row.schema_revision, dict(row.ram), dict(row.rom), row.reason_code, dict(row.reason_params or {}),
    )  # fmt: skip
