"""The database of an installation, with access to all its subjects."""

import asyncio
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, Final, ParamSpec, Self, TypeVar, cast

from sqlalchemy import Connection, Table, delete, insert, select

from hornbill.errors import StoreFailed
from hornbill.store.allocations import AllocationStore
from hornbill.store.audit import AuditLog
from hornbill.store.benches import Benches
from hornbill.store.database import Database
from hornbill.store.faults import FaultLog
from hornbill.store.jobs import StoredJobs
from hornbill.store.profiles import ProfileTable
from hornbill.store.responses import Keys, Responses
from hornbill.store.runs import Runs
from hornbill.store.servos import Servos
from hornbill.store.settings import SettingTable
from hornbill.store.snapshots import Snapshots
from hornbill.store.tables import ALLOCATIONS, FAULTS, PROFILES, REVISIONS, SERVOS, SETTINGS
from hornbill.store.tokens import Tokens
from hornbill.store.write_behind import ChangeMethod, WriteBehind, Writer

P = ParamSpec("P")
T = TypeVar("T")

_SHARED: Final = {"servos": SERVOS, "profiles": PROFILES, "faults": FAULTS}
"""Tables in memory that other benches may change."""

_SMALL: Final = (ALLOCATIONS, FAULTS, PROFILES, SERVOS, SETTINGS)
"""Tables that are entirely in memory while a server runs."""


class Store:
    """Persistent state. Methods block; on SQLite each takes well under a millisecond.

    After `begin` the event loop never waits for them: small tables are read and changed in memory, and changes are
    written behind to the database in order. Large tables are read with `await run(…)`.
    """

    def __init__(self, place: str | Path, *, bench: str | None = None, wall: Callable[[], float] = time.time) -> None:
        """Open or create. `place`: a folder or a database URL. `wall` returns seconds since 1970 UTC.

        `bench`: as in `Database`. Allocations, jobs, settings and responses are those of the bench; all else is shared.
        Raises StoreFailed if it cannot be opened, is damaged, or was written by a newer hornbill.
        """
        self._database = Database(place, bench)
        self.bench = self._database.bench
        """Name of the bench."""
        self._memory: Database | None = None
        self._wall = wall
        self._writer: Writer | None = None
        self.address = self._database.address
        """Address of the database without its password."""
        self._listeners: list[Callable[[Exception | None], object]] = []
        self.failing_since: float | None = None
        """When writes to the database began to fail, seconds since 1970 UTC. None if the last one succeeded."""
        now = self._now
        self.allocations = AllocationStore(self._database, now)
        self.servos = Servos(self._database, now)
        self.snapshots = Snapshots(self._database, now)
        self.profiles = ProfileTable(self._database, now)
        self.audit = AuditLog(self._database, now)
        self.jobs = StoredJobs(self._database, now)
        self.runs = Runs(self._database, now)
        self.faults = FaultLog(self._database, now)
        self.settings = SettingTable(self._database)
        self.tokens = Tokens(self._database, now)
        self.responses = Responses(self._database, now)
        self.keys = Keys(self.responses, self.run_or_later, wall)
        self.benches = Benches(self._database, wall)
        self._on_changed: list[Callable[[str], object]] = []

    def begin(self) -> None:
        """Switch to write-behind, so that the event loop never waits. Call it before any other use of this store.

        Raises StoreFailed (bench_in_use) if another server works for this bench.
        """
        self.benches.claim()
        self.settings.own_unique_id()  # before the copy to memory, which would generate one that is not stored
        self._writer = Writer(self._wall, self._done)
        self._memory = memory = Database("sqlite://", self.bench)
        with self._database.reading() as database, memory.transaction() as connection:
            for table in _SMALL:
                rows = [dict(row) for row in database.execute(select(table)).mappings()]
                if rows:
                    connection.execute(insert(table), rows)
            self._database.known = _revisions(database)
        now = self._now
        self.allocations = self._behind(
            self.allocations, AllocationStore(memory, now), "record", "seen", "pin", "drop"
        )  # fmt: skip
        self.servos = self._behind(
            self.servos, Servos(memory, now), "seen", "set_label", "set_notes", "put_set_up", "put_rom", "put_drift",
            "forget",
        )  # fmt: skip
        self.profiles = self._behind(self.profiles, ProfileTable(memory, now), "put", "drop")
        self.faults = self._behind(self.faults, FaultLog(memory, now), "record", "acknowledge", "forget")
        self.settings = self._behind(self.settings, SettingTable(memory), "put", "drop")
        self.audit = self._behind(self.audit, None, "add")
        self.jobs = self._behind(self.jobs, None, "put")
        self.benches = self._behind(self.benches, None, "contact")

    @property
    def pending(self) -> int:
        """Number of changes that are not in the database yet."""
        return 0 if self._writer is None else self._writer.pending

    async def run(self, call: Callable[P, T], *args: P.args, **options: P.kwargs) -> T:
        """Execute a call in the database thread and wait for it. All earlier changes are then in the database, too.

        For reading data that is not in memory, and for changes that must be durable on return: these are made in the
        database first. Raises the exception of `call`; then nothing has changed.
        """
        if isinstance(call, ChangeMethod):
            try:
                result = await call.durable(*args, **options)
            except StoreFailed as error:
                self._done(error)
                raise
            self._done(None)
            return result
        if self._writer is None:
            return call(*args, **options)
        return await self._writer.run(lambda: call(*args, **options), lambda result: result)

    async def run_or_later(self, call: Callable[P, T], *args: P.args, **options: P.kwargs) -> T | None:
        """`run`, but while the database is unreachable the call waits in memory in the order of changes, and None is
        returned. It may be made twice, so a repeat must change nothing. Raises other failures, such as a full disk."""
        try:
            return await self.run(call, *args, **options)
        except StoreFailed as error:
            if self._writer is None or not error.facts.get("retry"):
                raise
            self._writer.post(lambda: call(*args, **options))
            return None

    @property
    def lost(self) -> int:
        """Number of changes given up since the start."""
        return 0 if self._writer is None else self._writer.lost

    def now(self) -> float:
        """Seconds since 1970 UTC."""
        return self._wall()

    def on_changed(self, listener: Callable[[str], object]) -> None:
        """Call `listener` with the name of a shared table that another process changed, once it was re-read."""
        self._on_changed.append(listener)

    async def refresh(self) -> None:
        """Re-read shared tables that other processes changed. Call once a second. Raises StoreFailed."""
        if self._writer is None or self._memory is None:
            return
        behind: dict[Table, Any] = {SERVOS: self.servos, PROFILES: self.profiles, FAULTS: self.faults}
        before = {table: one.submitted for table, one in behind.items()}
        revisions, rows = await self._writer.run(self._changed, lambda found: found)
        for name in rows:
            table = _SHARED.get(name)
            if table is not None:
                if behind[table].submitted != before[table]:
                    continue  # changed here meanwhile: next time
                with self._memory.transaction() as connection:
                    connection.execute(delete(table))
                    if rows[name]:
                        connection.execute(insert(table), rows[name])
            self._database.known[name] = revisions[name]
            for listener in self._on_changed:
                listener(name)

    def _changed(self) -> tuple[dict[str, int], dict[str, list[dict[str, Any]]]]:
        """Revisions, and the rows of the tables whose revision is unknown; no rows of tables that are not in memory."""
        with self._database.reading() as connection:
            revisions = _revisions(connection)
            changed = [name for name, revision in revisions.items() if self._database.known.get(name) != revision]
            rows = {
                name: [dict(row) for row in connection.execute(select(_SHARED[name])).mappings()]
                if name in _SHARED
                else []
                for name in changed
            }
        return revisions, rows

    def listen(self, listener: Callable[[Exception | None], object]) -> Callable[[], None]:
        """Call `listener` after each write to the database, with its error or None.

        Returns a function to unsubscribe. Idempotent.
        """
        self._listeners.append(listener)

        def unsubscribe() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)

        return unsubscribe

    async def settled(self) -> None:
        """Wait until all earlier changes are written to the database or have failed (see `listen`)."""
        await self.run(lambda: None)

    def posted(self, subject: object) -> "asyncio.Future[object] | None":
        """The last submitted change of a subject, which may not be in the database yet."""
        return subject.posted if isinstance(subject, WriteBehind) else None

    def close(self) -> None:
        """Write all changes, then close the database. Later calls raise RuntimeError. Idempotent.

        If the database hangs, this returns after a few seconds, and the changes that were not written are lost.
        """
        if self._writer is not None:
            self._writer.close(self.benches.release)
        if self._memory is not None:
            self._memory.close()
        self._database.close()

    def _done(self, error: Exception | None) -> None:
        if error is None:
            self.failing_since = None
        elif self.failing_since is None:
            self.failing_since = self._wall()
        for listener in tuple(self._listeners):
            listener(error)

    def _now(self) -> float:
        return self._wall() if self._writer is None else self._writer.now()

    def _behind(self, database: T, memory: T | None, *changes: str) -> T:
        assert self._writer is not None
        return cast(T, WriteBehind(database, memory, frozenset(changes), self._writer))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _revisions(connection: Connection) -> dict[str, int]:
    """Revision of each shared table."""
    return {row.name: row.revision for row in connection.execute(select(REVISIONS))}
