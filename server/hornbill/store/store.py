"""Store: the one database of an installation, and what is kept in it."""

import asyncio
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Final, ParamSpec, Self, TypeVar, cast

from sqlalchemy import insert, select

from hornbill.store.allocations import AllocationStore
from hornbill.store.answers import Answers
from hornbill.store.audit import AuditLog
from hornbill.store.behind import Behind, ChangeMethod, Writer
from hornbill.store.database import Database
from hornbill.store.faults import FaultLog
from hornbill.store.jobs import StoredJobs
from hornbill.store.profiles import ProfileTable
from hornbill.store.runs import Runs
from hornbill.store.servos import Servos
from hornbill.store.settings import SettingTable
from hornbill.store.snapshots import Snapshots
from hornbill.store.tables import AllocationRow, FaultRow, ProfileRow, ServoRow, SettingRow
from hornbill.store.tokens import Tokens

P = ParamSpec("P")
T = TypeVar("T")

_SMALL: Final = (AllocationRow, FaultRow, ProfileRow, ServoRow, SettingRow)
"""Tables that are whole in memory while a server runs."""


class Store:
    """What must last. Its methods are plain calls, and block: on SQLite each takes well under a millisecond.

    After `begin` the event loop waits for none of them: small tables are read and changed in memory, and what is
    changed follows into the database in order; what is large is read by `await run(…)`.
    """

    def __init__(self, place: str | Path, *, wall: Callable[[], float] = time.time) -> None:
        """Open or create. `place` is a folder or a database URL; `wall` gives seconds since 1970 (UTC).

        Raises StoreFailed when it cannot be opened, is damaged, or was written by a newer hornbill.
        """
        self._database = Database(place)
        self._near: Database | None = None
        self._wall = wall
        self._writer: Writer | None = None
        self.address = self._database.address
        """The database, for people to see: without its password."""
        self._listeners: list[Callable[[Exception | None], object]] = []
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
        self.answers = Answers(self._database, now)

    def begin(self) -> None:
        """Let no event loop wait for the database from now on. Call it before anybody else uses this store."""
        self.settings.own_unique_id()  # made before the copy, which would make one that is kept nowhere
        self._writer = Writer(self._wall, self._done)
        self._near = near = Database("sqlite://")
        with self._database.reading() as far, near.transaction() as session:
            for table in _SMALL:
                rows = [dict(row) for row in far.execute(select(table.__table__)).mappings()]
                if rows:
                    session.execute(insert(table), rows)
        now = self._now
        self.allocations = self._behind(
            self.allocations, AllocationStore(near, now), "record", "seen", "pin", "drop"
        )  # fmt: skip
        self.servos = self._behind(
            self.servos, Servos(near, now), "met", "label", "write_down", "keep_rom", "keep_drift", "forget"
        )
        self.profiles = self._behind(self.profiles, ProfileTable(near, now), "put", "drop")
        self.faults = self._behind(self.faults, FaultLog(near, now), "keep", "acknowledge", "forget")
        self.settings = self._behind(self.settings, SettingTable(near), "put", "drop")
        self.audit = self._behind(self.audit, None, "add")
        self.jobs = self._behind(self.jobs, None, "put")

    async def run(self, call: Callable[P, T], *args: P.args, **options: P.kwargs) -> T:
        """Make a call, and wait until it has been made: all that was changed before is in the database then, too.

        For reading what is not in memory, and for changes that must last when this returns: those are made in the
        database first. Raises what `call` raises; nothing has changed then.
        """
        if isinstance(call, ChangeMethod):
            return await call.lasting(*args, **options)
        if self._writer is None:
            return call(*args, **options)
        return await self._writer.run(lambda: call(*args, **options))

    def listen(self, listener: Callable[[Exception | None], object]) -> Callable[[], None]:
        """Call `listener` after every change that was written to the database, with the error if it failed.

        Returns what ends it; twice is harmless.
        """
        self._listeners.append(listener)

        def forget() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)

        return forget

    async def settled(self) -> None:
        """Wait until all that was changed before is in the database, or failed to get there (see `listen`)."""
        await self.run(lambda: None)

    def posted(self, subject: object) -> "asyncio.Future[object] | None":
        """The last change of a subject, while it may not be in the database yet."""
        return subject.posted if isinstance(subject, Behind) else None

    def close(self) -> None:
        """Give the database back, when all that was changed is in it; every later call raises RuntimeError.

        Twice is harmless.
        """
        if self._writer is not None:
            self._writer.close()
        if self._near is not None:
            self._near.close()
        self._database.close()

    def _done(self, error: Exception | None) -> None:
        for listener in tuple(self._listeners):
            listener(error)

    def _now(self) -> float:
        return self._wall() if self._writer is None else self._writer.now()

    def _behind(self, far: T, near: T | None, *changes: str) -> T:
        assert self._writer is not None
        return cast(T, Behind(far, near, frozenset(changes), self._writer))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
