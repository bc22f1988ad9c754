"""Stored profiles, as JSON documents."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sqlalchemy import select

from hornbill.errors import Unknown
from hornbill.store.database import Database
from hornbill.store.repository import Repository
from hornbill.store.tables import Json, ProfileRow


@dataclass(frozen=True, slots=True)
class StoredProfile:
    """One profile. Instants: seconds since 1970 UTC. The servo layer interprets `document`.

    `bench`: where it was last changed.
    """

    name: str
    document: Mapping[str, Json]
    created_at: float
    updated_at: float
    bench: str | None = None


class ProfileTable(Repository[ProfileRow, StoredProfile]):
    """Profiles by name, 1 to 80 characters."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, ProfileRow, StoredProfile)

    def all(self) -> list[StoredProfile]:
        """All profiles, sorted by name."""
        # sorted here because the collation depends on the database
        return sorted(self._facts(select(ProfileRow)), key=lambda one: one.name)

    def put(self, name: str, document: Mapping[str, Json]) -> StoredProfile:
        """Store a profile. Replaces one with the same name."""
        now = self._wall()
        with self._database.transaction() as session:
            row = session.get(ProfileRow, name)
            if row is None:
                row = ProfileRow(name=name, document=dict(document), created_at=now, updated_at=now)
                session.add(row)
            else:
                row.document, row.updated_at = dict(document), now
            row.bench = self._database.bench
            return self._fact(row)

    def _unknown(self, key: str) -> Unknown:
        return Unknown(
            "unknown_profile",
            f'Unknown profile "{key[:80]}".',
            cause="profile_not_found",
            name=key[:80],
        )
