"""The fastest possible allocator, as a reference for ours."""

import asyncio

from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import AllocationMessage
from hornbill.wire.port import CanPort
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.transfer import Transfer, split

NODE_ID = 127


class IdealAllocator:
    """Responds after `delay_s`, without rules or neighbours. Allocates 125, 124, … in order of completed requests."""

    def __init__(self, port: CanPort, delay_s: float = 0.0) -> None:
        self._port = port
        self._delay_s = delay_s
        self._given: dict[bytes, int] = {}
        self._gathered = b""
        self._reassembler = Reassembler()
        self._transfer_id = 0
        port.listen(self._receive)

    def _receive(self, frames: list[Frame]) -> None:
        for transfer in self._reassembler.feed(frames):
            message = AllocationMessage.decode(transfer.payload)
            if transfer.source or transfer.type_id != AllocationMessage.TYPE.id or message is None:
                continue
            self._gathered = (b"" if message.first_part_of_unique_id else self._gathered) + message.unique_id
            whole = len(self._gathered) == 16
            node_id = self._given.setdefault(self._gathered, 125 - len(self._given)) if whole else 0
            response = AllocationMessage(node_id, False, self._gathered[:16]).encode()
            asyncio.get_running_loop().call_later(self._delay_s, self._respond, response)

    def _respond(self, response: bytes) -> None:
        self._transfer_id = (self._transfer_id + 1) & 31
        transfer = Transfer(Kind.MESSAGE, AllocationMessage.TYPE.id, NODE_ID, 0, 24, self._transfer_id, response)
        self._port.send(split(transfer, AllocationMessage.TYPE))
