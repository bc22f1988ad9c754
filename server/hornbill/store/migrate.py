"""Owns bringing a database to the tables of today."""

from pathlib import Path
from typing import Final

from sqlalchemy import Connection, inspect, text

NEWEST: Final = "0005"
"""The last revision in migrations/versions."""

_FOLDER: Final = Path(__file__).resolve().parent / "migrations"


class UnknownRevision(Exception):
    """The database was made by a newer hornbill than this one."""


def migrate(connection: Connection) -> None:
    """Run the migrations a database still lacks, inside the caller's transaction.

    Raises UnknownRevision when it is newer than this program.
    """
    found = revision(connection)
    if found == NEWEST:
        return
    # Imported here: it takes longer than everything else about opening a database that is up to date.
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


def revision(connection: Connection) -> str | None:
    """The migration a database is at; None for one that has no tables of ours."""
    if not inspect(connection).has_table("alembic_version"):
        return None
    return connection.execute(text("SELECT version_num FROM alembic_version")).scalar_one_or_none()
