"""SimNode: a servo on the bus: its node ID and how it gets one, what it receives and sends."""

from collections import deque
from collections.abc import Sequence
from random import Random
from typing import Final

from hornbill.sim.allocation import Allocatee
from hornbill.sim.mechanics.conditions import Conditions
from hornbill.sim.services import Answer
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

_ALLOCATION: Final = AllocationMessage.TYPE.id
_ARRAY_COMMAND: Final = ArrayCommand.TYPE.id


class SimNode:
    """Frames in and out of one servo. Without a node id only Allocation passes, either way (2.3)."""

    def __init__(self, uid: bytes, random: Random, conditions: Conditions) -> None:
        self.node_id = _ANONYMOUS
        self._random = random
        self._conditions = conditions
        self._allocatee = Allocatee(uid, random)
        self._reassembler = Reassembler()
        self._transfer_ids: dict[int, int] = {}
        self._outbox: list[Frame] = []
        self._late: deque[tuple[Instant, list[Frame]]] = deque()

    @property
    def due(self) -> Instant:
        """When to ask for a node id or to give a late answer next; infinity when there is neither."""
        return min(self._allocatee.due, self._late[0][0]) if self._late else self._allocatee.due

    def join(self, node_id: NodeId, now: Instant) -> None:
        """Come up with a node id of its own (0x46), or begin to ask for one where that is 0."""
        self.node_id = node_id
        if not node_id:
            self._allocatee.begin(now)

    def leave(self) -> None:
        """Lose the node id, transfer ids and what was half received. What was sent already still goes out."""
        self.node_id = _ANONYMOUS
        self._late.clear()
        self._allocatee.stop()
        self._reassembler = Reassembler()
        self._transfer_ids = {}

    def mine(self, frames: Sequence[Frame]) -> list[Frame]:
        """Those of `frames` a servo's acceptance filter lets in: most of a busy bus is not for it."""
        node_id = self.node_id
        found: list[Frame] = []
        for frame in frames:
            can_id = frame[0]
            if can_id & 0x80:
                if node_id and can_id >> 8 & 0xFF == node_id | 0x80:
                    found.append(frame)
            elif can_id & 0x7F:
                type_id = can_id >> 8 & 0xFFFF
                if type_id == (_ARRAY_COMMAND if node_id else _ALLOCATION):
                    found.append(frame)
            elif not node_id and can_id >> 8 & 3 == _ALLOCATION:
                found.append(frame)
        return found

    def reassemble(self, frames: Sequence[Frame], now: Instant) -> list[Transfer]:
        """The transfers that accepted frames complete."""
        return self._reassembler.feed(frames, now)

    def live(self, now: Instant) -> None:
        """Send what is due: late answers, and the request for a node id."""
        while self._late and self._late[0][0] <= now:
            self._outbox += self._late.popleft()[1]
        if self._allocatee.due <= now:
            self.broadcast(self._allocatee.fire(now))

    def hear(self, message: AllocationMessage, source: int, now: Instant) -> bool:
        """Take an Allocation message of another node; True when it gave us our node id."""
        node_id = self._allocatee.hear(message, source, now)
        if node_id is None:
            return False
        self.node_id = node_id
        return True

    def broadcast(self, message: NodeStatus | ActuatorStatus | AllocationMessage) -> None:
        """Put a message into the outbox, with the priorities of table 2-2."""
        data_type = message.TYPE
        transfer_id = self._transfer_ids.get(data_type.id, 0)
        self._transfer_ids[data_type.id] = (transfer_id + 1) & 31
        asking = isinstance(message, AllocationMessage)
        transfer = Transfer(
            Kind.MESSAGE, data_type.id, self.node_id, 0,
            _ALLOCATION_PRIORITY if asking else _PRIORITY, transfer_id, message.encode(),
        )  # fmt: skip
        discriminator = self._random.getrandbits(_DISCRIMINATOR_BITS) if asking else None
        self._outbox += split(transfer, data_type, discriminator=discriminator)

    def answer(self, request: Transfer, answer: Answer, now: Instant) -> None:
        """Send the answer to a request, at the priority of the request, when it has been thought over.

        An answer that is to be lost is not sent. Later answers never overtake earlier ones.
        """
        loss = self._conditions.drop_responses_pct
        if loss and self._random.random() * 100.0 < loss:
            return
        transfer = Transfer(
            Kind.RESPONSE, request.type_id, self.node_id, request.source,
            request.priority, request.transfer_id, answer.encode(),
        )  # fmt: skip
        frames = split(transfer, answer.TYPE)
        delay = self._conditions.answer_delay_s
        if delay > 0.0 or self._late:
            self._late.append((max(now + delay, self._late[-1][0] if self._late else now), frames))
        else:
            self._outbox += frames

    def take_outbox(self) -> list[Frame]:
        """What is to be sent, in order; nothing while the servo is mute."""
        frames, self._outbox = self._outbox, []
        return [] if self._conditions.mute else frames
