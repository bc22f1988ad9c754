"""Owns Database: one engine, its pragmas, and transactions that are whole or not at all."""

import sqlite3
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from hornbill.errors import StoreFailed
from hornbill.store.migrate import UnknownRevision, migrate

FILE_NAME: Final = "hornbill.sqlite3"

_PRAGMAS: Final = ("busy_timeout = 2000", "journal_mode = WAL", "synchronous = NORMAL", "foreign_keys = ON")


class Database:
    """A database that has the tables of today for as long as it is open.

    On SQLite: write-ahead log, and a commit is on its way to the disk when it returns. It survives the death of the
    process at any moment; a power cut may undo the last few commits but damages nothing. Every transaction takes
    the write lock at its beginning, so several processes may share one file: each waits (at most 2 s)
    for the other.
    """

    def __init__(self, place: str | Path) -> None:
        """Open or create. `place` is a folder, or a database URL of SQLAlchemy. Raises StoreFailed."""
        url = _url(place)
        self.address = url.render_as_string(hide_password=True)
        # A server may have closed a connection since it was used; a file cannot.
        is_file = url.get_backend_name() == "sqlite"
        try:
            self._engine: Engine | None = create_engine(url, pool_pre_ping=not is_file)
        except (SQLAlchemyError, ImportError) as error:
            raise StoreFailed(
                f"{self.address} is no database that can be used here: {error}. "
                "Correct the address, install its driver, or give a folder."
            ) from error
        if is_file:
            event.listen(self._engine, "connect", _prepare_sqlite)
            event.listen(self._engine, "begin", _begin_sqlite)
        try:
            with self._engine.begin() as connection:
                migrate(connection)
        except UnknownRevision as error:
            self.close()
            raise StoreFailed(
                f"{self.address} was written by a newer hornbill (tables {error}). "
                "Install that one, or choose another data folder."
            ) from None
        except (SQLAlchemyError, sqlite3.Error, OSError) as error:
            self.close()
            raise StoreFailed(
                f"{self.address} cannot be opened: {getattr(error, 'orig', None) or error}. "
                "Check that the data folder can be written and is not damaged, or choose another."
            ) from error

    @contextmanager
    def transaction(self) -> Generator[Session]:
        """A session whose changes are committed at the end, or rolled back when the block raises.

        Raises RuntimeError when the database is closed.
        """
        if self._engine is None:
            raise RuntimeError("the store is closed")
        with Session(self._engine) as session, session.begin():
            yield session

    def close(self) -> None:
        """Give every connection back. Closing twice is harmless."""
        engine, self._engine = self._engine, None
        if engine is not None:
            engine.dispose()


def _url(place: str | Path) -> URL:
    if isinstance(place, str) and "://" in place:
        try:
            return make_url(place)
        except (SQLAlchemyError, ValueError) as error:
            # The address may hold a password: it is not repeated.
            raise StoreFailed("The database address cannot be read. Give a folder, or a URL.") from error
    folder = Path(place)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreFailed(f"{folder} cannot be made: {error.strerror}. Choose another data folder.") from error
    return URL.create("sqlite", database=str(folder / FILE_NAME))


def _prepare_sqlite(connection: sqlite3.Connection, _record: object) -> None:
    # Without this, Python's own idea of transactions would commit in the middle of a migration.
    connection.isolation_level = None
    try:
        for pragma in _PRAGMAS:
            connection.execute(f"PRAGMA {pragma}").close()
    except sqlite3.Error:
        connection.close()  # nobody else knows of it yet
        raise


def _begin_sqlite(connection: Connection) -> None:
    connection.exec_driver_sql("BEGIN IMMEDIATE")
