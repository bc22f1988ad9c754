"""Named sets of values, kept as the document their file would have."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sqlalchemy import select

from hornbill.errors import Unknown
from hornbill.store.database import Database
from hornbill.store.tables import Json, ProfileRow


@dataclass(frozen=True, slots=True)
class StoredProfile:
    """One profile; instants in seconds since 1970 (UTC). What `document` means is the servo layer's business."""

    name: str
    document: Mapping[str, Json]
    created_at: float
    updated_at: float


class ProfileTable:
    """Profiles by name, 1..80 characters. Every method has been committed when it returns."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        """`wall` gives seconds since 1970 (UTC)."""
        self._database = database
        self._wall = wall

    def all(self) -> list[StoredProfile]:
        """Every profile, by name."""
        with self._database.reading() as session:
            # sorted here: every database has its own idea of the order of words
            return sorted((_profile(row) for row in session.scalars(select(ProfileRow))), key=lambda one: one.name)

    def get(self, name: str) -> StoredProfile:
        """One profile. Raises Unknown (unknown_profile)."""
        with self._database.reading() as session:
            row = session.get(ProfileRow, name)
            if row is None:
                raise _unknown(name)
            return _profile(row)

    def put(self, name: str, document: Mapping[str, Json]) -> StoredProfile:
        """Keep a profile; one of the same name is replaced."""
        now = self._wall()
        with self._database.transaction() as session:
            row = session.get(ProfileRow, name)
            if row is None:
                row = ProfileRow(name=name, document=dict(document), created_at=now, updated_at=now)
                session.add(row)
            else:
                row.document, row.updated_at = dict(document), now
            return _profile(row)

    def drop(self, name: str) -> None:
        """Forget one. Raises Unknown (unknown_profile)."""
        with self._database.transaction() as session:
            row = session.get(ProfileRow, name)
            if row is None:
                raise _unknown(name)
            session.delete(row)


def _unknown(name: str) -> Unknown:
    return Unknown(
        "unknown_profile",
        f'There is no profile "{name[:80]}".',
        request="GET /api/v1/profiles lists them.",
        cause="no_such_profile",
        name=name[:80],
    )


def _profile(row: ProfileRow) -> StoredProfile:
    return StoredProfile(row.name, dict(row.document), row.created_at, row.updated_at)
