"""Jobs and how far they came, so that a restart of the server forgets none."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sqlalchemy import select

from hornbill.store.database import Database
from hornbill.store.repository import Repository
from hornbill.store.tables import JobRow, Json
from hornbill.units import Uid

KEPT = 500
"""Jobs kept, the newest; older ones that have ended are dropped."""


@dataclass(frozen=True, slots=True)
class StoredJob:
    """One job; instants in seconds since 1970 (UTC). `request` is what it takes to go on with it, None if nobody can.

    `document` has its steps, result and problem; what they mean is the servo layer's business.
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
    """Jobs by id."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, JobRow, StoredJob)

    def all(self) -> list[StoredJob]:
        """Every job, oldest first."""
        return self._facts(select(JobRow).order_by(JobRow.created_at, JobRow.id))

    def put(self, job: StoredJob) -> None:
        """Keep a job as it is now."""
        with self._database.transaction() as session:
            row = session.get(JobRow, job.id)
            if row is None:
                self._prune(session, KEPT, JobRow.created_at, JobRow.ended_at.is_not(None))
                row = JobRow(id=job.id, kind=job.kind, uid=job.uid, created_at=job.created_at)
                session.add(row)
            row.state, row.ended_at = job.state, job.ended_at
            row.request = None if job.request is None else dict(job.request)
            row.document = dict(job.document)
