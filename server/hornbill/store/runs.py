"""Stored runs with their test conditions."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

from sqlalchemy import insert, select

from hornbill.errors import Unknown
from hornbill.store.database import Database
from hornbill.store.repository import Repository
from hornbill.store.tables import HIGHEST_ID, RUNS, Json
from hornbill.units import Uid

MAX_ROWS = 200
"""Maximum number of runs of one kind per servo. A step test with two traces takes about 100 kB."""

RunKind: TypeAlias = Literal["step", "frequency_response", "mechanics", "improve"]


@dataclass(frozen=True, slots=True)
class Run:
    """One run. `at`: seconds since 1970 UTC. The lab layer interprets `document`. `bench`: where it was made."""

    id: int
    uid: Uid
    at: float
    note: str
    document: Mapping[str, Json]
    kind: RunKind = "step"
    bench: str | None = None


class Runs(Repository[Run]):
    """Runs by ID."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, RUNS, Run)

    def add(self, uid: Uid, note: str, document: Mapping[str, Json], *, kind: RunKind = "step") -> Run:
        """Store a run. Deletes the servo's oldest runs of this kind beyond `MAX_ROWS`."""
        with self._database.transaction() as connection:
            values = {
                "uid": uid, "at": self._wall(), "note": note[:200], "document": dict(document), "kind": kind,
                "bench": self._database.bench,
            }  # fmt: skip
            number = connection.execute(insert(RUNS), values).inserted_primary_key
            assert number is not None
            self._prune(connection, MAX_ROWS, RUNS.c.id, RUNS.c.uid == uid, RUNS.c.kind == kind)
            return self._fact({"id": int(number[0]), **values})

    def of(
        self, uid: Uid | None = None, *, kind: RunKind = "step", limit: int = MAX_ROWS, before_id: int | None = None
    ) -> list[Run]:
        """Runs of one kind of one or all servos, newest first. `before_id` continues an earlier list."""
        query = select(RUNS).where(RUNS.c.kind == kind).order_by(RUNS.c.id.desc()).limit(limit)
        if uid is not None:
            query = query.where(RUNS.c.uid == uid)
        if before_id is not None:
            query = query.where(RUNS.c.id < min(before_id, HIGHEST_ID))
        return self._facts(query)

    def find(self, number: int, kind: RunKind) -> Run:
        """A run of one kind. Raises Unknown, also if the run is of another kind."""
        found = self.get(number)
        if found.kind != kind:
            raise self._unknown(number)
        return found

    def _unknown(self, key: int) -> Unknown:
        return Unknown(
            "unknown_run",
            f"Unknown run {key}.",
            run=key,
            cause="run_not_found",
        )
