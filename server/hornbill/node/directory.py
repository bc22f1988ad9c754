"""Owns Directory: what every other node last said of itself, and whether it is still there."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from hornbill.node.hooks import Hooks
from hornbill.node.participant import Participant
from hornbill.units import Instant
from hornbill.wire.messages import NodeStatus
from hornbill.wire.transfer import Transfer

OFFLINE_AFTER_S: Final = 3.0
"""A node that has not said NodeStatus for this long is gone (three missed, table 2-2)."""

_UPTIME_SLACK_S: Final = 2.0
"""What whole seconds, late frames and a slow crystal can explain between two uptimes."""


@dataclass(slots=True)
class NodeRecord:
    """One node id. `heard` and `first_heard` are instants of NodeStatus; `restarts` counts those we saw.

    `leaps` counts uptimes further ahead than time has passed: two nodes that share an id make restarts and
    leaps in turn. `unique_id` is what GetNodeInfo last told; it is forgotten when the node may be another.
    """

    node_id: int
    status: NodeStatus
    heard: Instant
    first_heard: Instant
    restarts: int = 0
    leaps: int = 0
    unique_id: bytes | None = None

    def online(self, now: Instant) -> bool:
        """Whether NodeStatus came within OFFLINE_AFTER_S before `now`."""
        return now - self.heard < OFFLINE_AFTER_S


class Directory:
    """Records by node id. A record stays when its node falls silent, until `forget`."""

    def __init__(self) -> None:
        self.records: dict[int, NodeRecord] = {}
        self.on_appeared: Hooks[NodeRecord] = Hooks()
        """Called for a node id heard for the first time, or again after it was offline."""
        self.on_restarted: Hooks[NodeRecord] = Hooks()
        """Called when an uptime went back: the node started anew, or another took its id (B18)."""
        self._traffic: dict[int, Instant] = {}

    def follow(self, participant: Participant) -> Callable[[], None]:
        """Hear every NodeStatus the participant hears, and know its other traffic; returns what ends it."""
        self._traffic = participant.heard
        return participant.subscribe(NodeStatus, self._hear_transfer)

    def hear(self, node_id: int, status: NodeStatus, now: Instant) -> None:
        """Take one NodeStatus of node 1..127."""
        record = self.records.get(node_id)
        if record is None:
            record = self.records[node_id] = NodeRecord(node_id, status, now, now)
            self.on_appeared.tell(record)
            return
        was_online = record.online(now)
        expected = record.status.uptime_sec + now - record.heard
        went_back = status.uptime_sec < record.status.uptime_sec
        restarted = went_back or status.uptime_sec < expected - _UPTIME_SLACK_S
        leapt = status.uptime_sec > expected + _UPTIME_SLACK_S
        record.status = status
        record.heard = now
        record.restarts += restarted
        record.leaps += leapt
        if restarted or leapt:
            record.unique_id = None
        if restarted:
            self.on_restarted.tell(record)
        if not was_online:
            self.on_appeared.tell(record)

    def identify(self, node_id: int, unique_id: bytes) -> None:
        """Keep what a node said in GetNodeInfo; without a record of it nothing happens."""
        record = self.records.get(node_id)
        if record is not None:
            record.unique_id = unique_id

    def online(self, now: Instant) -> list[NodeRecord]:
        """The nodes that are there, by node id."""
        return [record for _, record in sorted(self.records.items()) if record.online(now)]

    def forget(self, node_id: int) -> None:
        """Drop a record; the node appears anew when it is heard again."""
        self.records.pop(node_id, None)
        self._traffic.pop(node_id, None)

    # What the allocator asks (its Residents).

    def known(self) -> set[int]:
        """Node ids anything was ever heard from. Those that are silent now may only be switched off."""
        return {*self.records, *self._traffic}

    def occupied(self, now: Instant) -> set[int]:
        """Node ids anything was heard from within OFFLINE_AFTER_S before `now`."""
        heard = ((node_id, self.last_heard(node_id)) for node_id in self.known())
        return {node_id for node_id, last in heard if last is not None and now - last < OFFLINE_AFTER_S}

    def resident(self, node_id: int) -> bytes | None:
        """The unique id last known to live at a node id, or None."""
        record = self.records.get(node_id)
        return None if record is None else record.unique_id

    def last_heard(self, node_id: int) -> Instant | None:
        """When anything last came from a node id, or None."""
        record = self.records.get(node_id)
        heard = self._traffic.get(node_id)
        if record is None or (heard is not None and heard > record.heard):
            return heard
        return record.heard

    def _hear_transfer(self, transfer: Transfer, status: NodeStatus) -> None:
        if transfer.source:
            self.hear(transfer.source, status, transfer.at)
