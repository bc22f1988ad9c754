"""SimNode: bus connection of a servo: node ID and allocation, reception and transmission."""

from collections import deque
from collections.abc import Sequence
from random import Random
from typing import Final

from hornbill.sim.allocation import Allocatee
from hornbill.sim.mechanics.conditions import Conditions
from hornbill.sim.services import Response
from hornbill.units import Instant, NodeId
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorStatus, AllocationMessage, ArrayCommand, NodeStatus
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.transfer import Transfer, split

_PRIORITY: Final = 16
_ALLOCATION_PRIORITY: Final = 24
_ANONYMOUS: Final = NodeId(0)
_DISCRIMINATOR_BITS: Final = 14

_SOURCE: Final = 0x7F
_SERVICE: Final = 0x80
_REQUEST: Final = 0x80
"""With the destination, in the second byte of a service's identifier."""
_TYPE: Final = 0xFFFF80
_DESTINATION: Final = 0xFF80
_ALLOCATION: Final = AllocationMessage.TYPE.id
_ARRAY_COMMAND: Final = ArrayCommand.TYPE.id << 8


class SimNode:
    """Frames of one servo. Without a node ID only Allocation passes in either direction (2.3)."""

    def __init__(self, uid: bytes, random: Random, conditions: Conditions) -> None:
        self.node_id = _ANONYMOUS
        self._random = random
        self._conditions = conditions
        self._allocatee = Allocatee(uid, random)
        self._reassembler = Reassembler()
        self._transfer_ids: dict[int, int] = {}
        self._outbox: list[Frame] = []
        self._delayed: deque[tuple[Instant, list[Frame]]] = deque()

    @property
    def due(self) -> Instant:
        """Time of the next node ID request or delayed response. Infinity if there is neither."""
        return min(self._allocatee.due, self._delayed[0][0]) if self._delayed else self._allocatee.due

    def join(self, node_id: NodeId, now: Instant) -> None:
        """Start with a fixed node ID (0x46), or request one if that is 0."""
        self.node_id = node_id
        if not node_id:
            self._allocatee.begin(now)

    def leave(self) -> None:
        """Discard the node ID, transfer IDs and incomplete transfers. Frames in the outbox are still sent."""
        self.node_id = _ANONYMOUS
        self._delayed.clear()
        self._allocatee.stop()
        self._reassembler = Reassembler()
        self._transfer_ids = {}

    def accept(self, frames: Sequence[Frame]) -> list[Frame]:
        """Acceptance filter: the `frames` relevant to this servo, few on a busy bus."""
        if not self.node_id:
            return [frame for frame in frames if _is_allocation(frame[0])]
        request = (self.node_id | _REQUEST) << 8 | _SERVICE
        found: list[Frame] = []
        for frame in frames:
            key = frame[0] & _TYPE
            if key == _ARRAY_COMMAND or key & _DESTINATION == request:
                found.append(frame)
        return found

    def reassemble(self, frames: Sequence[Frame], now: Instant) -> list[Transfer]:
        """Transfers completed by accepted frames."""
        return self._reassembler.feed(frames, now)

    def run_due(self, now: Instant) -> None:
        """Send due messages: delayed responses, and the node ID request."""
        while self._delayed and self._delayed[0][0] <= now:
            self._outbox += self._delayed.popleft()[1]
        if self._allocatee.due <= now:
            self.broadcast(self._allocatee.fire(now))

    def receive(self, message: AllocationMessage, source: int, now: Instant) -> bool:
        """Process an Allocation message of another node. True if it assigned our node ID."""
        node_id = self._allocatee.receive(message, source, now)
        if node_id is None:
            return False
        self.node_id = node_id
        return True

    def broadcast(self, message: NodeStatus | ActuatorStatus | AllocationMessage) -> None:
        """Queue a message with the priority of table 2-2."""
        data_type = message.TYPE
        transfer_id = self._transfer_ids.get(data_type.id, 0)
        self._transfer_ids[data_type.id] = (transfer_id + 1) & 31
        anonymous = isinstance(message, AllocationMessage)
        transfer = Transfer(
            Kind.MESSAGE, data_type.id, self.node_id, 0,
            _ALLOCATION_PRIORITY if anonymous else _PRIORITY, transfer_id, message.encode(),
        )  # fmt: skip
        discriminator = self._random.getrandbits(_DISCRIMINATOR_BITS) if anonymous else None
        self._outbox += split(transfer, data_type, discriminator=discriminator)

    def respond(self, request: Transfer, response: Response, now: Instant) -> None:
        """Queue the response to a request with its priority, after the configured delay.

        A response to be dropped is not sent. Later responses never overtake earlier ones.
        """
        loss = self._conditions.drop_responses_pct
        if loss and self._random.random() * 100.0 < loss:
            return
        transfer = Transfer(
            Kind.RESPONSE, request.type_id, self.node_id, request.source,
            request.priority, request.transfer_id, response.encode(),
        )  # fmt: skip
        frames = split(transfer, response.TYPE)
        delay = self._conditions.response_delay_s
        if delay > 0.0 or self._delayed:
            self._delayed.append((max(now + delay, self._delayed[-1][0] if self._delayed else now), frames))
        else:
            self._outbox += frames

    def take_outbox(self) -> list[Frame]:
        """Remove and return the frames to send, in order. Empty while the servo is mute."""
        frames, self._outbox = self._outbox, []
        return [] if self._conditions.mute else frames


def _is_allocation(can_id: int) -> bool:
    """Whether a frame is an Allocation message. One of an anonymous node has only the low two bits of its type."""
    if can_id & _SERVICE:
        return False
    return can_id >> 8 & 0xFFFF == _ALLOCATION if can_id & _SOURCE else can_id >> 8 & 3 == _ALLOCATION
