"""What every other node last said of itself, and whether it is still there."""

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
"""A node nothing was heard from for this long is gone: three NodeStatus missed, and everything else (table 2-2)."""

_STALE_S: Final = 1.5
"""How long after nothing could be heard a node may still say what it could not get rid of meanwhile."""

_UPTIME_SLACK_S: Final = 2.0
"""What whole seconds, late frames and a slow crystal can explain between two uptimes."""


@dataclass(slots=True)
class NodeRecord:
    """One node id. `heard` and `first_heard` are instants of NodeStatus; `restarts` counts those we saw.

    `leaps` counts uptimes further ahead than time has passed: two nodes that share an id make restarts and
    leaps in turn. `info` is what GetNodeInfo last told; it is forgotten when the node may be another.
    """

    node_id: int
    status: NodeStatus
    heard: Instant
    first_heard: Instant
    restarts: int = 0
    leaps: int = 0
    info: GetNodeInfoResponse | None = None

    @property
    def unique_id(self) -> bytes | None:
        """The 16 bytes of GetNodeInfo, or None while they are not known."""
        return None if self.info is None else self.info.hardware_version.unique_id

    @property
    def lives(self) -> int:
        """Changes whenever the node may be another than before."""
        return self.restarts + self.leaps


class Directory:
    """Records by node id. A record stays when its node falls silent, until `forget`."""

    def __init__(self, remembered: Iterable[int] = ()) -> None:
        """`remembered` are node ids that belong to nodes met in former times, and switched off perhaps."""
        self.records: dict[int, NodeRecord] = {}
        self.anonymous_heard: Instant | None = None
        """When a node without an id last asked for one."""
        self.on_restarted: Hooks[NodeRecord] = Hooks()
        """Called when an uptime went back: the node started anew, or another took its id (B18)."""
        self._remembered = frozenset(remembered)
        self._traffic: dict[int, Instant] = {}
        self._stale_until: Instant = float("-inf")

    def follow(self, participant: Participant) -> Callable[[], None]:
        """Hear every NodeStatus the participant hears, and know its other traffic; returns what ends it."""
        self._traffic = participant.heard
        leave = (
            participant.subscribe(NodeStatus, self._hear_transfer),
            participant.subscribe(AllocationMessage, self._hear_allocation),
        )

        def end() -> None:
            for each in leave:
                each()

        return end

    def hear(self, node_id: int, status: NodeStatus, now: Instant) -> None:
        """Take one NodeStatus of node 1..127."""
        record = self.records.get(node_id)
        if record is None:
            self.records[node_id] = NodeRecord(node_id, status, now, now)
            return
        expected = record.status.uptime_sec + now - record.heard
        went_back = status.uptime_sec < record.status.uptime_sec
        restarted = went_back or status.uptime_sec < expected - _UPTIME_SLACK_S
        if restarted and not went_back and now < self._stale_until:
            return
        leapt = status.uptime_sec > expected + _UPTIME_SLACK_S
        record.status = status
        record.heard = now
        record.restarts += restarted
        record.leaps += leapt
        if restarted or leapt:
            record.info = None
        if restarted:
            self.on_restarted.tell(record)

    def go_deaf(self) -> None:
        """From now on nothing can be heard. When it can again, an uptime heard soon after is no proof of a restart: it
        may be an old one, which nobody acknowledged; if there was a restart, the next one proves it.
        """
        self._stale_until = float("inf")

    def hear_again(self, now: Instant) -> None:
        """The bus can be heard again, since `now` or a little longer."""
        self._stale_until = now + _STALE_S

    def identify(self, node_id: int, info: GetNodeInfoResponse) -> None:
        """Keep what a node said in GetNodeInfo; without a record of it nothing happens."""
        record = self.records.get(node_id)
        if record is not None:
            record.info = info

    def is_online(self, node_id: int, now: Instant) -> bool:
        """Whether anything came from a node id within OFFLINE_AFTER_S before `now`."""
        last = self.last_heard(node_id)
        return last is not None and now - last < OFFLINE_AFTER_S

    def online(self, now: Instant) -> list[NodeRecord]:
        """The nodes that are there and said NodeStatus, by node id."""
        return [record for node_id, record in sorted(self.records.items()) if self.is_online(node_id, now)]

    def forget(self, node_id: int) -> None:
        """Drop a record; the node appears anew when it is heard again."""
        self.records.pop(node_id, None)
        self._traffic.pop(node_id, None)

    # What the allocator asks (its Residents).

    def known(self) -> set[int]:
        """Node ids remembered or ever heard from. Those that are silent now may only be switched off."""
        return {*self._remembered, *self.records, *self._traffic}

    def heard(self) -> set[int]:
        """Node ids anything was ever heard from on this bus."""
        return {*self.records, *self._traffic}

    def occupied(self, now: Instant) -> set[int]:
        """Node ids anything was heard from within OFFLINE_AFTER_S before `now`."""
        return {node_id for node_id in self.heard() if self.is_online(node_id, now)}

    def resident(self, node_id: int) -> bytes | None:
        """The unique id last known to live at a node id, or None."""
        record = self.records.get(node_id)
        return None if record is None else record.unique_id

    def home(self, unique_id: bytes) -> int | None:
        """The node id a unique id was last met at, or None."""
        found = [record for record in self.records.values() if record.unique_id == unique_id]
        return max(found, key=lambda record: record.heard).node_id if found else None

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

    def _hear_allocation(self, transfer: Transfer, _message: AllocationMessage) -> None:
        if not transfer.source:
            self.anonymous_heard = transfer.at
