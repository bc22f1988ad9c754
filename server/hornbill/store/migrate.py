"""Creation of the current tables in a new database, or migration of an older one."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sqlalchemy import Connection, insert, inspect, text

from hornbill.store.tables import METADATA, REVISIONS, SHARED

if TYPE_CHECKING:
    from alembic.config import Config

NEWEST: Final = "0011"
"""The last revision in migrations/versions."""

_FOLDER: Final = Path(__file__).resolve().parent / "migrations"


class UnknownRevision(Exception):
    """The database was written by a newer hornbill."""


def migrate(connection: Connection, bench: str, before: Callable[[str], None] = lambda _revision: None) -> None:
    """Create the tables in a new database, or run missing migrations, inside the caller's transaction.

    `bench` gets the rows of a database from before there were several. `before` is called with the revision found if
    there are migrations to run. Raises UnknownRevision if it is newer than this program.
    """
    if not inspect(connection).has_table("alembic_version"):
        _create(connection)
        return
    found = _stored_revision(connection)
    if found == NEWEST:
        return
    config = _config_for(found)
    from alembic import command

    before(found or "none")
    config.attributes["connection"], config.attributes["bench"] = connection, bench
    command.upgrade(config, "head")


def revision_of(connection: Connection) -> str | None:
    """The revision of the tables; None for a new database. Changes nothing. Raises UnknownRevision."""
    if not inspect(connection).has_table("alembic_version"):
        return None
    found = _stored_revision(connection)
    if found != NEWEST:
        _config_for(found)
    return found


def _stored_revision(connection: Connection) -> str | None:
    return connection.execute(text("SELECT version_num FROM alembic_version")).scalar_one_or_none()


def _config_for(revision: str | None) -> "Config":
    """Alembic's configuration. Raises UnknownRevision if the revision is not one of the migrations."""
    # Imported here because the import takes longer than opening a database that is new or up to date.
    from alembic.config import Config
    from alembic.script import ScriptDirectory

    config = Config()
    config.set_main_option("script_location", str(_FOLDER).replace("%", "%%"))
    known = {script.revision for script in ScriptDirectory.from_config(config).walk_revisions()}
    if revision is not None and revision not in known:
        raise UnknownRevision(revision)
    return config


def _create(connection: Connection) -> None:
    """Create the current tables and their revision. A test checks that they equal the result of all migrations."""
    METADATA.create_all(connection, checkfirst=False)  # an existing table is foreign: an error
    connection.execute(
        text(
            "CREATE TABLE alembic_version (version_num VARCHAR(32) NOT NULL,"
            " CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num))"
        )
    )
    connection.execute(insert(REVISIONS), [{"name": name, "revision": 0} for name in SHARED])
    connection.execute(text("INSERT INTO alembic_version VALUES (:newest)"), {"newest": NEWEST})
