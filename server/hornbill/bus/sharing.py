"""SharedBus: one open port carried to many nodes of this process, for adapters that open only once."""

import asyncio
from collections.abc import Sequence

from hornbill.errors import BusDisconnected
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort, FrameSink, PortState, PortStatistics, PortWrapper


class SharedBus:
    """Several nodes behind one adapter: each hears the bus and the others, as if each had a controller of its own.

    What a node sends reaches its neighbours in the next turn of the loop, a little before it is on the wire: an
    adapter does not say when that is. The port is the shared bus's from now on.
    """

    def __init__(self, port: CanPort) -> None:
        self.behind = port
        self._nodes: dict[SharedPort, None] = {}
        port.listen(self._receive)

    def port(self, name: str) -> "SharedPort":
        """A place on the bus for one more node."""
        node = SharedPort(self, f"{self.behind.address}/{name}")
        self._nodes[node] = None
        return node

    async def close(self) -> None:
        """Close the adapter; every place on it is closed with it."""
        self._nodes.clear()
        await self.behind.close()

    def has(self, node: "SharedPort") -> bool:
        """Whether the node still has its place."""
        return node in self._nodes

    def leave(self, node: "SharedPort") -> None:
        """Take a node off; the adapter stays open for the others."""
        self._nodes.pop(node, None)

    def send(self, node: "SharedPort", frames: Sequence[Frame]) -> None:
        """Send for a node, and let its neighbours hear it. Raises as CanPort.send does."""
        self.behind.send(frames)
        loop = asyncio.get_running_loop()
        now = loop.time()
        loop.call_soon(self._deliver, [frame._replace(at=now) for frame in frames], node)

    def _receive(self, frames: list[Frame]) -> None:
        self._deliver(frames, None)

    def _deliver(self, frames: list[Frame], sender: "SharedPort | None") -> None:
        for node in tuple(self._nodes):
            if node is not sender and node in self._nodes:
                node.take(frames)


class SharedPort(PortWrapper):
    """A CanPort of a SharedBus; made by `SharedBus.port`. Its counters are its own, its state is the adapter's."""

    def __init__(self, bus: SharedBus, address: str) -> None:
        super().__init__(bus.behind)
        self.address = address
        self.statistics = PortStatistics()
        self._bus = bus
        self._sink: FrameSink | None = None

    @property
    def state(self) -> PortState:
        """That of the adapter behind; disconnected once closed."""
        return super().state if self._bus.has(self) else PortState.DISCONNECTED

    def listen(self, sink: FrameSink) -> None:
        """Deliver received frames to `sink`."""
        self._sink = sink

    def send(self, frames: Sequence[Frame]) -> None:
        """Queue frames on the adapter. Raises BusDisconnected once closed, and what the adapter raises."""
        if not self._bus.has(self):
            raise BusDisconnected(
                f"The port {self.address} is closed. Connect the bus again.", cause="port_closed", address=self.address
            )
        self._bus.send(self, frames)
        self.statistics.tx_frames += len(frames)

    async def close(self) -> None:
        """Leave the bus; the adapter stays open for the others."""
        self._bus.leave(self)
        self._sink = None

    def take(self, frames: list[Frame]) -> None:
        """Hand frames of the bus to whoever listens here."""
        self.statistics.rx_frames += len(frames)
        if self._sink is not None:
            self._sink(frames)
