"""Audit of operations: client, action, servo and outcome. Entries are added, never changed."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final, cast

from sqlalchemy import RowMapping, insert, select

from hornbill.domain.note import Note
from hornbill.store.database import Database
from hornbill.store.tables import AUDIT, HIGHEST_ID, Json, storable
from hornbill.units import Uid


@dataclass(frozen=True, slots=True)
class NewAuditEntry:
    """An entry to store. `before`, `requested`, `after`: engineering values, None if none or unknown.

    `action`: write, torque, save, restart, factory_reset, identify, label, notes, pin, forget, profile, drift, stop, …
    `outcome`: applied, unchanged, clamped, refused, no_response, rolled_back, succeeded, failed, …
    """

    by: str
    action: str
    outcome: str
    uid: Uid | None = None
    key: str | None = None
    before: Json = None
    requested: Json = None
    after: Json = None
    notes: tuple[Note, ...] = ()
    job: str | None = None

    @property
    def detail(self) -> str:
        """The notes as one text, in English."""
        return " ".join(note.text for note in self.notes)


@dataclass(frozen=True, slots=True)
class AuditEntry:
    """A stored entry with its ID, its time (seconds since 1970 UTC) and the bench that wrote it."""

    id: int
    at: float
    entry: NewAuditEntry
    bench: str | None = None


_ADD: Final = insert(AUDIT)


class AuditLog:
    """The audit. Each method commits before it returns."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        """`wall` returns seconds since 1970 UTC."""
        self._database = database
        self._wall = wall

    def add(self, entries: Iterable[NewAuditEntry]) -> None:
        """Store the entries of one operation in one transaction."""
        now = self._wall()
        rows = [
            {
                "at": now, "by": one.by[:80], "action": one.action, "outcome": one.outcome, "uid": one.uid,
                "key": None if one.key is None else one.key[:100],
                "before": one.before, "requested": one.requested, "after": one.after,
                "notes": [_stored(note) for note in one.notes], "job": one.job, "bench": self._database.bench,
            }
            for one in entries
        ]  # fmt: skip
        if rows:
            with self._database.transaction() as connection:
                connection.execute(_ADD, rows)

    def rows(
        self,
        *,
        uid: Uid | None = None,
        key: str | None = None,
        action: str | None = None,
        before_id: int | None = None,
        since: float | None = None,
        limit: int = 200,
    ) -> list[AuditEntry]:
        """Entries, newest first. `before_id` continues an earlier list."""
        query = select(AUDIT).order_by(AUDIT.c.id.desc()).limit(limit)
        if uid is not None:
            query = query.where(AUDIT.c.uid == uid)
        if key is not None:
            query = query.where(AUDIT.c.key == key)
        if action is not None:
            query = query.where(AUDIT.c.action == action)
        if before_id is not None:
            query = query.where(AUDIT.c.id < min(before_id, HIGHEST_ID))
        if since is not None:
            query = query.where(AUDIT.c.at >= since)
        with self._database.reading() as connection:
            return [_entry(row) for row in connection.execute(query).mappings()]


def _entry(row: RowMapping) -> AuditEntry:
    entry = NewAuditEntry(
        row["by"], row["action"], row["outcome"], None if row["uid"] is None else Uid(row["uid"]), row["key"],
        row["before"], row["requested"], row["after"], tuple(Note(**note) for note in row["notes"]), row["job"],
    )  # fmt: skip
    return AuditEntry(row["id"], row["at"], entry, row["bench"])


def _stored(note: Note) -> dict[str, Json]:
    params = {name: storable(value) if isinstance(value, str) else value for name, value in note.params.items()}
    return {"code": note.code, "params": cast("dict[str, Json]", params), "text": storable(note.text)}
