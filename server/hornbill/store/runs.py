"""Stored step tests with their test conditions."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sqlalchemy import select

from hornbill.errors import Unknown
from hornbill.store.database import Database
from hornbill.store.repository import Repository
from hornbill.store.tables import Json, RunRow
from hornbill.units import Uid

MAX_ROWS = 200
"""Maximum number of runs per servo. A run with two traces takes about 100 kB."""


@dataclass(frozen=True, slots=True)
class Run:
    """One run. `at`: seconds since 1970 UTC. The lab layer interprets `document`."""

    id: int
    uid: Uid
    at: float
    note: str
    document: Mapping[str, Json]


class Runs(Repository[RunRow, Run]):
    """Runs by ID."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, RunRow, Run)

    def add(self, uid: Uid, note: str, document: Mapping[str, Json]) -> Run:
        """Store a run. Deletes the servo's oldest runs beyond `MAX_ROWS`."""
        with self._database.transaction() as session:
            row = RunRow(uid=uid, at=self._wall(), note=note[:200], document=dict(document))
            session.add(row)
            session.flush()
            self._prune(session, MAX_ROWS, RunRow.id, RunRow.uid == uid)
            return self._fact(row)

    def of(self, uid: Uid | None = None, *, limit: int = MAX_ROWS) -> list[Run]:
        """Runs of one or all servos, newest first."""
        query = select(RunRow).order_by(RunRow.id.desc()).limit(limit)
        if uid is not None:
            query = query.where(RunRow.uid == uid)
        return self._facts(query)

    def _unknown(self, key: int) -> Unknown:
        return Unknown(
            "unknown_run",
            f"Unknown run {key}.",
            run=key,
            cause="run_not_found",
        )
