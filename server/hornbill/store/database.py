"""Database engine, exclusive writing, and atomic transactions."""

import logging
import platform
import sqlite3
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, Final

from sqlalchemy import URL, Connection, Engine, create_engine, event, inspect, make_url, select, text, update
from sqlalchemy.exc import DataError, IntegrityError, OperationalError, ProgrammingError, SQLAlchemyError

from hornbill.errors import StoreFailed
from hornbill.store import opening
from hornbill.store.copies import copy_before_migration
from hornbill.store.data_folder import FILE_NAME, create_private, prepare
from hornbill.store.migrate import NEWEST, UnknownRevision, migrate
from hornbill.store.tables import BENCHES, REVISIONS, SHARED

log = logging.getLogger(__name__)

OPEN_TIMEOUT_S: Final = 10.0
"""Timeout for opening while another process may be migrating, s."""

LOCK_TIMEOUT_S: Final = 1.5
"""Timeout for the write lock held by another process, s."""

BACKOFF_S: Final = 5.0
"""Time after a timeout during which calls fail without waiting, so that a hanging database blocks us only once, s."""

SERVER_TIMEOUT_S: Final = 2
"""Timeout for connecting to a database server and for each statement, in whole seconds."""

_WRITE_LOCK: Final = 0x686F726E
"""Number of our advisory lock in a PostgreSQL database."""

_PRAGMAS: Final = ("journal_mode = WAL", "synchronous = NORMAL", "foreign_keys = ON")

_READS: Final = "hornbill_reads"

ABANDONED: Final[ContextVar[Callable[[], bool] | None]] = ContextVar("abandoned", default=None)
"""In a thread, returns whether its call was reported as failed, so that the transaction is rolled back."""


class Database:
    """An open database with the current tables.

    On SQLite: write-ahead log; a commit is on its way to the disk when it returns. It survives the death of the process
    at any moment. A power cut may undo the last few commits, but damages nothing.

    Several processes may share a database: a writing transaction takes the write lock at its start (BEGIN IMMEDIATE; on
    PostgreSQL an advisory lock), so it changes exactly what it has read. It waits at most `LOCK_TIMEOUT_S` for the
    lock. Reading never waits.

    Calls block; while a server runs they are made in a separate thread, see `Store.begin`. A file takes well under a
    millisecond per call; a database server takes three to five round trips per transaction.
    """

    def __init__(self, place: str | Path, bench: str | None = None) -> None:
        """Open or create. `place`: a folder, or a database URL of SQLAlchemy. Raises StoreFailed.

        `bench`: name of the bench. Default: the only bench in a file, because the name of a computer may change;
        otherwise the host name.
        """
        self._engine: Engine | None
        self._engine = engine = engine_of(place)
        self.address = engine.url.render_as_string(hide_password=True)
        self.is_file = engine.url.get_backend_name() == "sqlite"
        self._lock_timeout_s = OPEN_TIMEOUT_S
        self._backoff_until = 0.0
        self._copy: Path | None = None
        if self.is_file:
            event.listen(engine, "connect", _prepare_sqlite)
            event.listen(engine, "begin", self._begin_sqlite)
        elif engine.url.get_backend_name() == "postgresql":
            event.listen(engine, "begin", self._begin_postgresql)
        self.known: dict[str, int] = {}
        """Revisions of shared tables up to which all changes are ours or were read."""
        if not self.is_file or engine.url.database:  # no other process changes a database in memory
            event.listen(engine, "after_execute", self._count)
            event.listen(engine, "rollback", self._uncount)
        try:
            file = engine.url.database
            if self.is_file and file and Path(file).parent.is_dir():
                create_private(Path(file))
            with engine.begin() as connection:
                self.bench = bench or self._only_bench(connection) or platform.node()[:64] or "bench"
                """Name of the bench whose rows are used."""
                migrate(connection, self.bench, before=self._before_migration)
        except UnknownRevision as error:
            self.close()
            raise opening.newer(self.address, str(error)) from None
        except (SQLAlchemyError, sqlite3.Error, OSError) as error:
            self.close()
            if self._copy is not None:  # the database is unchanged
                self._copy.unlink(missing_ok=True)
            raise opening.failed(self.address, error, is_file=self.is_file) from error
        self._lock_timeout_s = LOCK_TIMEOUT_S

    @contextmanager
    def transaction(self) -> Generator[Connection]:
        """A connection that writes exclusively. Commits at the end, rolls back if the block raises.

        Raises StoreFailed, and RuntimeError if the database is closed.
        """
        with self._connection() as connection:
            yield connection

    @contextmanager
    def reading(self) -> Generator[Connection]:
        """A read-only connection with a consistent view. Raises the errors of `transaction`."""
        with self._connection(**{_READS: True}) as connection:
            yield connection

    def now(self, connection: Connection, wall: float) -> float:
        """Time by which benches compare their contacts, seconds since 1970 UTC: that of the database server, because
        the clocks of computers differ; of a file, `wall`."""
        if self.is_file:
            return wall
        return float(connection.scalar(text("SELECT EXTRACT(EPOCH FROM clock_timestamp())")))

    def _only_bench(self, connection: Connection) -> str | None:
        if not self.is_file or not inspect(connection).has_table("benches"):
            return None
        names = connection.scalars(select(BENCHES.c.name).limit(2)).all()
        return names[0] if len(names) == 1 else None

    def _count(self, connection: Connection, clause: Any, *_more: Any) -> None:
        """Count a change of a shared table, once per transaction."""
        name = getattr(getattr(clause, "table", None), "name", None) if getattr(clause, "is_dml", False) else None
        counted: set[str] = connection.info.setdefault("counted", set())
        if name not in SHARED or name in counted:
            return
        counted.add(name)
        row = REVISIONS.c.name == name
        connection.execute(update(REVISIONS).where(row).values(revision=REVISIONS.c.revision + 1))
        revision = connection.scalar(select(REVISIONS.c.revision).where(row))
        if revision is not None and self.known.get(name) == revision - 1:
            self.known[name] = revision

    def _uncount(self, connection: Connection) -> None:
        for name in connection.info.pop("counted", ()):
            self.known.pop(name, None)

    @contextmanager
    def _connection(self, **options: bool) -> Generator[Connection]:
        with self._usable() as engine, engine.connect().execution_options(**options) as connection, connection.begin():
            yield connection
            _check_waiter()

    @contextmanager
    def _usable(self) -> Generator[Engine]:
        """The engine, with errors translated. Raises StoreFailed, and RuntimeError if the database is closed."""
        if self._engine is None:
            raise RuntimeError("the store is closed")
        if self._backing_off and not self.is_file:
            raise StoreFailed(
                f"{self.address} did not respond recently. Try again in {BACKOFF_S:.0f} s.",
                cause="store_timeout",
                retry=True,
            )
        try:
            yield self._engine
        except SQLAlchemyError as error:
            if isinstance(error, IntegrityError | DataError | ProgrammingError):
                reason = str(getattr(error, "orig", None) or error).strip().rstrip(".")
                raise StoreFailed(f"{self.address} rejected data: {reason}.", cause="store_rejected") from error
            if isinstance(error, OperationalError):
                self._backoff_until = time.monotonic() + BACKOFF_S
            raise opening.failed(self.address, error, is_file=self.is_file) from error

    def close(self) -> None:
        """Close all connections. Idempotent."""
        engine, self._engine = self._engine, None
        if engine is not None:
            engine.dispose()

    @property
    def _backing_off(self) -> bool:
        return time.monotonic() < self._backoff_until

    def _before_migration(self, revision: str) -> None:
        """Copy a file before its tables change, and report both. A database server has copies of its own."""
        file = self._engine.url.database if self._engine is not None and self.is_file else None
        kept = ""
        if file and Path(file).is_file():
            self._copy = copy_before_migration(Path(file), revision)
            kept = f" The previous database is in {self._copy}."
        log.warning("Migrating %s from tables %s to %s.%s", self.address, revision, NEWEST, kept)

    def _begin_sqlite(self, connection: Connection) -> None:
        connection.info.pop("counted", None)
        lock_timeout_s = 0.0 if self._backing_off else self._lock_timeout_s
        connection.exec_driver_sql(f"PRAGMA busy_timeout = {lock_timeout_s * 1000:.0f}")
        connection.exec_driver_sql("BEGIN" if _READS in connection.get_execution_options() else "BEGIN IMMEDIATE")

    def _begin_postgresql(self, connection: Connection) -> None:
        connection.info.pop("counted", None)
        timeout_s = 0 if self._lock_timeout_s == OPEN_TIMEOUT_S else SERVER_TIMEOUT_S  # a migration has no timeout
        if _READS in connection.get_execution_options():
            connection.exec_driver_sql(f"SET LOCAL statement_timeout = '{timeout_s}s'")
            return
        lock_timeout_ms = round(self._lock_timeout_s * 1000)
        connection.exec_driver_sql(
            f"SET LOCAL statement_timeout = '{timeout_s}s'; SET LOCAL lock_timeout = '{lock_timeout_ms}ms'; "
            f"SELECT pg_advisory_xact_lock({_WRITE_LOCK})"
        )


def engine_of(place: str | Path) -> Engine:
    """Engine of a folder, which is created, or of a database URL; not connected yet. Raises StoreFailed."""
    url = _url(place)
    address = url.render_as_string(hide_password=True)
    try:
        # A server may have closed an idle connection; a file cannot.
        return create_engine(url, pool_pre_ping=url.get_backend_name() != "sqlite", connect_args=_connecting(url))
    except ImportError as error:
        raise opening.driver_missing(address, error.name or str(error)) from error
    except SQLAlchemyError as error:
        raise StoreFailed(
            f"{address} is not a usable database: {error}. Correct the address, or specify a folder.",
            cause="store_unusable", reason="address", retry=False,
        ) from error  # fmt: skip


def _check_waiter() -> None:
    abandoned = ABANDONED.get()
    if abandoned is not None and abandoned():
        raise StoreFailed("The database responded too late.", cause="store_timeout", retry=True)


def _url(place: str | Path) -> URL:
    if isinstance(place, str) and "://" in place:
        try:
            url = make_url(place)
        except (SQLAlchemyError, ValueError) as error:
            # The address may contain a password, so it is not repeated.
            text = "The database address is invalid. Specify a folder or a URL."
            raise StoreFailed(text, cause="store_unusable", reason="address", retry=False) from error
        # Without a driver name SQLAlchemy would use psycopg2. Many hosting providers write "postgres".
        return url.set(drivername="postgresql+psycopg") if url.drivername in ("postgresql", "postgres") else url
    folder = Path(place)
    prepare(folder)
    return URL.create("sqlite", database=str(folder / FILE_NAME))


def _connecting(url: URL) -> dict[str, Any]:
    if url.get_backend_name() != "postgresql":
        return {}
    ours = {"connect_timeout": SERVER_TIMEOUT_S, "tcp_user_timeout": SERVER_TIMEOUT_S * 1000}
    return {key: value for key, value in ours.items() if key not in url.query}


def _prepare_sqlite(connection: sqlite3.Connection, _record: object) -> None:
    # Otherwise Python's implicit transactions would commit in the middle of a migration.
    connection.isolation_level = None
    try:
        for pragma in (f"busy_timeout = {OPEN_TIMEOUT_S * 1000:.0f}", *_PRAGMAS):
            connection.execute(f"PRAGMA {pragma}").close()
    except sqlite3.Error:
        connection.close()  # not yet known to the engine
        raise
