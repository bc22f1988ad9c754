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

from sqlalchemy import RowMapping, select

from hornbill import __version__
from hornbill.errors import StoreFailed
from hornbill.store.database import Database
from hornbill.store.repository import put, row_at
from hornbill.store.tables import BENCHES, Json

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
        with self._database.transaction() as connection:
            now = self._database.now(connection, self._wall())
            row = row_at(connection, BENCHES, self._database.bench)
            if row and row["process"] is not None and abs(now - row["contact"]) < NO_CONTACT_S and not _ended(row):
                since = datetime.fromtimestamp(row["since"], UTC).isoformat(sep=" ", timespec="seconds")
                raise StoreFailed(
                    f"Bench {row['name']!r} is in use by the server on {row['host']}, process {row['pid']}, since "
                    f"{since}. Stop that server, or give this bench another name with --bench.",
                    cause="bench_in_use", bench=row["name"], host=row["host"], pid=row["pid"], since=row["since"],
                )  # fmt: skip
            values = {
                "process": self._process, "machine": _machine(), "pid": os.getpid(), "host": socket.gethostname(),
                "version": __version__, "since": now, "contact": now,
            }  # fmt: skip
            put(connection, BENCHES, (self._database.bench,), values, status={})

    def contact(self, url: str | None, status: Mapping[str, Json]) -> bool:
        """Store the condition of this bench. False if another server has taken it over."""
        with self._database.transaction() as connection:
            row = row_at(connection, BENCHES, self._database.bench)
            if row is None or row["process"] != self._process:
                return False
            now = self._database.now(connection, self._wall())
            put(connection, BENCHES, (self._database.bench,), {"contact": now, "url": url, "status": dict(status)})
            return True

    def release(self) -> None:
        """Release the lock of this bench. Idempotent."""
        with self._database.transaction() as connection:
            row = row_at(connection, BENCHES, self._database.bench)
            if row is not None and row["process"] == self._process:
                now = self._database.now(connection, self._wall())
                put(connection, BENCHES, (self._database.bench,), {"process": None, "contact": now})

    def all(self) -> list[StoredBench]:
        """All benches, by name."""
        with self._database.reading() as connection:
            now = self._database.now(connection, self._wall())
            return [_fact(row, now) for row in connection.execute(select(BENCHES).order_by(BENCHES.c.name)).mappings()]


def _fact(row: RowMapping, now: float) -> StoredBench:
    working = abs(now - row["contact"]) < NO_CONTACT_S
    state = "stopped" if row["process"] is None else "online" if working else "no_contact"
    return StoredBench(
        row["name"], row["host"], row["url"], row["version"], row["since"], row["contact"], state, dict(row["status"])
    )


def _machine() -> str:
    """This computer since its last start, and the namespace of its process IDs: those of containers differ."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        return f"{boot} {Path('/proc/self/ns/pid').readlink()}"
    except OSError:
        return platform.node()


def _ended(row: RowMapping) -> bool:
    """Whether the server ran on this computer and its process has ended."""
    if sys.platform == "win32" or row["machine"] != _machine():
        return False  # os.kill would end a process of Windows
    try:
        os.kill(row["pid"], 0)
    except ProcessLookupError:
        return True
    except PermissionError:
        return False
    return False
