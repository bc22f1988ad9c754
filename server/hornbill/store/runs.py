"""Measured motions, with what they were measured under, until somebody drops them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sqlalchemy import delete, select

from hornbill.errors import Unknown
from hornbill.store.database import Database
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


class Runs:
    """Runs by number. Every method has been committed when it returns."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        """`wall` gives seconds since 1970 (UTC)."""
        self._database = database
        self._wall = wall

    def add(self, uid: Uid, note: str, document: Mapping[str, Json]) -> Run:
        """Keep one. The oldest of the servo beyond `KEPT` are dropped."""
        with self._database.transaction() as session:
            row = RunRow(uid=uid, at=self._wall(), note=note[:200], document=dict(document))
            session.add(row)
            session.flush()
            beyond = select(RunRow.id).where(RunRow.uid == uid).order_by(RunRow.id.desc()).offset(KEPT).limit(1000)
            old = session.scalars(beyond).all()
            if old:
                session.execute(delete(RunRow).where(RunRow.id.in_(old)))
            return _run(row)

    def of(self, uid: Uid | None = None, *, limit: int = KEPT) -> list[Run]:
        """Runs of a servo, or of all, newest first."""
        asked = select(RunRow).order_by(RunRow.id.desc()).limit(limit)
        if uid is not None:
            asked = asked.where(RunRow.uid == uid)
        with self._database.reading() as session:
            return [_run(row) for row in session.scalars(asked)]

    def get(self, run_id: int) -> Run:
        """One run. Raises Unknown (unknown_run)."""
        with self._database.reading() as session:
            row = session.get(RunRow, run_id)
            if row is None:
                raise _unknown(run_id)
            return _run(row)

    def drop(self, run_id: int) -> None:
        """Forget one. Raises Unknown (unknown_run)."""
        with self._database.transaction() as session:
            row = session.get(RunRow, run_id)
            if row is None:
                raise _unknown(run_id)
            session.delete(row)


def _unknown(run_id: int) -> Unknown:
    return Unknown(
        "unknown_run",
        f"There is no run {run_id}.",
        request="GET /api/v1/runs lists them.",
        run=run_id,
        cause="no_such_run",
    )


def _run(row: RunRow) -> Run:
    return Run(row.id, Uid(row.uid), row.at, row.note, dict(row.document))
