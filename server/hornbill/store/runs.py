"""Measured motions, with what they were measured under, until somebody drops them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sqlalchemy import select

from hornbill.errors import Unknown
from hornbill.store.database import Database
from hornbill.store.repository import Repository
from hornbill.store.tables import Json, RunRow
from hornbill.units import Uid

KEPT = 200
"""Runs kept of one servo, the newest: a run of two traces takes some 100 kB."""


@dataclass(frozen=True, slots=True)
class Run:
    """One run; `at` in seconds since 1970 (UTC). What `document` means is the business of whoever measured."""

    id: int
    uid: Uid
    at: float
    note: str
    document: Mapping[str, Json]


class Runs(Repository[RunRow, Run]):
    """Runs by number."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, RunRow, Run)

    def add(self, uid: Uid, note: str, document: Mapping[str, Json]) -> Run:
        """Keep one. The oldest of the servo beyond `KEPT` are dropped."""
        with self._database.transaction() as session:
            row = RunRow(uid=uid, at=self._wall(), note=note[:200], document=dict(document))
            session.add(row)
            session.flush()
            self._prune(session, KEPT, RunRow.id, RunRow.uid == uid)
            return self._fact(row)

    def of(self, uid: Uid | None = None, *, limit: int = KEPT) -> list[Run]:
        """Runs of a servo, or of all, newest first."""
        asked = select(RunRow).order_by(RunRow.id.desc()).limit(limit)
        if uid is not None:
            asked = asked.where(RunRow.uid == uid)
        return self._facts(asked)

    def _unknown(self, key: int) -> Unknown:
        return Unknown(
            "unknown_run",
            f"There is no run {key}.",
            run=key,
            cause="no_such_run",
        )
