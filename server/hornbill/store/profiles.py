"""Stored profiles, as JSON documents."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sqlalchemy import select

from hornbill.errors import Unknown
from hornbill.store.database import Database
from hornbill.store.repository import Repository, put
from hornbill.store.tables import PROFILES, Json


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


class ProfileTable(Repository[StoredProfile]):
    """Profiles by name, 1 to 80 characters."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, PROFILES, StoredProfile)

    def all(self) -> list[StoredProfile]:
        """All profiles, sorted by name."""
        # sorted here because the collation depends on the database
        return sorted(self._facts(select(PROFILES)), key=lambda one: one.name)

    def put(self, name: str, document: Mapping[str, Json]) -> StoredProfile:
        """Store a profile. Replaces one with the same name."""
        now = self._wall()
        with self._database.transaction() as connection:
            values = {"document": dict(document), "updated_at": now, "bench": self._database.bench}
            put(connection, PROFILES, (name,), values, created_at=now)
            return self._fact(self._row(connection, name))

    def _unknown(self, key: str) -> Unknown:
        return Unknown(
            "unknown_profile",
            f'Unknown profile "{key[:80]}".',
            cause="profile_not_found",
            name=key[:80],
        )
