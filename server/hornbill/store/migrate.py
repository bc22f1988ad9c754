"""Bring a database to the tables of today: made at once in a new one, by migrations in an older one."""

from pathlib import Path
from typing import Final

from sqlalchemy import Connection, inspect, text

from hornbill.store.tables import Table

NEWEST: Final = "0008"
"""The last revision in migrations/versions."""

_FOLDER: Final = Path(__file__).resolve().parent / "migrations"


class UnknownRevision(Exception):
    """The database was made by a newer hornbill than this one."""


def migrate(connection: Connection) -> None:
    """Make the tables in a new database, or run the migrations one still lacks, inside the caller's transaction.

    Raises UnknownRevision when it is newer than this program.
    """
    if not inspect(connection).has_table("alembic_version"):
        _make(connection)
        return
    found = connection.execute(text("SELECT version_num FROM alembic_version")).scalar_one_or_none()
    if found == NEWEST:
        return
    # Imported here: it takes longer than everything else about opening a database that is new or up to date.
    from alembic import command
    from alembic.config import Config
    from alembic.script import ScriptDirectory

    config = Config()
    config.set_main_option("script_location", str(_FOLDER).replace("%", "%%"))
    known = {script.revision for script in ScriptDirectory.from_config(config).walk_revisions()}
    if found is not None and found not in known:
        raise UnknownRevision(found)
    config.attributes["connection"] = connection
    command.upgrade(config, "head")


def _make(connection: Connection) -> None:
    """The tables as they are now, marked as such. A test holds them equal to what all migrations lead to."""
    Table.metadata.create_all(connection, checkfirst=False)  # a table that is there already is not ours: an error
    connection.execute(
        text(
            "CREATE TABLE alembic_version (version_num VARCHAR(32) NOT NULL,"
            " CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num))"
        )
    )
    connection.execute(text("INSERT INTO alembic_version VALUES (:newest)"), {"newest": NEWEST})
