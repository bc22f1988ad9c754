"""Copies of an SQLite database, complete at one instant, also while a server uses it."""

import os
import sqlite3
import time
from contextlib import closing
from pathlib import Path


def copy_file(database: Path, to: Path) -> None:
    """Copy a database to the new file `to`, mode 0600. Raises FileExistsError, OSError and sqlite3.Error."""
    os.close(os.open(to, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
    try:
        read_only = f"{database.resolve().as_uri()}?mode=ro"
        with closing(sqlite3.connect(read_only, uri=True)) as source, closing(sqlite3.connect(to)) as target:
            source.backup(target)
            target.execute("PRAGMA journal_mode = DELETE").close()  # no files beside the copy
    except BaseException:
        to.unlink()
        raise


def copy_before_migration(database: Path, revision: str) -> Path:
    """Copy a database in its folder, and return the path of the copy. `revision`: that of its tables.

    Copies are never removed automatically. Raises OSError and sqlite3.Error.
    """
    copy = beside(database, f"tables-{revision}")
    copy_file(database, copy)
    return copy


def beside(database: Path, what: str) -> Path:
    """Path for a copy of a database in its folder, with the present time in its name."""
    return database.with_name(f"{database.name}.{what}.{time.strftime('%Y%m%dT%H%M%SZ', time.gmtime())}")
