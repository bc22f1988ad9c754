"""Jobs and how far they came, so that a restart of the server forgets none."""

from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy import delete, select

from hornbill.store.database import Database
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


class StoredJobs:
    """Jobs by id. Every method has been committed when it returns."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def all(self) -> list[StoredJob]:
        """Every job, oldest first."""
        with self._database.reading() as session:
            found = session.scalars(select(JobRow).order_by(JobRow.created_at, JobRow.id))
            return [_job(row) for row in found]

    def put(self, job: StoredJob) -> None:
        """Keep a job as it is now."""
        with self._database.transaction() as session:
            row = session.get(JobRow, job.id)
            if row is None:
                beyond = select(JobRow.id).where(JobRow.ended_at.is_not(None)).order_by(JobRow.created_at.desc())
                old = session.scalars(beyond.offset(KEPT).limit(1000)).all()
                if old:
                    session.execute(delete(JobRow).where(JobRow.id.in_(old)))
                row = JobRow(id=job.id, kind=job.kind, uid=job.uid, created_at=job.created_at)
                session.add(row)
            row.state, row.ended_at = job.state, job.ended_at
            row.request = None if job.request is None else dict(job.request)
            row.document = dict(job.document)


def _job(row: JobRow) -> StoredJob:
    return StoredJob(
        row.id, row.kind, None if row.uid is None else Uid(row.uid), row.state, row.created_at, row.ended_at,
        None if row.request is None else dict(row.request), dict(row.document),
    )  # fmt: skip
