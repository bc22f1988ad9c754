"""Common access to one table, by key."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from operator import itemgetter
from typing import Any, Generic, TypeVar

from sqlalchemy import (
    Column,
    ColumnElement,
    Connection,
    RowMapping,
    Select,
    Table,
    and_,
    delete,
    insert,
    select,
    update,
)

from hornbill.errors import Unknown
from hornbill.store.database import Database
from hornbill.store.tables import HIGHEST_ID

F = TypeVar("F")

_AT_ONCE = 1000
"""Maximum number of rows deleted at once."""


class Repository(Generic[F]):
    """Rows of one table as frozen dataclasses whose fields are columns of the same names.

    Each method commits before it returns, and may raise StoreFailed.
    """

    def __init__(self, database: Database, wall: Callable[[], float], table: Table, fact: type[F]) -> None:
        """`wall` returns seconds since 1970 UTC."""
        self._database = database
        self._wall = wall
        self._table = table
        keys = [*table.primary_key]
        self._key = keys[-1]
        self._own = len(keys) == 2 and keys[0].name == "bench"
        self._make = fact
        self._values = itemgetter(*(one.name for one in fields(fact)))  # pyright: ignore[reportArgumentType]

    def get(self, key: Any) -> F:
        """The row with this key, as a dataclass. Raises Unknown."""
        with self._database.reading() as connection:
            return self._fact(self._row(connection, key))

    def drop(self, key: Any) -> None:
        """Delete the row with this key. Raises Unknown."""
        with self._database.transaction() as connection:
            self._row(connection, key)
            connection.execute(delete(self._table).where(at(self._table, *self._identity(key))))

    def _unknown(self, key: Any) -> Unknown:
        """The error for a key without a row."""
        raise NotImplementedError

    def _row(self, connection: Connection, key: Any) -> RowMapping:
        """The row with this key. Raises Unknown."""
        in_range = not isinstance(key, int) or 0 < key <= HIGHEST_ID
        row = row_at(connection, self._table, *self._identity(key)) if in_range else None
        if row is None:
            raise self._unknown(key)
        return row

    def _identity(self, key: Any) -> tuple[Any, ...]:
        """Primary key of a row: rows of a bench have its name, too."""
        return (self._database.bench, key) if self._own else (key,)

    def _facts(self, query: Select[Any]) -> list[F]:
        with self._database.reading() as connection:
            return [self._fact(row) for row in connection.execute(query).mappings()]

    def _fact(self, row: RowMapping | Mapping[str, Any]) -> F:
        return self._make(*self._values(row))

    def _prune(self, connection: Connection, retain: int, newest: Column[Any], *of: ColumnElement[bool]) -> None:
        """Delete the rows `of` beyond the newest `retain`."""
        beyond = select(self._key).where(*of).order_by(newest.desc()).offset(retain).limit(_AT_ONCE)
        old = connection.scalars(beyond).all()
        if old:
            connection.execute(delete(self._table).where(self._key.in_(old)))


def at(table: Table, *key: Any) -> ColumnElement[bool]:
    """Condition for the row with this primary key."""
    return and_(*(column == value for column, value in zip(table.primary_key, key, strict=True)))


def row_at(connection: Connection, table: Table, *key: Any) -> RowMapping | None:
    """The row with this primary key."""
    return connection.execute(select(table).where(at(table, *key))).mappings().one_or_none()


def put(connection: Connection, table: Table, key: tuple[Any, ...], values: Mapping[str, Any], **new: Any) -> None:
    """Set `values` of the row with this primary key. If there is none, add it, also with the values `new`."""
    if not connection.execute(update(table).where(at(table, *key)).values(values)).rowcount:
        names = (column.name for column in table.primary_key)
        connection.execute(insert(table), {**dict(zip(names, key, strict=True)), **new, **values})
