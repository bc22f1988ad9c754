"""Node IDs by unique ID, kept for good."""

from collections.abc import Callable, Collection
from dataclasses import dataclass

from sqlalchemy import Select, select, update

from hornbill.errors import InvalidValue, OutOfRange, Unknown
from hornbill.store.database import Database
from hornbill.store.repository import Repository
from hornbill.store.tables import AllocationRow
from hornbill.units import NodeId, Uid

LOWEST, HIGHEST = 1, 125


@dataclass(frozen=True, slots=True)
class AllocationEntry:
    """One row; instants in seconds since 1970 (UTC), None for a pinned id its node has not asked for yet."""

    uid: Uid
    node_id: NodeId
    pinned: bool
    first_seen: float | None
    last_seen: float | None


class AllocationStore(Repository[AllocationRow, AllocationEntry]):
    """The allocation table, by unique id; a node that was dropped is new when it asks again."""

    def __init__(self, database: Database, wall: Callable[[], float]) -> None:
        super().__init__(database, wall, AllocationRow, AllocationEntry)

    def rows(self) -> list[AllocationEntry]:
        """The whole table, by node id."""
        return self._facts(select(AllocationRow).order_by(AllocationRow.node_id))

    def entries(self) -> dict[Uid, NodeId]:
        """Node ids by unique id."""
        with self._database.reading() as session:
            found = session.execute(select(AllocationRow.uid, AllocationRow.node_id))
            return {Uid(uid): NodeId(node_id) for uid, node_id in found}

    def pinned(self, uid: Uid) -> bool:
        """Whether a person chose this node's id."""
        with self._database.reading() as session:
            return bool(session.scalar(select(AllocationRow.pinned).where(AllocationRow.uid == uid)))

    def record(self, uid: Uid, node_id: NodeId) -> None:
        """Keep that a node was given an id now; a pin of the same id stays, one of another id ends.

        Raises InvalidValue when the id belongs to another node.
        """
        now = self._wall()
        with self._database.transaction() as session:
            self._demand_free(session.scalar(_owner(node_id)), uid, node_id)
            row = session.get(AllocationRow, uid)
            if row is None:
                session.add(AllocationRow(uid=uid, node_id=node_id, pinned=False, first_seen=now, last_seen=now))
                return
            row.pinned = row.pinned and row.node_id == node_id
            row.node_id = node_id
            row.first_seen = row.first_seen or now
            row.last_seen = now

    def seen(self, uids: Collection[Uid]) -> None:
        """Keep that these nodes are there now; those without a row are passed over."""
        if uids:
            with self._database.transaction() as session:
                session.execute(update(AllocationRow).where(AllocationRow.uid.in_(uids)).values(last_seen=self._wall()))

    def idle(self, longer_than_s: float) -> list[Uid]:
        """Nodes without a pin that were last seen longer than so many seconds ago, the longest unseen first."""
        before = self._wall() - longer_than_s
        with self._database.reading() as session:
            found = session.scalars(
                select(AllocationRow.uid)
                .where(AllocationRow.pinned.is_(False), AllocationRow.last_seen < before)
                .order_by(AllocationRow.last_seen)
            )
            return [Uid(uid) for uid in found]

    def pin(self, uid: Uid, node_id: NodeId) -> None:
        """Choose a node's id, 1..125; it takes effect when the node asks the next time.

        Raises OutOfRange, and InvalidValue when the id belongs to another node.
        """
        if not LOWEST <= node_id <= HIGHEST:
            raise OutOfRange(
                f"Node id {node_id} is outside what can be given. Enter {LOWEST} to {HIGHEST}.",
                minimum=LOWEST,
                maximum=HIGHEST,
                unit="",
                requested=node_id,
                cause="node_id_out_of_range",
            )
        with self._database.transaction() as session:
            self._demand_free(session.scalar(_owner(node_id)), uid, node_id)
            row = session.get(AllocationRow, uid)
            if row is None:
                session.add(AllocationRow(uid=uid, node_id=node_id, pinned=True, first_seen=None, last_seen=None))
            else:
                row.node_id, row.pinned = node_id, True

    @staticmethod
    def _demand_free(owner: str | None, uid: Uid, node_id: NodeId) -> None:
        if owner not in (None, uid):
            raise InvalidValue(
                f"Node id {node_id} belongs to {owner}. Choose another, or forget that allocation first.",
                node_id=node_id,
                owner=owner,
                cause="node_id_of_another",
            )

    def _unknown(self, key: Uid) -> Unknown:
        return Unknown(
            "unknown_uid",
            f"No node id is kept for {key}. See the list of allocations.",
            uid=key,
            cause="no_such_allocation",
        )


def _owner(node_id: NodeId) -> Select[str]:
    return select(AllocationRow.uid).where(AllocationRow.node_id == node_id)
