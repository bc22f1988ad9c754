"""Persistent node IDs by unique ID."""

from collections.abc import Callable, Collection
from dataclasses import dataclass

from sqlalchemy import Select, select, update

from hornbill.errors import InvalidValue, OutOfRange, Unknown
from hornbill.store.database import Database
from hornbill.store.repository import Repository, put, row_at
from hornbill.store.tables import ALLOCATIONS
from hornbill.units import NodeId, Uid

LOWEST, HIGHEST = 1, 125


@dataclass(frozen=True, slots=True)
class AllocationEntry:
    """One row. Instants: seconds since 1970 UTC, None for a pinned ID that its node has not requested yet."""

    uid: Uid
    node_id: NodeId
    pinned: bool
    first_seen: float | None
    last_seen: float | None


class AllocationStore(Repository[AllocationEntry]):
    """The allocation table, by unique ID. A node that was dropped counts as new at its next request."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, ALLOCATIONS, AllocationEntry)
        self._mine = ALLOCATIONS.c.bench == database.bench

    def rows(self) -> list[AllocationEntry]:
        """All rows, by node ID."""
        return self._facts(select(ALLOCATIONS).where(self._mine).order_by(ALLOCATIONS.c.node_id))

    def entries(self) -> dict[Uid, NodeId]:
        """Node IDs by unique ID."""
        with self._database.reading() as connection:
            found = connection.execute(select(ALLOCATIONS.c.uid, ALLOCATIONS.c.node_id).where(self._mine))
            return {Uid(uid): NodeId(node_id) for uid, node_id in found}

    def pinned(self, uid: Uid) -> bool:
        """Whether a user pinned this node's ID."""
        with self._database.reading() as connection:
            return bool(connection.scalar(select(ALLOCATIONS.c.pinned).where(self._mine, ALLOCATIONS.c.uid == uid)))

    def record(self, uid: Uid, node_id: NodeId) -> None:
        """Record an allocation. A pin of the same ID stays; a pin of another ID ends.

        Raises InvalidValue if the ID belongs to another node.
        """
        now = self._wall()
        with self._database.transaction() as connection:
            self._check_free(connection.scalar(self._owner(node_id)), uid, node_id)
            row = row_at(connection, ALLOCATIONS, *self._identity(uid))
            values = {
                "node_id": node_id,
                "pinned": row is not None and row["pinned"] and row["node_id"] == node_id,
                "first_seen": (row and row["first_seen"]) or now,
                "last_seen": now,
            }
            put(connection, ALLOCATIONS, self._identity(uid), values)

    def seen(self, uids: Collection[Uid]) -> None:
        """Record that these nodes are online now. Nodes without a row are ignored."""
        if uids:
            with self._database.transaction() as connection:
                connection.execute(
                    update(ALLOCATIONS).where(self._mine, ALLOCATIONS.c.uid.in_(uids)).values(last_seen=self._wall())
                )

    def idle(self, longer_than_s: float) -> list[Uid]:
        """Unpinned nodes not seen for more than `longer_than_s`, longest unseen first."""
        before = self._wall() - longer_than_s
        with self._database.reading() as connection:
            found = connection.scalars(
                select(ALLOCATIONS.c.uid)
                .where(self._mine, ALLOCATIONS.c.pinned.is_(False), ALLOCATIONS.c.last_seen < before)
                .order_by(ALLOCATIONS.c.last_seen)
            )
            return [Uid(uid) for uid in found]

    def pin(self, uid: Uid, node_id: NodeId) -> None:
        """Pin a node's ID, 1 to 125. It takes effect at the node's next request.

        Raises OutOfRange, and InvalidValue if the ID belongs to another node.
        """
        if not LOWEST <= node_id <= HIGHEST:
            raise OutOfRange(
                f"Node ID {node_id} cannot be allocated. Enter {LOWEST} to {HIGHEST}.",
                minimum=LOWEST,
                maximum=HIGHEST,
                unit="",
                requested=node_id,
                cause="node_id_out_of_range",
            )
        with self._database.transaction() as connection:
            self._check_free(connection.scalar(self._owner(node_id)), uid, node_id)
            put(connection, ALLOCATIONS, self._identity(uid), {"node_id": node_id, "pinned": True})

    @staticmethod
    def _check_free(owner: str | None, uid: Uid, node_id: NodeId) -> None:
        if owner not in (None, uid):
            raise InvalidValue(
                f"Node ID {node_id} is allocated to {owner}. Choose another, or forget that allocation first.",
                node_id=node_id,
                owner=owner,
                cause="node_id_reserved",
            )

    def _unknown(self, key: Uid) -> Unknown:
        return Unknown(
            "unknown_uid",
            f"No node ID is allocated to {key}. See the list of allocations.",
            uid=key,
            cause="allocation_not_found",
        )

    def _owner(self, node_id: NodeId) -> Select[str]:
        return select(ALLOCATIONS.c.uid).where(self._mine, ALLOCATIONS.c.node_id == node_id)
