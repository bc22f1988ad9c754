"""Answers Allocation messages at once, by the letter of the public type, for bench tests."""

from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import AllocationMessage
from hornbill.wire.port import CanPort
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.transfer import Transfer, split
from hornbill.wire.types import decode


class IdealAllocator:
    """Gives 125, 124, … in the order nodes finish asking. `given` is unique id → node id."""

    def __init__(self, port: CanPort) -> None:
        self.given: dict[bytes, int] = {}
        self._port = port
        self._reassembler = Reassembler()
        self._so_far = b""
        self._transfer_id = 0
        port.listen(self._on_frames)

    def _on_frames(self, frames: list[Frame]) -> None:
        for transfer in self._reassembler.feed(frames):
            message = decode(transfer)
            if isinstance(message, AllocationMessage) and not transfer.source:
                self._handle(message)

    def _handle(self, message: AllocationMessage) -> None:
        self._so_far = message.unique_id if message.first_part_of_unique_id else self._so_far + message.unique_id
        node_id = 0
        if len(self._so_far) == 16:
            node_id = self.given.setdefault(self._so_far, 125 - len(self.given))
        response = AllocationMessage(node_id, False, self._so_far)
        transfer = Transfer(Kind.MESSAGE, 1, 127, 0, 24, self._transfer_id, response.encode())
        self._transfer_id = (self._transfer_id + 1) & 31
        self._port.send(split(transfer, AllocationMessage.TYPE))
