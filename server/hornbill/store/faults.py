"""History of fault bits: first and last time, count and acknowledgement."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace

from sqlalchemy import Connection, delete, select

from hornbill.store.database import Database
from hornbill.store.repository import Repository, put
from hornbill.store.tables import FAULTS
from hornbill.units import Uid


@dataclass(frozen=True, slots=True)
class FaultEntry:
    """One bit of one servo. Instants: seconds since 1970 UTC.

    `count`: number of times it was set. `active`: set in the last reading. `acknowledged_…`: since it was last set.
    """

    uid: Uid
    key: str
    first_seen: float
    last_seen: float
    count: int
    active: bool
    acknowledged_at: float | None = None
    acknowledged_by: str | None = None

    def acknowledged(self, by: str, at: float) -> "FaultEntry":
        """Acknowledge. An earlier acknowledgement stays."""
        return self if self.acknowledged_at is not None else replace(self, acknowledged_at=at, acknowledged_by=by[:80])


@dataclass(frozen=True, slots=True)
class FaultReading:
    """One reading of a servo's fault words, as bits by key: newly set, set until `at` (seconds since 1970 UTC), and
    cleared."""

    uid: Uid
    at: float
    appeared: frozenset[str] = frozenset()
    seen: frozenset[str] = frozenset()
    gone: frozenset[str] = frozenset()

    def changes(self, before: Mapping[str, FaultEntry]) -> dict[str, FaultEntry]:
        """Updated entries. An entry that is set again loses its acknowledgement."""
        after: dict[str, FaultEntry] = {}
        for key in (self.seen | self.gone) & before.keys():
            was = before[key]
            last = max(was.last_seen, self.at) if key in self.seen else was.last_seen
            after[key] = replace(was, last_seen=last, active=was.active and key not in self.gone)
        for key in self.appeared:
            first, count = (before[key].first_seen, before[key].count) if key in before else (self.at, 0)
            after[key] = FaultEntry(self.uid, key, first, self.at, count + 1, active=True)
        return after


class FaultLog(Repository[FaultEntry]):
    """The history of fault bits."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, FAULTS, FaultEntry)

    def of(self, uid: Uid) -> dict[str, FaultEntry]:
        """All bits that a servo has ever had set, by key, in order of first occurrence."""
        with self._database.reading() as connection:
            return self._known(connection, uid)

    def record(self, reading: FaultReading) -> dict[str, FaultEntry]:
        """Store a reading atomically. Returns the same as `of`."""
        with self._database.transaction() as connection:
            return self._changed(connection, reading.uid, reading.changes)

    def acknowledge(self, uid: Uid, keys: Iterable[str], by: str, at: float) -> dict[str, FaultEntry]:
        """Acknowledge these bits, ignoring unknown ones. Returns the same as `of`."""
        with self._database.transaction() as connection:
            return self._changed(
                connection, uid, lambda known: {key: known[key].acknowledged(by, at) for key in keys if key in known}
            )

    def forget(self, uid: Uid) -> None:
        """Delete a servo's history. Idempotent."""
        with self._database.transaction() as connection:
            connection.execute(delete(FAULTS).where(FAULTS.c.uid == uid))

    def _changed(
        self, connection: Connection, uid: Uid, change: Callable[[dict[str, FaultEntry]], dict[str, FaultEntry]]
    ) -> dict[str, FaultEntry]:
        known = self._known(connection, uid)
        changed = change(known)
        for entry in changed.values():
            put(connection, FAULTS, (uid, entry.key), {**asdict(entry), "bench": self._database.bench})
        return known | changed

    def _known(self, connection: Connection, uid: Uid) -> dict[str, FaultEntry]:
        query = select(FAULTS).where(FAULTS.c.uid == uid).order_by(FAULTS.c.first_seen, FAULTS.c.key)
        return {row["key"]: self._fact(row) for row in connection.execute(query).mappings()}
