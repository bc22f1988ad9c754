"""Contents of a database, without changing it: for `hornbill check` and for restoring a backup."""

import sqlite3
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import inspect as inspector_of
from sqlalchemy import text
from sqlalchemy.exc import SQLAlchemyError

from hornbill.store import opening
from hornbill.store.database import LOCK_TIMEOUT_S, engine_of
from hornbill.store.migrate import NEWEST, UnknownRevision, revision_of


@dataclass(frozen=True, slots=True)
class Inspection:
    """State of a database."""

    address: str
    """Without the password."""
    revision: str | None
    """Revision of its tables; None for a new database."""
    has_tokens: bool = False
    is_file: bool = True

    @property
    def outdated(self) -> bool:
        """Whether the next start migrates it."""
        return self.revision not in (None, NEWEST)


def inspect(place: str | Path) -> Inspection:
    """Check a database. `place`: a folder, which is created, or a URL.

    Raises StoreFailed if it cannot be used, is damaged or was written by a newer hornbill.
    """
    engine = engine_of(place)
    address = engine.url.render_as_string(hide_password=True)
    is_file = engine.url.get_backend_name() == "sqlite"
    file = engine.url.database
    try:
        if is_file and (not file or not Path(file).exists()):
            return Inspection(address, None)
        with engine.connect() as connection:
            if is_file:
                connection.exec_driver_sql(f"PRAGMA busy_timeout = {LOCK_TIMEOUT_S * 1000:.0f}")
                found = connection.exec_driver_sql("PRAGMA quick_check(1)").scalar()
                if found != "ok":
                    raise opening.damaged(address, str(found))
            revision = revision_of(connection)
            has_tokens = inspector_of(connection).has_table("tokens") and (
                connection.execute(text("SELECT name FROM tokens LIMIT 1")).first() is not None
            )
        return Inspection(address, revision, has_tokens, is_file)
    except UnknownRevision as error:
        raise opening.newer(address, str(error)) from None
    except (SQLAlchemyError, sqlite3.Error, OSError) as error:
        raise opening.failed(address, error, is_file=is_file) from error
    finally:
        engine.dispose()
