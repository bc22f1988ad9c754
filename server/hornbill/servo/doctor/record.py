"""Facts that the doctor collects about one connection, updated by hooks and the host's tick."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

from hornbill.node.allocator import Allocator
from hornbill.node.directory import Directory
from hornbill.node.participant import Participant
from hornbill.node.programs import by_commands, by_name
from hornbill.servo.device.servo import Servo
from hornbill.servo.doctor.counts import CounterHistory, Sample, sample
from hornbill.servo.doctor.watch import NodeWatch
from hornbill.units import Instant, NodeId, Uid
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorStatus, AllocationMessage, ArrayCommand, NodeStatus
from hornbill.wire.port import REPLAYS, CanPort, PortState
from hornbill.wire.services import GetNodeInfoRequest, GetSetRequest
from hornbill.wire.transfer import END, START, Transfer

BUS_OFF_REMEMBERED_S: Final = 30.0

COMMANDING_S: Final = 5.0
"""Time after its last ArrayCommand that a node counts as commanding servos."""

HERE_S: Final = 3.0
"""A node not seen for this long is gone (three missing NodeStatus, table 2-2)."""

_WORKING: Final = frozenset((PortState.ACTIVE, PortState.PASSIVE, PortState.BUS_OFF))
_SESSION: Final = 0x00FF_FF80
"""Type, direction, destination and the service flag of an identifier."""


@dataclass(slots=True)
class Grant:
    """Allocations of a node ID to a node since no node was seen on it."""

    uid: Uid
    times: int
    last: Instant


@dataclass(slots=True)
class Commander:
    """ArrayCommands of another node without a pause of COMMANDING_S: start, number, and servo IDs."""

    since: Instant
    messages: int = 0
    last: Instant = 0.0
    servo_ids: dict[int, Instant] = field(default_factory=dict[int, Instant])
    """Time of the last command to each servo ID."""


class Record:
    """One connection: counters, silence, nodes, grants. Bounded in size. Sends nothing."""

    def __init__(
        self,
        port: CanPort,
        participant: Participant,
        allocator: Allocator,
        directory: Directory,
        servos: Callable[[], Sequence[Servo]],
        now: Instant,
    ) -> None:
        self.port = port
        self.directory = directory
        self.participant = participant
        self.allocator = allocator
        self.since = now
        self.last_frame_at: Instant | None = None
        """Time of the last received frame."""
        self.counts = CounterHistory(self._sample(now))
        self.at_last_frame = self.counts.latest
        """Counters at the last received frame, or at the start."""
        self.bus_offs: int = port.statistics.bus_offs
        self.bus_off_at: Instant | None = None
        """Time of the last bus-off."""
        self.opened = not self.down
        """Whether the adapter has ever worked."""
        self.down_since: Instant | None = None
        """Start of the present failure of the adapter. None while it works."""
        self.nodes: dict[int, NodeWatch] = {}
        self.grants: dict[int, Grant] = {}
        self.commanders: dict[int, Commander] = {}
        """Other nodes that commanded servos, by node ID."""
        self.allocation_at: Instant | None = None
        """Time of the last Allocation message from another node."""
        self.seen: set[Uid] = set()
        """Servos that were online on this connection."""
        self._servos = servos
        self._requests = {GetSetRequest.TYPE.id: True, GetNodeInfoRequest.TYPE.id: False}
        to_us = participant.node_id << 8 | 0x80
        self._responses = {type_id << 16 | to_us: is_register for type_id, is_register in self._requests.items()}
        participant.subscribe(NodeStatus, self._on_node_status)
        participant.subscribe(ActuatorStatus, self._on_status)
        participant.subscribe(AllocationMessage, self._on_allocation)
        participant.subscribe(ArrayCommand, self._on_array_command)
        participant.on_frames.append(self._on_frames)
        participant.on_round_trip.append(self._on_round_trip)
        allocator.on_granted.append(self._on_granted)

    @property
    def now(self) -> Instant:
        """Instant of the last sample."""
        return self.counts.latest.at

    @property
    def silence_s(self) -> float:
        """Time since the last received frame, or since the start, s."""
        return self.now - (self.since if self.last_frame_at is None else self.last_frame_at)

    @property
    def since_last_frame(self) -> Sample:
        """Increase of the counters since the last received frame."""
        return self.counts.latest.since(self.at_last_frame)

    @property
    def down(self) -> bool:
        """Whether the adapter does not work now."""
        return self.port.state not in _WORKING

    @property
    def was_off(self) -> bool:
        """Whether the controller is or recently was bus-off."""
        return self.bus_off_at is not None and self.now - self.bus_off_at < BUS_OFF_REMEMBERED_S

    @property
    def passive(self) -> bool:
        """Whether the controller is error-passive. A port that has never received a frame only shows as passive."""
        return self.port.state is PortState.PASSIVE and not self.port.details.nothing_received

    @property
    def recorded(self) -> bool:
        """Whether this is a replay of a log or a recording."""
        return self.port.address.startswith(REPLAYS)

    def tick(self, now: Instant) -> None:
        """Sample the counters. Call it several times a second."""
        before, port = self.counts.latest, self.port
        self.counts.take(self._sample(now))
        if self.counts.latest.rx_frames != before.rx_frames:
            self.last_frame_at, self.at_last_frame = now, self.counts.latest
        if port.statistics.bus_offs > self.bus_offs or port.state is PortState.BUS_OFF:
            self.bus_offs, self.bus_off_at = port.statistics.bus_offs, now
        if not self.down:
            self.opened, self.down_since = True, None
        elif self.down_since is None:
            self.down_since = now
        self.seen.update(one.uid for one in self._servos() if one.online)

    def here(self) -> dict[int, NodeWatch]:
        """Nodes seen recently, by node ID."""
        limit = self.now - HERE_S
        return {node_id: self.nodes[node_id] for node_id in sorted(self.nodes) if self.nodes[node_id].last_seen > limit}

    def commanding(self) -> dict[int, Commander]:
        """Other nodes that command servos now, by node ID."""
        return {node_id: one for node_id, one in self.commanders.items() if self.now - one.last < COMMANDING_S}

    def program(self, node_id: int) -> str | None:
        """Program of another node, derived from its name and its commands. None if unknown."""
        known, commander = self.directory.records.get(node_id), self.commanders.get(node_id)
        found = by_name(None if known is None or known.info is None else known.info.name)
        return found or (None if commander is None else by_commands(node_id, commander.servo_ids))

    def servos(self) -> list[Servo]:
        """Servos that were online on this connection, whether online now or not."""
        return [one for one in self._servos() if one.uid in self.seen]

    def servo(self, node_id: int) -> Servo | None:
        """The servo known to be on a node ID."""
        return next((one for one in self._servos() if one.node_id == node_id), None)

    def name(self, node_id: int) -> str:
        """Name of a node in a sentence."""
        servo = self.servo(node_id)
        return f"node {node_id}" if servo is None else f"{servo.title} (node {node_id})"

    def title(self, node_id: int) -> str | None:
        """Title of the servo known to be on a node ID."""
        servo = self.servo(node_id)
        return None if servo is None else servo.title

    def uids(self, *node_ids: int) -> tuple[str, ...]:
        """Unique IDs of the servos known to be on these node IDs."""
        found = (self.servo(each) for each in node_ids)
        return tuple(one.uid for one in found if one is not None)

    def _sample(self, now: Instant) -> Sample:
        return sample(self.port.statistics, self.participant.request_counters, now)

    def _node(self, node_id: int) -> NodeWatch:
        found = self.nodes.get(node_id)
        if found is None:
            found = self.nodes[node_id] = NodeWatch()
        return found

    def _on_node_status(self, transfer: Transfer, status: NodeStatus) -> None:
        if transfer.source:
            self._node(transfer.source).on_node_status(transfer.transfer_id, status.uptime_sec, transfer.at)
            self.grants.pop(transfer.source, None)

    def _on_status(self, transfer: Transfer, status: ActuatorStatus) -> None:
        if transfer.source:
            self._node(transfer.source).on_status(transfer.transfer_id, status.actuator_id, transfer.at)

    def _on_allocation(self, transfer: Transfer, _message: AllocationMessage) -> None:
        self.allocation_at = transfer.at

    def _on_array_command(self, transfer: Transfer, message: ArrayCommand) -> None:
        if not transfer.source:
            return
        known = self.commanders.get(transfer.source)
        if known is None or transfer.at - known.last > COMMANDING_S:
            known = self.commanders[transfer.source] = Commander(transfer.at)
        known.messages += 1
        known.last = transfer.at
        for command in message.commands:
            known.servo_ids[command.actuator_id] = transfer.at

    def _on_granted(self, uid: Uid, node_id: NodeId) -> None:
        before = self.grants.get(node_id)
        times = before.times + 1 if before is not None and before.uid == uid else 1
        self.grants[node_id] = Grant(uid, times, self.participant.clock())

    def _on_round_trip(self, node_id: int, seconds: float) -> None:
        self._node(node_id).round_trips.append((self.participant.clock(), seconds))

    def _on_frames(self, frames: Sequence[Frame], sent: bool) -> None:
        """Match requests and responses by their first and last frames."""
        if sent:
            for can_id, data, at in frames:
                is_register = self._requests.get(can_id >> 16 & 0xFF)
                if is_register is not None and can_id & 0x8080 == 0x8080 and data[-1] & START:
                    node = self._node(can_id >> 8 & 0x7F)
                    (node.registers if is_register else node.info).on_request(data[-1] & 31, at)
            return
        responses = self._responses
        for can_id, data, _ in frames:
            if can_id & _SESSION in responses and data and data[-1] & END:
                node = self._node(can_id & 0x7F)
                (node.registers if responses[can_id & _SESSION] else node.info).on_response(data[-1] & 31)
