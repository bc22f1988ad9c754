"""What requests with an Idempotency-Key were answered, so that none of them is done twice."""

import secrets
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from sqlalchemy import delete

from hornbill.store.database import Database
from hornbill.store.tables import AnswerRow

KEPT_S: Final = 48 * 3600.0
"""How long an answer is kept at least, from the first request on; the contract promises 24 h."""
TIDY_S: Final = 600.0
"""How often those that are older are looked for."""


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer as it was given: status, headers by name, body."""

    status: int
    headers: dict[str, str]
    body: bytes


@dataclass(frozen=True, slots=True)
class Begun:
    """A request that was begun before: what it was, by digest, and its answer; None where there is none.

    `here`: this process began it, and not one that has perhaps ended since.
    """

    request: str
    here: bool
    answer: Answer | None


class Answers:
    """Answers by key. Every method has been committed when it returns; all raise StoreFailed.

    A key is kept before its request is done and its answer after, so that a process that dies in between leaves a
    key without an answer, and never a request that can be done twice. (A power cut may undo the last few commits.)
    """

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        """`wall` gives seconds since 1970 (UTC)."""
        self._database = database
        self._wall = wall
        self._process = secrets.token_hex(16)
        self._tidied_at: float | None = None

    def begin(self, key: str, request: str) -> Begun | None:
        """Take this key for this request, both by digest: None, and it is to be done; else it was begun before."""
        now = self._wall()
        with self._database.transaction() as session:
            row = session.get(AnswerRow, key)
            if row is not None:
                answer = None
                if row.status is not None:
                    answer = Answer(row.status, dict(row.headers or {}), row.body or b"")
                return Begun(row.request, row.process == self._process, answer)
            if self._tidied_at is None or not 0 <= now - self._tidied_at < TIDY_S:
                session.execute(delete(AnswerRow).where(AnswerRow.at < now - KEPT_S))
                self._tidied_at = now
            session.add(AnswerRow(id=key, request=request, process=self._process, at=now))
        return None

    def end(self, key: str, answer: Answer) -> None:
        """Keep how the request of this key was answered."""
        with self._database.transaction() as session:
            row = session.get(AnswerRow, key)
            if row is not None:
                row.status, row.headers, row.body = answer.status, answer.headers, answer.body
