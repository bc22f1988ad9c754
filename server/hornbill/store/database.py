"""One engine, who may write when, and transactions that are whole or not at all."""

import sqlite3
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import OperationalError, SQLAlchemyError
from sqlalchemy.orm import Session

from hornbill.errors import StoreFailed
from hornbill.store.migrate import UnknownRevision, migrate

FILE_NAME: Final = "hornbill.sqlite3"

OPENING_S: Final = 10.0
"""How long opening waits for another process, which may be migrating."""

PATIENCE_S: Final = 1.5
"""How long a write waits for the write of another process."""

IMPATIENT_S: Final = 5.0
"""For so long after a wait in vain nothing is waited for: a database that hangs must not stop us again and again."""

ANSWER_S: Final = 2
"""How long a database server may take to be reached, and to answer one statement (it takes whole seconds)."""

_WRITE_LOCK: Final = 0x686F726E
"""Our number among the advisory locks of a PostgreSQL database."""

_PRAGMAS: Final = ("journal_mode = WAL", "synchronous = NORMAL", "foreign_keys = ON")

_READS: Final = "hornbill_reads"


class Database:
    """A database that has the tables of today for as long as it is open.

    On SQLite: write-ahead log, and a commit is on its way to the disk when it returns. It survives the death of the
    process at any moment; a power cut may undo the last few commits but damages nothing.

    Several processes may share one: a writing transaction takes the write lock at its beginning (BEGIN IMMEDIATE; on
    PostgreSQL an advisory lock), so what it reads is what it changes. It waits at most `PATIENCE_S` for another's.
    Reading waits for nobody.

    Calls block: while a server runs they are made in a thread of their own, see `Store.begin`. A file answers in well
    under a millisecond; to a database server every transaction is three to five round trips.
    """

    def __init__(self, place: str | Path) -> None:
        """Open or create. `place` is a folder, or a database URL of SQLAlchemy. Raises StoreFailed."""
        url = _url(place)
        self.address = url.render_as_string(hide_password=True)
        self._is_file = url.get_backend_name() == "sqlite"
        self._patience_s = OPENING_S
        self._impatient_until = 0.0
        try:
            # A server may have closed a connection since it was used; a file cannot.
            self._engine: Engine | None = create_engine(
                url, pool_pre_ping=not self._is_file, connect_args=_connecting(url)
            )
        except (SQLAlchemyError, ImportError) as error:
            raise StoreFailed(
                f"{self.address} is no database that can be used here: {error}. "
                "Correct the address, install its driver, or give a folder.",
                cause="store_unusable",
            ) from error
        if self._is_file:
            event.listen(self._engine, "connect", _prepare_sqlite)
            event.listen(self._engine, "begin", self._begin_sqlite)
        elif url.get_backend_name() == "postgresql":
            event.listen(self._engine, "begin", self._begin_postgresql)
        try:
            with self._engine.begin() as connection:
                migrate(connection)
        except UnknownRevision as error:
            self.close()
            raise StoreFailed(
                f"{self.address} was written by a newer hornbill (tables {error}). "
                "Install that one, or choose another data folder.",
                cause="store_newer",
            ) from None
        except (SQLAlchemyError, sqlite3.Error, OSError) as error:
            self.close()
            text = f"{self.address} cannot be opened: {_cause(error)}. {self._remedy}"
            raise StoreFailed(text, cause="store_unusable") from error
        self._patience_s = PATIENCE_S

    @contextmanager
    def transaction(self) -> Generator[Session]:
        """A session that alone writes; its changes are committed at the end, or rolled back when the block raises.

        Raises StoreFailed, and RuntimeError when the database is closed.
        """
        with self._session() as session:
            yield session

    @contextmanager
    def reading(self) -> Generator[Session]:
        """A session that sees one state of the database and writes nothing. Raises as `transaction`."""
        with self._session(**{_READS: True}) as session:
            yield session

    @contextmanager
    def writing(self) -> Generator[Connection]:
        """As `transaction`, with rows in place of objects, at a third of the cost: for what every change keeps."""
        with self._usable() as engine, engine.begin() as connection:
            yield connection

    @contextmanager
    def _session(self, **options: bool) -> Generator[Session]:
        with self._usable() as engine, Session(engine) as session, session.begin():
            session.connection(execution_options=options)
            yield session

    @contextmanager
    def _usable(self) -> Generator[Engine]:
        """The engine, whose errors are ours. Raises StoreFailed, and RuntimeError when the database is closed."""
        if self._engine is None:
            raise RuntimeError("the store is closed")
        if self._impatient and not self._is_file:
            raise StoreFailed(
                f"{self.address} did not answer a moment ago. Try again in {IMPATIENT_S:.0f} s.", cause="store_slow"
            )
        try:
            yield self._engine
        except SQLAlchemyError as error:
            if isinstance(error, OperationalError):
                self._impatient_until = time.monotonic() + IMPATIENT_S
            raise StoreFailed(
                f"{self.address} cannot be used: {_cause(error)}. {self._remedy}", cause="store_unusable"
            ) from error

    def close(self) -> None:
        """Give every connection back. Closing twice is harmless."""
        engine, self._engine = self._engine, None
        if engine is not None:
            engine.dispose()

    @property
    def _impatient(self) -> bool:
        return time.monotonic() < self._impatient_until

    @property
    def _remedy(self) -> str:
        if self._is_file:
            return "Check that the data folder can be written, has room and is not damaged, or choose another."
        return "Check that the database server runs and lets us in, or give a folder."

    def _begin_sqlite(self, connection: Connection) -> None:
        patience_s = 0.0 if self._impatient else self._patience_s
        connection.exec_driver_sql(f"PRAGMA busy_timeout = {patience_s * 1000:.0f}")
        connection.exec_driver_sql("BEGIN" if _READS in connection.get_execution_options() else "BEGIN IMMEDIATE")

    def _begin_postgresql(self, connection: Connection) -> None:
        answer_s = 0 if self._patience_s == OPENING_S else ANSWER_S  # a migration takes as long as it takes
        if _READS in connection.get_execution_options():
            connection.exec_driver_sql(f"SET LOCAL statement_timeout = '{answer_s}s'")
            return
        connection.exec_driver_sql(
            f"SET LOCAL statement_timeout = '{answer_s}s'; SET LOCAL lock_timeout = '{self._patience_s * 1000:.0f}ms'; "
            f"SELECT pg_advisory_xact_lock({_WRITE_LOCK})"
        )


def _url(place: str | Path) -> URL:
    if isinstance(place, str) and "://" in place:
        try:
            url = make_url(place)
        except (SQLAlchemyError, ValueError) as error:
            # The address may hold a password: it is not repeated.
            text = "The database address cannot be read. Give a folder, or a URL."
            raise StoreFailed(text, cause="store_unusable") from error
        # Without a driver's name SQLAlchemy would take psycopg2; "postgres" is how many hosters spell it.
        return url.set(drivername="postgresql+psycopg") if url.drivername in ("postgresql", "postgres") else url
    folder = Path(place)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        text = f"{folder} cannot be made: {error.strerror}. Choose another data folder."
        raise StoreFailed(text, cause="store_unusable") from error
    return URL.create("sqlite", database=str(folder / FILE_NAME))


def _connecting(url: URL) -> dict[str, Any]:
    if url.get_backend_name() != "postgresql":
        return {}
    ours = {"connect_timeout": ANSWER_S, "tcp_user_timeout": ANSWER_S * 1000}
    return {key: value for key, value in ours.items() if key not in url.query}


def _cause(error: Exception) -> str:
    return str(getattr(error, "orig", None) or error).strip().rstrip(".")


def _prepare_sqlite(connection: sqlite3.Connection, _record: object) -> None:
    # Without this, Python's own idea of transactions would commit in the middle of a migration.
    connection.isolation_level = None
    try:
        for pragma in (f"busy_timeout = {OPENING_S * 1000:.0f}", *_PRAGMAS):
            connection.execute(f"PRAGMA {pragma}").close()
    except sqlite3.Error:
        connection.close()  # nobody else knows of it yet
        raise
