"""Last known state of every other node, and whether it is online."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

from hornbill.node.hooks import Hooks
from hornbill.node.participant import Participant
from hornbill.units import Instant
from hornbill.wire.messages import AllocationMessage, NodeStatus
from hornbill.wire.services import GetNodeInfoResponse
from hornbill.wire.transfer import Transfer

OFFLINE_AFTER_S: Final = 3.0
"""A node is offline when nothing was received from it for this long: three NodeStatus missed (table 2-2)."""

_STALE_S: Final = 1.5
"""How long after reception was restored a node may still send frames it had queued before."""

_UPTIME_SLACK_S: Final = 2.0
"""Tolerance between two uptimes for rounding to seconds, late frames and a slow crystal."""


@dataclass(slots=True)
class NodeRecord:
    """State of one node ID. `status_at` and `first_seen` are the times of the last and first NodeStatus.

    `restarts` counts observed restarts, `leaps` uptimes that advanced faster than time: two nodes that share an ID
    cause both alternately. `info` is the last GetNodeInfo response; it is discarded when the node may be another.
    """

    node_id: int
    status: NodeStatus
    status_at: Instant
    first_seen: Instant
    restarts: int = 0
    leaps: int = 0
    info: GetNodeInfoResponse | None = None

    @property
    def unique_id(self) -> bytes | None:
        """The 16 bytes of GetNodeInfo. None if not known yet."""
        return None if self.info is None else self.info.hardware_version.unique_id

    @property
    def boot_count(self) -> int:
        """Number of restarts and leaps. A change means that the node may be another."""
        return self.restarts + self.leaps


class Directory:
    """Records by node ID. The record of an offline node is retained until `forget`."""

    def __init__(self, remembered: Iterable[int] = ()) -> None:
        """`remembered` are the IDs of nodes seen in earlier sessions, which may be switched off."""
        self.records: dict[int, NodeRecord] = {}
        self.anonymous_seen: Instant | None = None
        """Time of the last request of a node without an ID."""
        self.on_restarted: Hooks[NodeRecord] = Hooks()
        """Called when an uptime went back: the node restarted, or another took its ID (B18)."""
        self._remembered = frozenset(remembered)
        self._traffic: dict[int, Instant] = {}
        self._stale_until: Instant = float("-inf")

    def follow(self, participant: Participant) -> Callable[[], None]:
        """Track the NodeStatus messages and other traffic a participant receives. Returns a function that stops it."""
        self._traffic = participant.last_seen
        unsubscribe = (
            participant.subscribe(NodeStatus, self._on_status),
            participant.subscribe(AllocationMessage, self._on_allocation),
        )

        def end() -> None:
            for each in unsubscribe:
                each()

        return end

    def record_status(self, node_id: int, status: NodeStatus, now: Instant) -> None:
        """Process one NodeStatus of node 1..127."""
        record = self.records.get(node_id)
        if record is None:
            self.records[node_id] = NodeRecord(node_id, status, now, now)
            return
        expected = record.status.uptime_sec + now - record.status_at
        went_back = status.uptime_sec < record.status.uptime_sec
        restarted = went_back or status.uptime_sec < expected - _UPTIME_SLACK_S
        if restarted and not went_back and now < self._stale_until:
            return
        leapt = status.uptime_sec > expected + _UPTIME_SLACK_S
        record.status = status
        record.status_at = now
        record.restarts += restarted
        record.leaps += leapt
        if restarted or leapt:
            record.info = None
        if restarted:
            self.on_restarted.notify(record)

    def reception_lost(self) -> None:
        """The bus cannot be received. Call `reception_restored` when it can.

        An uptime received soon after that is no proof of a restart: the frame may be an old one that no node had
        acknowledged. If the node did restart, its next NodeStatus proves it.
        """
        self._stale_until = float("inf")

    def reception_restored(self, now: Instant) -> None:
        """The bus can be received again since shortly before `now`."""
        self._stale_until = now + _STALE_S

    def identify(self, node_id: int, info: GetNodeInfoResponse) -> None:
        """Store the GetNodeInfo response of a node. No effect if the node has no record."""
        record = self.records.get(node_id)
        if record is not None:
            record.info = info

    def is_online(self, node_id: int, now: Instant) -> bool:
        """Whether anything was received from a node ID within OFFLINE_AFTER_S before `now`."""
        last = self.last_seen(node_id)
        return last is not None and now - last < OFFLINE_AFTER_S

    def online(self, now: Instant) -> list[NodeRecord]:
        """Online nodes that have sent NodeStatus, by node ID."""
        return [record for node_id, record in sorted(self.records.items()) if self.is_online(node_id, now)]

    def forget(self, node_id: int) -> None:
        """Delete a record. It is created again with the next message of the node."""
        self.records.pop(node_id, None)
        self._traffic.pop(node_id, None)

    # The allocator's KnownNodes.

    def known(self) -> set[int]:
        """Node IDs remembered or ever seen. Silent nodes may be switched off."""
        return {*self._remembered, *self.records, *self._traffic}

    def seen(self) -> set[int]:
        """Node IDs seen on this bus."""
        return {*self.records, *self._traffic}

    def occupied(self, now: Instant) -> set[int]:
        """Node IDs seen within OFFLINE_AFTER_S before `now`."""
        return {node_id for node_id in self.seen() if self.is_online(node_id, now)}

    def unique_id_at(self, node_id: int) -> bytes | None:
        """Last known unique ID of the node at a node ID. None if unknown."""
        record = self.records.get(node_id)
        return None if record is None else record.unique_id

    def node_id_of(self, unique_id: bytes) -> int | None:
        """Node ID at which a unique ID was last seen. None if never."""
        found = [record for record in self.records.values() if record.unique_id == unique_id]
        return max(found, key=lambda record: record.status_at).node_id if found else None

    def last_seen(self, node_id: int) -> Instant | None:
        """Time of the last transfer from a node ID. None if never seen."""
        record = self.records.get(node_id)
        at = self._traffic.get(node_id)
        if record is None or (at is not None and at > record.status_at):
            return at
        return record.status_at

    def _on_status(self, transfer: Transfer, status: NodeStatus) -> None:
        if transfer.source:
            self.record_status(transfer.source, status, transfer.at)

    def _on_allocation(self, transfer: Transfer, _message: AllocationMessage) -> None:
        if not transfer.source:
            self.anonymous_seen = transfer.at
