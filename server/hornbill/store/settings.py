"""Persistent settings of the server, by name."""

import secrets

from hornbill.store.database import Database
from hornbill.store.tables import Json, SettingRow

_UNIQUE_ID = "unique_id"


class SettingTable:
    """JSON values by name. Each method commits before it returns."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def get(self, key: str, default: Json = None) -> Json:
        """The value with this name, or `default`."""
        with self._database.reading() as session:
            row = session.get(SettingRow, (self._database.bench, key))
            return default if row is None else row.value

    def put(self, key: str, value: Json) -> None:
        """Store a value under a name of at most 100 characters."""
        with self._database.transaction() as session:
            row = session.get(SettingRow, (self._database.bench, key))
            if row is None:
                session.add(SettingRow(bench=self._database.bench, key=key, value=value))
            else:
                row.value = value

    def drop(self, key: str) -> None:
        """Delete the value with this name. Idempotent."""
        with self._database.transaction() as session:
            row = session.get(SettingRow, (self._database.bench, key))
            if row is not None:
                session.delete(row)

    def own_unique_id(self) -> bytes:
        """The 16-byte unique ID of this installation as a node, generated once."""
        with self._database.transaction() as session:
            row = session.get(SettingRow, (self._database.bench, _UNIQUE_ID))
            if row is None:
                row = SettingRow(bench=self._database.bench, key=_UNIQUE_ID, value=secrets.token_hex(16))
                session.add(row)
            return bytes.fromhex(str(row.value))
