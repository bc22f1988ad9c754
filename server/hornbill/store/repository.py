"""Common access to one table, by key."""

from collections.abc import Callable
from dataclasses import fields
from operator import attrgetter
from typing import Any, Generic, TypeVar

from sqlalchemy import ColumnElement, Connection, Row, Select, delete, inspect, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from hornbill.errors import Unknown
from hornbill.store.database import Database
from hornbill.store.tables import HIGHEST_ID, Table

R = TypeVar("R", bound=Table)
F = TypeVar("F")

_AT_ONCE = 1000
"""Maximum number of rows deleted at once."""


class Repository(Generic[R, F]):
    """Rows of one table as frozen dataclasses whose fields are columns of the same names.

    Each method commits before it returns, and may raise StoreFailed.
    """

    def __init__(self, database: Database, wall: Callable[[], float], row: type[R], fact: type[F]) -> None:
        """`wall` returns seconds since 1970 UTC."""
        self._database = database
        self._wall = wall
        self._table = row
        keys = inspect(row).primary_key
        self._key = keys[-1]
        self._own = len(keys) == 2 and keys[0].name == "bench"
        self._make = fact
        self._values = attrgetter(*(one.name for one in fields(fact)))  # pyright: ignore[reportArgumentType]

    def get(self, key: Any) -> F:
        """The row with this key, as a dataclass. Raises Unknown."""
        with self._database.reading() as session:
            return self._fact(self._row(session, key))

    def drop(self, key: Any) -> None:
        """Delete the row with this key. Raises Unknown."""
        with self._database.transaction() as session:
            session.delete(self._row(session, key))

    def _unknown(self, key: Any) -> Unknown:
        """The error for a key without a row."""
        raise NotImplementedError

    def _row(self, session: Session, key: Any) -> R:
        """The row with this key. Raises Unknown."""
        in_range = not isinstance(key, int) or 0 < key <= HIGHEST_ID
        row = session.get(self._table, self._identity(key)) if in_range else None
        if row is None:
            raise self._unknown(key)
        return row

    def _identity(self, key: Any) -> Any:
        """Primary key of a row: rows of a bench have its name, too."""
        return (self._database.bench, key) if self._own else key

    def _facts(self, query: Select[R]) -> list[F]:
        with self._database.reading() as session:
            return [self._fact(row) for row in session.scalars(query)]

    def _fact(self, row: R | Row[Any]) -> F:
        return self._make(*self._values(row))

    def _prune(
        self, session: Session | Connection, retain: int, newest: InstrumentedAttribute[Any], *of: ColumnElement[bool]
    ) -> None:
        """Delete the rows `of` beyond the newest `retain`."""
        beyond = select(self._key).where(*of).order_by(newest.desc()).offset(retain).limit(_AT_ONCE)
        old = session.scalars(beyond).all()
        if old:
            session.execute(delete(self._table).where(self._key.in_(old)))
