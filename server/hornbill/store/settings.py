"""Persistent settings of the server, by name."""

import secrets

from sqlalchemy import delete

from hornbill.store.database import Database
from hornbill.store.repository import at, put, row_at
from hornbill.store.tables import SETTINGS, Json

_UNIQUE_ID = "unique_id"


class SettingTable:
    """JSON values by name. Each method commits before it returns."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def get(self, key: str, default: Json = None) -> Json:
        """The value with this name, or `default`."""
        with self._database.reading() as connection:
            row = row_at(connection, SETTINGS, self._database.bench, key)
            return default if row is None else row["value"]

    def put(self, key: str, value: Json) -> None:
        """Store a value under a name of at most 100 characters."""
        with self._database.transaction() as connection:
            put(connection, SETTINGS, (self._database.bench, key), {"value": value})

    def drop(self, key: str) -> None:
        """Delete the value with this name. Idempotent."""
        with self._database.transaction() as connection:
            connection.execute(delete(SETTINGS).where(at(SETTINGS, self._database.bench, key)))

    def own_unique_id(self) -> bytes:
        """The 16-byte unique ID of this installation as a node, generated once."""
        with self._database.transaction() as connection:
            row = row_at(connection, SETTINGS, self._database.bench, _UNIQUE_ID)
            value = secrets.token_hex(16) if row is None else str(row["value"])
            if row is None:
                put(connection, SETTINGS, (self._database.bench, _UNIQUE_ID), {"value": value})
            return bytes.fromhex(value)
