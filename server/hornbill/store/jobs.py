"""Jobs and their progress, which survive a restart of the server."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sqlalchemy import select

from hornbill.store.database import Database
from hornbill.store.repository import Repository
from hornbill.store.tables import JobRow, Json
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


class StoredJobs(Repository[JobRow, StoredJob]):
    """Jobs by ID."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, JobRow, StoredJob)

    def all(self) -> list[StoredJob]:
        """All jobs, oldest first."""
        return self._facts(
            select(JobRow).where(JobRow.bench == self._database.bench).order_by(JobRow.created_at, JobRow.id)
        )

    def put(self, job: StoredJob) -> None:
        """Store the present state of a job."""
        with self._database.transaction() as session:
            row = session.get(JobRow, job.id)
            if row is None:
                self._prune(
                    session,
                    MAX_ROWS,
                    JobRow.created_at,
                    JobRow.ended_at.is_not(None),
                    JobRow.bench == self._database.bench,
                )
                row = JobRow(id=job.id, kind=job.kind, uid=job.uid, created_at=job.created_at)
                row.bench = self._database.bench
                session.add(row)
            row.state, row.ended_at = job.state, job.ended_at
            row.request = None if job.request is None else dict(job.request)
            row.document = dict(job.document)
