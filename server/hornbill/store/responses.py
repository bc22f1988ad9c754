"""Stored responses of requests with an Idempotency-Key, so that no request is carried out twice."""

import secrets
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from sqlalchemy import delete

from hornbill.store.database import Database
from hornbill.store.tables import ResponseRow

RETAIN_S: Final = 48 * 3600.0
"""Minimum retention of a response, from the first request on, s. The API promises 24 h."""
TIDY_S: Final = 600.0
"""Interval at which older responses are deleted, s."""


@dataclass(frozen=True, slots=True)
class StoredResponse:
    """A response: status, headers by name, body."""

    status: int
    headers: dict[str, str]
    body: bytes


@dataclass(frozen=True, slots=True)
class Begun:
    """A request that was begun before: its digest, and its response, None if none is stored.

    `here`: begun by this process, not by one that may have ended since.
    """

    request: str
    here: bool
    response: StoredResponse | None


class Responses:
    """Responses by key. Each method commits before it returns, and may raise StoreFailed.

    A key is stored before its request is carried out, and its response afterwards. A process that dies in between
    leaves a key without a response, never a request that can be carried out twice. (A power cut may undo the last few
    commits.)
    """

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        """`wall` returns seconds since 1970 UTC."""
        self._database = database
        self._wall = wall
        self._process = secrets.token_hex(16)
        self._tidied_at: float | None = None

    def begin(self, key: str, request: str) -> Begun | None:
        """Store a key for a request, both by digest. None: carry it out. Otherwise it was begun before."""
        now = self._wall()
        with self._database.transaction() as session:
            row = session.get(ResponseRow, (self._database.bench, key))
            if row is not None:
                response = None
                if row.status is not None:
                    response = StoredResponse(row.status, dict(row.headers or {}), row.body or b"")
                return Begun(row.request, row.process == self._process, response)
            if self._tidied_at is None or not 0 <= now - self._tidied_at < TIDY_S:
                session.execute(delete(ResponseRow).where(ResponseRow.at < now - RETAIN_S))
                self._tidied_at = now
            session.add(ResponseRow(bench=self._database.bench, id=key, request=request, process=self._process, at=now))
        return None

    def end(self, key: str, response: StoredResponse) -> None:
        """Store the response of the request with this key."""
        with self._database.transaction() as session:
            row = session.get(ResponseRow, (self._database.bench, key))
            if row is not None:
                row.status, row.headers, row.body = response.status, response.headers, response.body
