"""Jobs and their progress, which survive a restart of the server."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sqlalchemy import select

from hornbill.store.database import Database
from hornbill.store.repository import Repository, put, row_at
from hornbill.store.tables import JOBS, Json
from hornbill.units import Uid

MAX_ROWS = 500
"""Maximum number of stored jobs. Older ended jobs are deleted."""


@dataclass(frozen=True, slots=True)
class StoredJob:
    """One job. Instants: seconds since 1970 UTC. `request`: data to resume it, None if it cannot be resumed.

    `document`: its steps, result and problem, interpreted by the servo layer.
    """

    id: str
    kind: str
    uid: Uid | None
    state: str
    created_at: float
    ended_at: float | None
    request: Mapping[str, Json] | None
    document: Mapping[str, Json]


class StoredJobs(Repository[StoredJob]):
    """Jobs by ID."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, JOBS, StoredJob)

    def all(self) -> list[StoredJob]:
        """All jobs, oldest first."""
        return self._facts(
            select(JOBS).where(JOBS.c.bench == self._database.bench).order_by(JOBS.c.created_at, JOBS.c.id)
        )

    def put(self, job: StoredJob) -> None:
        """Store the present state of a job."""
        with self._database.transaction() as connection:
            if row_at(connection, JOBS, job.id) is None:
                self._prune(
                    connection,
                    MAX_ROWS,
                    JOBS.c.created_at,
                    JOBS.c.ended_at.is_not(None),
                    JOBS.c.bench == self._database.bench,
                )
            values = {
                "state": job.state,
                "ended_at": job.ended_at,
                "request": None if job.request is None else dict(job.request),
                "document": dict(job.document),
            }
            new = {"kind": job.kind, "uid": job.uid, "created_at": job.created_at, "bench": self._database.bench}
            put(connection, JOBS, (job.id,), values, **new)
