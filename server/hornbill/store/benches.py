"""Benches of the database: the lock of a bench's name, and the last contact of its server."""

import os
import platform
import secrets
import socket
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final, Literal

from sqlalchemy import select

from hornbill import __version__
from hornbill.errors import StoreFailed
from hornbill.store.database import Database
from hornbill.store.tables import BenchRow, Json

CONTACT_S: Final = 4.0
"""Interval of contacts, s."""
NO_CONTACT_S: Final = 15.0
"""Time without contact after which a bench may be taken over from another computer, s."""


@dataclass(frozen=True, slots=True)
class StoredBench:
    """One bench. Instants: seconds since 1970 UTC. The servo layer interprets `status`."""

    name: str
    host: str
    url: str | None
    version: str
    since: float
    contact: float
    state: Literal["online", "no_contact", "stopped"]
    status: Mapping[str, Json]


class Benches:
    """Benches by name. Each method commits before it returns, and may raise StoreFailed."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        """`wall` returns seconds since 1970 UTC."""
        self._database = database
        self._wall = wall
        self._process = secrets.token_hex(16)

    def claim(self) -> None:
        """Take the lock of this bench. Raises StoreFailed (bench_in_use) if another server has it.

        A server that was killed on this computer loses it at once, another one after `NO_CONTACT_S`.
        """
        with self._database.transaction() as session:
            now = self._database.now(session, self._wall())
            row = session.get(BenchRow, self._database.bench)
            if row is None:
                row = BenchRow(name=self._database.bench, status={}, since=now)
                session.add(row)
            elif row.process is not None and abs(now - row.contact) < NO_CONTACT_S and not _ended(row):
                since = datetime.fromtimestamp(row.since, UTC).isoformat(sep=" ", timespec="seconds")
                raise StoreFailed(
                    f"Bench {row.name!r} is in use by the server on {row.host}, process {row.pid}, since {since}. "
                    "Stop that server, or give this bench another name with --bench.",
                    cause="bench_in_use", bench=row.name, host=row.host, pid=row.pid, since=row.since,
                )  # fmt: skip
            row.process, row.machine, row.pid = self._process, _machine(), os.getpid()
            row.host, row.version, row.since, row.contact = socket.gethostname(), __version__, now, now

    def contact(self, url: str | None, status: Mapping[str, Json]) -> bool:
        """Store the condition of this bench. False if another server has taken it over."""
        with self._database.transaction() as session:
            row = session.get(BenchRow, self._database.bench)
            if row is None or row.process != self._process:
                return False
            row.contact, row.url, row.status = self._database.now(session, self._wall()), url, dict(status)
            return True

    def release(self) -> None:
        """Release the lock of this bench. Idempotent."""
        with self._database.transaction() as session:
            row = session.get(BenchRow, self._database.bench)
            if row is not None and row.process == self._process:
                row.process, row.contact = None, self._database.now(session, self._wall())

    def all(self) -> list[StoredBench]:
        """All benches, by name."""
        with self._database.reading() as session:
            now = self._database.now(session, self._wall())
            return [_fact(row, now) for row in session.scalars(select(BenchRow).order_by(BenchRow.name))]


def _fact(row: BenchRow, now: float) -> StoredBench:
    working = abs(now - row.contact) < NO_CONTACT_S
    state = "stopped" if row.process is None else "online" if working else "no_contact"
    return StoredBench(row.name, row.host, row.url, row.version, row.since, row.contact, state, dict(row.status))


def _machine() -> str:
    """This computer since its last start, and the namespace of its process IDs: those of containers differ."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        return f"{boot} {Path('/proc/self/ns/pid').readlink()}"
    except OSError:
        return platform.node()


def _ended(row: BenchRow) -> bool:
    """Whether the server ran on this computer and its process has ended."""
    if sys.platform == "win32" or row.machine != _machine():
        return False  # os.kill would end a process of Windows
    try:
        os.kill(row.pid, 0)
    except ProcessLookupError:
        return True
    except PermissionError:
        return False
    return False
