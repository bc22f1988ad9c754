"""Named sets of values, kept as the document their file would have."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sqlalchemy import select

from hornbill.errors import Unknown
from hornbill.store.database import Database
from hornbill.store.repository import Repository
from hornbill.store.tables import Json, ProfileRow


@dataclass(frozen=True, slots=True)
class StoredProfile:
    """One profile; instants in seconds since 1970 (UTC). What `document` means is the servo layer's business."""

    name: str
    document: Mapping[str, Json]
    created_at: float
    updated_at: float


class ProfileTable(Repository[ProfileRow, StoredProfile]):
    """Profiles by name, 1..80 characters."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, ProfileRow, StoredProfile)

    def all(self) -> list[StoredProfile]:
        """Every profile, by name."""
        # sorted here: every database has its own idea of the order of words
        return sorted(self._facts(select(ProfileRow)), key=lambda one: one.name)

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
            return self._fact(row)

    def _unknown(self, key: str) -> Unknown:
        return Unknown(
            "unknown_profile",
            f'There is no profile "{key[:80]}".',
            cause="no_such_profile",
            name=key[:80],
        )
