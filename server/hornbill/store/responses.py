"""Stored responses of requests with an Idempotency-Key, so that no request is carried out twice."""

import secrets
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from typing import Any, Final

from sqlalchemy import delete, insert

from hornbill.store.database import Database
from hornbill.store.repository import put, row_at
from hornbill.store.tables import RESPONSES

RETAIN_S: Final = 48 * 3600.0
"""Minimum retention of a response, from the first request on, s. The API promises 24 h."""
TIDY_S: Final = 600.0
"""Interval at which older responses are deleted, s."""

MAX_BYTES: Final = 16 * 1024 * 1024
"""Maximum size of the responses in memory. Beyond it, the oldest are only in the database."""
ROW_BYTES: Final = 500
"""Approximate size of a key with its headers."""


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
        with self._database.transaction() as connection:
            row = row_at(connection, RESPONSES, self._database.bench, key)
            if row is not None:
                response = None
                if row["status"] is not None:
                    response = StoredResponse(row["status"], dict(row["headers"] or {}), row["body"] or b"")
                return Begun(row["request"], row["process"] == self._process, response)
            if self._tidied_at is None or not 0 <= now - self._tidied_at < TIDY_S:
                connection.execute(delete(RESPONSES).where(RESPONSES.c.at < now - RETAIN_S))
                self._tidied_at = now
            values = {"bench": self._database.bench, "id": key, "request": request, "process": self._process, "at": now}
            connection.execute(insert(RESPONSES), values)
        return None

    def end(self, key: str, response: StoredResponse) -> None:
        """Store the response of the request with this key. That of an earlier process stays."""
        with self._database.transaction() as connection:
            row = row_at(connection, RESPONSES, self._database.bench, key)
            if row is not None and row["process"] == self._process:
                values = {"status": response.status, "headers": response.headers, "body": response.body}
                put(connection, RESPONSES, (self._database.bench, key), values)


class Keys:
    """Keys of the requests of this process, in memory too, so that they are known while the database is unreachable.

    Then a key is checked here only, and key and response are written later. A key that an earlier process used is
    recognised only with the database.
    """

    def __init__(self, stored: Responses, write: Callable[..., Awaitable[Any]], wall: Callable[[], float]) -> None:
        """`write` is `Store.run_or_later`. `wall` returns seconds since 1970 UTC."""
        self._stored = stored
        self._write = write
        self._wall = wall
        self._known: OrderedDict[str, tuple[float, Begun]] = OrderedDict()
        self._bytes = 0

    async def begin(self, key: str, request: str) -> Begun | None:
        """See `Responses.begin`. Raises StoreFailed if the database fails otherwise than by being unreachable."""
        now = self._wall()
        while self._known and (self._bytes > MAX_BYTES or next(iter(self._known.values()))[0] < now - RETAIN_S):
            self._bytes -= _size(self._known.popitem(last=False)[1][1])
        if (known := self._known.get(key)) is not None:
            return known[1]
        found: Begun | None = await self._write(self._stored.begin, key, request)
        if found is None:
            self._put(key, now, Begun(request, True, None))
        return found

    async def end(self, key: str, response: StoredResponse) -> None:
        """See `Responses.end`. Raises StoreFailed as `begin`."""
        await self._write(self._stored.end, key, response)
        if (known := self._known.get(key)) is not None:
            self._bytes -= _size(known[1])
            self._put(key, known[0], replace(known[1], response=response))

    def _put(self, key: str, at: float, begun: Begun) -> None:
        self._known[key] = at, begun
        self._bytes += _size(begun)


def _size(begun: Begun) -> int:
    return ROW_BYTES + (0 if begun.response is None else len(begun.response.body))
