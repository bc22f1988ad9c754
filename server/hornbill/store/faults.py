"""Which fault bits each servo has ever shown, when first and last, how often, and who has seen it."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from hornbill.store.database import Database
from hornbill.store.repository import Repository
from hornbill.store.tables import FaultRow
from hornbill.units import Uid


@dataclass(frozen=True, slots=True)
class FaultEntry:
    """One bit of one servo; instants in seconds since 1970 (UTC).

    `count`: how often it came up. `active`: it was set when its word was read last. `acknowledged_…`: since it came
    up last.
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
        """Somebody has seen it; whoever was first stays."""
        return self if self.acknowledged_at is not None else replace(self, acknowledged_at=at, acknowledged_by=by[:80])


@dataclass(frozen=True, slots=True)
class Sight:
    """What one look at a servo's fault words showed, as bits by key: those that came up, those that were set until
    `at` (seconds since 1970, UTC), and those that are not set any more."""

    uid: Uid
    at: float
    appeared: frozenset[str] = frozenset()
    seen: frozenset[str] = frozenset()
    gone: frozenset[str] = frozenset()

    def changes(self, before: Mapping[str, FaultEntry]) -> dict[str, FaultEntry]:
        """What becomes of the entries it is about. One that appears again is not acknowledged any more."""
        after: dict[str, FaultEntry] = {}
        for key in (self.seen | self.gone) & before.keys():
            was = before[key]
            last = max(was.last_seen, self.at) if key in self.seen else was.last_seen
            after[key] = replace(was, last_seen=last, active=was.active and key not in self.gone)
        for key in self.appeared:
            first, count = (before[key].first_seen, before[key].count) if key in before else (self.at, 0)
            after[key] = FaultEntry(self.uid, key, first, self.at, count + 1, active=True)
        return after


class FaultLog(Repository[FaultRow, FaultEntry]):
    """The history of fault bits."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, FaultRow, FaultEntry)

    def of(self, uid: Uid) -> dict[str, FaultEntry]:
        """Every bit a servo has shown, by key, the one first seen first."""
        with self._database.reading() as session:
            return {key: self._fact(row) for key, row in _rows(session, uid).items()}

    def keep(self, sight: Sight) -> dict[str, FaultEntry]:
        """Keep what was seen, all of it or nothing; answers every bit the servo has shown, as `of`."""
        with self._database.transaction() as session:
            return self._changed(session, sight.uid, sight.changes)

    def acknowledge(self, uid: Uid, keys: Iterable[str], by: str, at: float) -> dict[str, FaultEntry]:
        """Keep that somebody has seen these; answers every bit the servo has shown, as `of`. Others are passed over."""
        with self._database.transaction() as session:
            return self._changed(
                session, uid, lambda known: {key: known[key].acknowledged(by, at) for key in keys if key in known}
            )

    def forget(self, uid: Uid) -> None:
        """Drop a servo's history. An unknown one is no error."""
        with self._database.transaction() as session:
            session.execute(delete(FaultRow).where(FaultRow.uid == uid))

    def _changed(
        self, session: Session, uid: Uid, change: Callable[[dict[str, FaultEntry]], dict[str, FaultEntry]]
    ) -> dict[str, FaultEntry]:
        rows = _rows(session, uid)
        known = {key: self._fact(row) for key, row in rows.items()}
        changed = change(known)
        for entry in changed.values():
            session.merge(FaultRow(**asdict(entry)))
        return known | changed


def _rows(session: Session, uid: Uid) -> dict[str, FaultRow]:
    asked = select(FaultRow).where(FaultRow.uid == uid).order_by(FaultRow.first_seen, FaultRow.key)
    return {row.key: row for row in session.scalars(asked)}
