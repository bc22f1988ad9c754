"""A serial adapter on the embedded bus: what its line carries takes time, and what does not fit its buffer is lost."""

import asyncio
from collections import deque
from collections.abc import Sequence

from behaviour.rig import Rig
from hornbill.bus.embedded.memory_port import MemoryPort
from hornbill.bus.reopening import ReopeningPort
from hornbill.errors import PortError
from hornbill.wire.frame import Frame
from hornbill.wire.port import (
    CanPort,
    FrameSink,
    PortDetails,
    PortState,
    PortStatistics,
    SerialLineInfo,
    line_bytes,
)

ROOM = 64
"""Frames an adapter keeps while its line is busy."""

ACKNOWLEDGEMENT_BYTES = 2


class SerialAdapter:
    """A CanPort on a MemoryPort with a serial line of `baud` bit/s in between, on the loop's clock.

    Both directions carry 10 bits a byte. `dropped` are frames of the bus that found no room.
    """

    def __init__(self, inner: MemoryPort, baud: int) -> None:
        self.address = inner.address
        self.bitrate = inner.bitrate
        self.statistics = PortStatistics()
        self.sample_point: float | None = None
        self.trouble: PortError | None = None
        self.retry_in_s: float | None = None
        self.details = PortDetails(SerialLineInfo(baud, found=True, serial_number="A1B2"))
        self.dropped = 0
        self.busiest = 0
        self._inner = inner
        self._byte_s = SerialLineInfo.BITS_PER_BYTE / baud
        self._sink: FrameSink = list[Frame].clear
        self._coming: deque[tuple[int, Frame | None]] = deque()
        self._leaving: deque[Frame] = deque()
        inner.listen(self._from_bus)

    @property
    def state(self) -> PortState:
        """That of its controller."""
        return self._inner.state

    def listen(self, sink: FrameSink) -> None:
        """Deliver received frames to `sink`."""
        self._sink = sink

    def send(self, frames: Sequence[Frame]) -> None:
        """Queue frames for the line."""
        idle = not self._leaving
        self._leaving.extend(frames)
        if idle:
            self._next_leaves()

    async def close(self) -> None:
        """Leave the bus."""
        await self._inner.close()

    def _from_bus(self, frames: list[Frame]) -> None:
        for frame in frames:
            self._take(line_bytes(frame), frame)

    def _take(self, size: int, frame: Frame | None) -> None:
        if len(self._coming) >= ROOM and frame is not None:
            self.dropped += 1
            return
        self._coming.append((size, frame))
        self.busiest = max(self.busiest, len(self._coming))
        if len(self._coming) == 1:
            asyncio.get_running_loop().call_later(size * self._byte_s, self._arrived)

    def _arrived(self) -> None:
        size, frame = self._coming.popleft()
        loop = asyncio.get_running_loop()
        self.statistics.line_bytes += size
        if self._coming:
            loop.call_later(self._coming[0][0] * self._byte_s, self._arrived)
        if frame is not None:
            self.statistics.rx_frames += 1
            self._sink([frame._replace(at=loop.time())])

    def _next_leaves(self) -> None:
        wait_s = line_bytes(self._leaving[0]) * self._byte_s
        asyncio.get_running_loop().call_later(wait_s, self._left)

    def _left(self) -> None:
        frame = self._leaving.popleft()
        self.statistics.tx_frames += 1
        if self._inner.state is not PortState.DISCONNECTED:
            self._inner.send([frame])
            self._take(ACKNOWLEDGEMENT_BYTES, None)
        if self._leaving:
            self._next_leaves()


async def connect(rig: Rig, baud: int) -> SerialAdapter:
    """Connect the host of a rig through a serial adapter."""
    made: list[SerialAdapter] = []

    async def open_port(address: str, bitrate: int) -> CanPort:
        async def open_one(statistics: PortStatistics) -> CanPort:
            adapter = SerialAdapter(rig.bus.port("host", bitrate=bitrate), baud)
            adapter.statistics = statistics
            made.append(adapter)
            return adapter

        port = ReopeningPort(open_one, address=address, bitrate=bitrate)
        await port.open()
        return port

    rig.host._open_port = open_port  # pyright: ignore[reportPrivateUsage]
    await rig.host.connect("slcan:/dev/ttyUSB0", 1_000_000)
    return made[0]
