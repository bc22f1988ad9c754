"""A node without an ID that requests one by the rules of the public Allocation type."""

import asyncio
from random import Random

from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import AllocationMessage, Mode, NodeHealth, NodeStatus
from hornbill.wire.port import CanPort
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.transfer import Transfer, split


class Allocatee:
    """Starts at once. `node_id` is 0 until allocated; then it sends NodeStatus every second."""

    def __init__(self, port: CanPort, unique_id: bytes, *, seed: int, preferred: int = 0) -> None:
        self.port = port
        self.unique_id = unique_id
        self.preferred = preferred
        self.node_id = 0
        self.given_at = 0.0
        self.response_delays: list[float] = []
        """Response times of the requests, s."""
        self._random = Random(seed)
        self._loop = asyncio.get_running_loop()
        self._reassembler = Reassembler()
        self._request_timer: asyncio.TimerHandle | None = None
        self._follow_up: asyncio.TimerHandle | None = None
        self._requested_at: float | None = None
        self._born = self._loop.time()
        port.listen(self._receive)
        self.restart()

    def restart(self) -> None:
        """Restart without a node ID, as after a power cut."""
        self.stop()
        self.node_id = 0
        self._born = self._loop.time()
        self._arm()

    def stop(self) -> None:
        """Send nothing any more."""
        for timer in (self._request_timer, self._follow_up):
            if timer is not None:
                timer.cancel()
        self._request_timer = self._follow_up = None

    def _arm(self) -> None:
        if self._request_timer is not None:
            self._request_timer.cancel()
        self._request_timer = self._loop.call_later(self._random.uniform(0.6, 1.0), self._request_first)

    def _request_first(self) -> None:
        self._arm()
        self._request(0)

    def _request(self, offset: int) -> None:
        part = self.unique_id[offset : offset + 6]
        message = AllocationMessage(self.preferred, offset == 0, part)
        transfer = Transfer(Kind.MESSAGE, 1, 0, 0, 24, 0, message.encode())
        self._requested_at = self._loop.time()
        self.port.send(split(transfer, AllocationMessage.TYPE, discriminator=self._random.randrange(1 << 14)))

    def _receive(self, frames: list[Frame]) -> None:
        for transfer in self._reassembler.feed(frames, self._loop.time()):
            if self.node_id or transfer.kind != Kind.MESSAGE or transfer.type_id != 1:
                continue
            message = AllocationMessage.decode(transfer.payload)
            if message is not None:
                self._handle(message, anonymous=transfer.source == 0)

    def _handle(self, message: AllocationMessage, *, anonymous: bool) -> None:
        self._arm()  # rule C
        if self._follow_up is not None:
            self._follow_up.cancel()
            self._follow_up = None
        known = len(message.unique_id)
        if anonymous:
            self._requested_at = None  # a request of another node came between
        if anonymous or self.unique_id[:known] != message.unique_id:
            return
        if self._requested_at is not None:
            self.response_delays.append(self._loop.time() - self._requested_at)
            self._requested_at = None
        if known < 16:  # rule D
            delay = self._random.uniform(0.0, 0.4)
            self._follow_up = self._loop.call_later(delay, self._request, known)
        elif message.node_id:  # rule E
            self.stop()
            self.node_id = message.node_id
            self.given_at = self._loop.time()
            self._say_status()

    def _say_status(self) -> None:
        status = NodeStatus(int(self._loop.time() - self._born), NodeHealth.OK, Mode.OPERATIONAL)
        transfer = Transfer(Kind.MESSAGE, 341, self.node_id, 0, 16, status.uptime_sec & 31, status.encode())
        self.port.send(split(transfer, NodeStatus.TYPE))
        self._request_timer = self._loop.call_later(1.0, self._say_status)
