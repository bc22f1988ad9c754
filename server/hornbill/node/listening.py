"""Listen before joining a bus: who allocates node IDs, commands actuators, or is an autopilot. Sends nothing."""

import asyncio
from dataclasses import dataclass, field
from typing import Final

from hornbill.domain.note import Note
from hornbill.node.role import ConnectionRole
from hornbill.wire.frame import Frame
from hornbill.wire.messages import AllocationMessage, ArrayCommand
from hornbill.wire.port import CanPort

LISTEN_S: Final = 1.5
"""Longer than the period of NodeStatus, of allocation requests and of every message below."""

AUTOPILOT_MESSAGES: Final = frozenset({
    4,  # uavcan.protocol.GlobalTimeSync
    1030,  # uavcan.equipment.esc.RawCommand
    1062,  # uavcan.equipment.gnss.RTCMStream
    1080,  # uavcan.equipment.indication.BeepCommand
    1081,  # uavcan.equipment.indication.LightsCommand
    1100,  # uavcan.equipment.safety.ArmingStatus
    20007,  # ardupilot.indication.NotifyState
})  # fmt: skip
"""Data type IDs of messages that flight controllers broadcast and servos do not."""

_SERVICE: Final = 0x80


@dataclass(slots=True)
class Heard:
    """Node IDs of what was heard."""

    allocators: set[int] = field(default_factory=set[int])
    commanders: set[int] = field(default_factory=set[int])
    autopilots: set[int] = field(default_factory=set[int])

    def note(self, frame: Frame) -> None:
        """Note the sender of a frame, by its identifier alone."""
        source = frame.id & 0x7F
        if frame.id & _SERVICE or not source:
            return  # a service, or an anonymous message: a request for a node ID
        data_type = frame.id >> 8 & 0xFFFF
        if data_type == AllocationMessage.TYPE.id:
            self.allocators.add(source)
        elif data_type == ArrayCommand.TYPE.id:
            self.commanders.add(source)
        elif data_type in AUTOPILOT_MESSAGES:
            self.autopilots.add(source)

    @property
    def role(self) -> ConnectionRole:
        """Proposed role: guest if the bus has another allocator, a commander or an autopilot."""
        alone = not (self.allocators or self.commanders or self.autopilots)
        return ConnectionRole.HOST if alone else ConnectionRole.GUEST

    @property
    def reason(self) -> Note | None:
        """Why guest is proposed. None if host is."""
        for nodes, what, code in (
            (self.commanders, "commands servos", "commands"),
            (self.allocators, "allocates node IDs", "allocates"),
            (self.autopilots, "sends messages of an autopilot", "autopilot"),
        ):
            if nodes:
                node = min(nodes)
                return Note(f"Node {node} {what}.", "heard", {"node_id": node, "what": code})
        return None


async def listen(port: CanPort, for_s: float = LISTEN_S) -> Heard:
    """Listen on an open port for this time. Frames are not queued for a later listener."""
    heard = Heard()

    def sink(frames: list[Frame]) -> None:
        for frame in frames:
            heard.note(frame)

    port.listen(sink)
    await asyncio.sleep(for_s)
    return heard
