"""Stored snapshots of each servo."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Final

from sqlalchemy import RowMapping, bindparam, delete, func, insert, select

from hornbill.errors import Unknown
from hornbill.store.database import Database
from hornbill.store.repository import Repository
from hornbill.store.tables import SNAPSHOTS, Json
from hornbill.units import Uid

MAX_AUTOMATIC = 200
"""Maximum number of automatic snapshots per servo. Manual ones stay until they are deleted."""
PRUNE_EVERY = 20
"""Number of additions between two prunings, which cost more than an addition."""


@dataclass(frozen=True, slots=True)
class StoredSnapshot:
    """One snapshot. `at`: seconds since 1970 UTC. `ram` and `rom`: raw by key. `firmware`: raw value of 0x52.

    `bench`: where it was taken.
    """

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
    bench: str | None = None


_ADD: Final = insert(SNAPSHOTS)
_NEWEST: Final = (
    select(SNAPSHOTS)
    .where(SNAPSHOTS.c.uid == bindparam("whose"))
    .order_by(SNAPSHOTS.c.id.desc())
    .limit(1)
)  # fmt: skip


class Snapshots(Repository[StoredSnapshot]):
    """Snapshots of all servos."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, SNAPSHOTS, StoredSnapshot)
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
        """Store a snapshot. `unless_same`: return the servo's newest instead if it has the same values.

        From time to time deletes the servo's oldest automatic snapshots beyond `MAX_AUTOMATIC`.
        """
        made = StoredSnapshot(
            0, uid, self._wall(), reason[:200], by[:80], automatic, model, firmware, schema_revision,
            dict(ram), dict(rom), reason_code, dict(reason_params or {}), self._database.bench,
        )  # fmt: skip
        with self._database.transaction() as connection:
            newest = connection.execute(_NEWEST, {"whose": uid}).mappings().first() if unless_same else None
            if newest is not None and (newest["ram"], newest["rom"]) == (made.ram, made.rom):
                return self._fact(newest)
            values = asdict(made)
            del values["id"]
            number = connection.execute(_ADD, values).inserted_primary_key
            assert number is not None
            unpruned = self._unpruned.get(uid, PRUNE_EVERY) + 1
            if unpruned >= PRUNE_EVERY:
                mine = SNAPSHOTS.c.uid == uid, SNAPSHOTS.c.automatic.is_(True)
                self._prune(connection, MAX_AUTOMATIC, SNAPSHOTS.c.id, *mine)
                unpruned = 0
        self._unpruned[uid] = unpruned
        return replace(made, id=int(number[0]))

    def _fact(self, row: RowMapping | Mapping[str, Any]) -> StoredSnapshot:
        return replace(super()._fact(row), reason_params=row["reason_params"] or {})  # null in rows of older versions

    def of(self, uid: Uid, *, limit: int = 1000) -> list[StoredSnapshot]:
        """A servo's snapshots, newest first."""
        query = select(SNAPSHOTS).where(SNAPSHOTS.c.uid == uid).order_by(SNAPSHOTS.c.id.desc()).limit(limit)
        return self._facts(query)

    def latest(self, uid: Uid) -> StoredSnapshot | None:
        """A servo's newest snapshot."""
        return next(iter(self.of(uid, limit=1)), None)

    def drop_all(self, uid: Uid) -> int:
        """Delete all snapshots of a servo. Returns their number."""
        with self._database.transaction() as connection:
            return connection.execute(delete(SNAPSHOTS).where(SNAPSHOTS.c.uid == uid)).rowcount

    def counts(self) -> dict[Uid, int]:
        """Number of snapshots per servo."""
        with self._database.reading() as connection:
            found = connection.execute(select(SNAPSHOTS.c.uid, func.count()).group_by(SNAPSHOTS.c.uid))
            return {Uid(uid): int(count) for uid, count in found}

    def _unknown(self, key: int) -> Unknown:
        return Unknown("unknown_snapshot", f"Unknown snapshot {key}.", snapshot=key, cause="snapshot_not_found")
