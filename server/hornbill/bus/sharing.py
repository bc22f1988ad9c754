"""SharedBus: one open port shared by several nodes of this process, for adapters that open only once."""

import asyncio
from collections.abc import Sequence

from hornbill.errors import BusDisconnected
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort, FrameSink, PortState, PortStatistics, PortWrapper


class SharedBus:
    """Several nodes on one adapter. Each receives from the bus and from the others, as with its own controller.

    Frames of a node reach the others in the next loop iteration, slightly before they are on the wire: an adapter does
    not report when they are. The shared bus owns the port.
    """

    def __init__(self, port: CanPort) -> None:
        self.behind = port
        self._nodes: dict[SharedPort, None] = {}
        port.listen(self._receive)

    def port(self, name: str) -> "SharedPort":
        """Create a port for another node."""
        node = SharedPort(self, f"{self.behind.address}/{name}")
        self._nodes[node] = None
        return node

    async def close(self) -> None:
        """Close the adapter and all ports on it."""
        self._nodes.clear()
        await self.behind.close()

    def has(self, node: "SharedPort") -> bool:
        """Whether the port of a node is open."""
        return node in self._nodes

    def leave(self, node: "SharedPort") -> None:
        """Remove a node. The adapter stays open for the others."""
        self._nodes.pop(node, None)

    def send(self, node: "SharedPort", frames: Sequence[Frame]) -> None:
        """Send frames of a node, and deliver them to the others. Raises as CanPort.send does."""
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
    """A CanPort of a SharedBus, created by `SharedBus.port`. It has its own counters and the state of the adapter."""

    def __init__(self, bus: SharedBus, address: str) -> None:
        super().__init__(bus.behind)
        self.address = address
        self.statistics = PortStatistics()
        self._bus = bus
        self._sink: FrameSink | None = None

    @property
    def state(self) -> PortState:
        """State of the adapter. DISCONNECTED once closed."""
        return super().state if self._bus.has(self) else PortState.DISCONNECTED

    def listen(self, sink: FrameSink) -> None:
        """Deliver received frames to `sink`."""
        self._sink = sink

    def send(self, frames: Sequence[Frame]) -> None:
        """Queue frames on the adapter. Raises BusDisconnected once closed, and the errors of the adapter."""
        if not self._bus.has(self):
            raise BusDisconnected(
                f"The port {self.address} is closed. Connect the bus again.", cause="port_closed", address=self.address
            )
        self._bus.send(self, frames)
        self.statistics.tx_frames += len(frames)

    async def close(self) -> None:
        """Leave the bus. The adapter stays open for the others."""
        self._bus.leave(self)
        self._sink = None

    def take(self, frames: list[Frame]) -> None:
        """Deliver received frames to the sink."""
        self.statistics.rx_frames += len(frames)
        if self._sink is not None:
            self._sink(frames)
