"""Small values of ours that outlive the process, by name."""

import secrets

from hornbill.store.database import Database
from hornbill.store.tables import Json, SettingRow

_UNIQUE_ID = "unique_id"


class SettingTable:
    """JSON values by name. Every method has been committed when it returns."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def get(self, key: str, default: Json = None) -> Json:
        """The value kept under a name, or `default`."""
        with self._database.reading() as session:
            row = session.get(SettingRow, key)
            return default if row is None else row.value

    def put(self, key: str, value: Json) -> None:
        """Keep a value under a name of at most 100 characters."""
        with self._database.transaction() as session:
            row = session.get(SettingRow, key)
            if row is None:
                session.add(SettingRow(key=key, value=value))
            else:
                row.value = value

    def drop(self, key: str) -> None:
        """Keep nothing under a name any more."""
        with self._database.transaction() as session:
            row = session.get(SettingRow, key)
            if row is not None:
                session.delete(row)

    def own_unique_id(self) -> bytes:
        """The 16 bytes by which other nodes know this installation; made at random once, then the same."""
        with self._database.transaction() as session:
            row = session.get(SettingRow, _UNIQUE_ID)
            if row is None:
                row = SettingRow(key=_UNIQUE_ID, value=secrets.token_hex(16))
                session.add(row)
            return bytes.fromhex(str(row.value))
