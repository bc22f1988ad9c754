"""A node of the public Python stack that requests a node ID, which that stack does not implement."""

# The stack is dynamic and has no type hints.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false, reportAttributeAccessIssue=false

from random import Random
from typing import Any

from dronecan import transport

from socketcan.peer import Peer, uavcan

_REQUEST_S = (0.6, 1.0)
_FOLLOW_UP_S = (0.0, 0.4)
_PART_BYTES = 6


class Applicant(Peer):
    """Rules A to E of uavcan.protocol.dynamic_node_id.Allocation, with the stack's own message and transfer.

    `unique_id` has 16 bytes, `preferred` 0 is no preference. Once `node_id` is there it says NodeStatus like any node.
    """

    def __init__(self, unique_id: bytes, preferred: int = 0, *, name: str = "org.example.applicant") -> None:
        super().__init__(name=name, unique_id=unique_id)
        self.requests = 0
        self.said: list[tuple[int, int]] = []
        """Received responses: node ID of the allocator, number of echoed bytes."""
        self._unique_id = unique_id
        self._preferred = preferred
        self._random = Random(unique_id)
        self._transfer_id = 0
        self._alarm: Any = None
        self.node.add_handler(uavcan.protocol.dynamic_node_id.Allocation, self._receive)
        self._wait()  # rule A

    def _wait(self, offset: int = 0) -> None:
        """Send the part of the unique id at `offset` after the delay of its rule."""
        if self._alarm is not None:
            self._alarm.try_remove()
        delay = self._random.uniform(*(_FOLLOW_UP_S if offset else _REQUEST_S))
        self._alarm = self.node.defer(delay, lambda: self._send(offset))

    def _send(self, offset: int) -> None:
        if self.node_id:
            return
        message = uavcan.protocol.dynamic_node_id.Allocation()
        message.node_id = self._preferred
        message.first_part_of_unique_id = not offset
        message.unique_id.from_bytes(self._unique_id[offset : offset + _PART_BYTES])
        # The stack's own broadcast() cannot be anonymous; its Transfer and its driver can.
        sent = transport.Transfer(
            transfer_id=self._transfer_id, source_node_id=0, payload=message, transfer_priority=24,
            discriminator=self._random.getrandbits(14),
        )  # fmt: skip
        self._transfer_id = (self._transfer_id + 1) % 32
        for frame in sent.to_frames():
            self.node.can_driver.send(frame.message_id, frame.bytes, extended=True)
        self.requests += not offset
        self._wait()  # rule B, and the same delay for a follow-up without a response

    def _receive(self, event: Any) -> None:
        source, message = event.transfer.source_node_id, event.message
        if self.node_id:
            return
        self._wait()  # rule C
        known = bytes(list(message.unique_id))
        if not source or not known or not self._unique_id.startswith(known):
            return
        self.said.append((source, len(known)))
        if len(known) < len(self._unique_id):
            self._wait(len(known))  # rule D
        elif message.node_id:
            self.node.node_id = message.node_id  # rule E
