"""Owns Store: the one database of an installation, and what is kept in it."""

import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

from hornbill.store.allocations import Allocations
from hornbill.store.answers import Answers
from hornbill.store.audit import AuditLog
from hornbill.store.database import Database
from hornbill.store.faults import FaultLog
from hornbill.store.jobs import StoredJobs
from hornbill.store.profiles import Profiles
from hornbill.store.runs import Runs
from hornbill.store.servos import Servos
from hornbill.store.settings import Settings
from hornbill.store.snapshots import Snapshots
from hornbill.store.tokens import Tokens


class Store:
    """What must last. Its methods are plain calls for the event loop: on SQLite each takes well under a millisecond."""

    def __init__(self, place: str | Path, *, wall: Callable[[], float] = time.time) -> None:
        """Open or create. `place` is a folder or a database URL; `wall` gives seconds since 1970 (UTC).

        Raises StoreFailed when it cannot be opened, is damaged, or was written by a newer hornbill.
        """
        self._database = Database(place)
        self.address = self._database.address
        """The database, for people to see: without its password."""
        self.allocations = Allocations(self._database, wall)
        self.servos = Servos(self._database, wall)
        self.snapshots = Snapshots(self._database, wall)
        self.profiles = Profiles(self._database, wall)
        self.audit = AuditLog(self._database, wall)
        self.jobs = StoredJobs(self._database)
        self.runs = Runs(self._database, wall)
        self.faults = FaultLog(self._database)
        self.settings = Settings(self._database)
        self.tokens = Tokens(self._database, wall)
        self.answers = Answers(self._database, wall)

    def close(self) -> None:
        """Give the database back; every later call raises RuntimeError. Twice is harmless."""
        self._database.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
