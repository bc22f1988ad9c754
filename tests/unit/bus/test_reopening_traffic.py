"""The tests of what passes a ReopeningPort when its adapter is lost: requests, counters, old commands."""

import asyncio
import errno
from collections.abc import Callable, Coroutine
from typing import Any

import can
import pytest

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.bus.ports.pythoncan import PythonCanPort
from hornbill.bus.reopening import ReopeningPort
from hornbill.errors import BusDisconnected, PortError
from hornbill.node.participant import Participant
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort, PortState, PortStatistics
from hornbill.wire.services import GetNodeInfoRequest, SoftwareVersion
from jumping_clock import run
from unit.bus.reopening_desk import Adapter
from unit.bus.test_pythoncan import Adapter as Scripted
from unit.bus.test_pythoncan import until


class Refusing(Scripted):
    """A python-can bus that may have no room, and tells error frames."""

    def __init__(self) -> None:
        super().__init__()
        self.refused = 0

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.refused += self.refuse is not None
        super().send(msg, timeout)

    def tell(self, classes: int) -> None:
        """Say an error frame of these classes (linux/can/error.h)."""
        self.incoming.put(can.Message(arbitration_id=classes, is_extended_id=False, is_error_frame=True, data=bytes(8)))


def test_a_request_that_waits_fails_within_50_ms_and_the_participant_goes_on_afterwards() -> None:
    async def main() -> None:
        bus = MemoryBus()
        inner: list[Any] = []

        async def open_memory(statistics: PortStatistics) -> CanPort:
            port = bus.port("host")
            port.statistics = statistics
            inner.append(port)
            return port

        port = ReopeningPort(open_memory, address="memory:host", bitrate=1_000_000)
        await port.open()
        version = SoftwareVersion(0, 1)
        other = Participant(bus.port("b"), node_id=1, name="b", unique_id=bytes(16), software_version=version)
        deaf = bus.port("deaf")
        host = Participant(port, node_id=127, name="host", unique_id=bytes(16), software_version=version)
        host.start()
        loop = asyncio.get_running_loop()
        waiting = [
            asyncio.create_task(host.request(node, GetNodeInfoRequest(), timeout=10)) for node in (1, 1, 1, 2, 3)
        ]
        await asyncio.sleep(0.02)
        await inner[0].close()
        lost_at = loop.time()
        results = await asyncio.gather(*waiting, return_exceptions=True)
        assert all(isinstance(one, BusDisconnected) for one in results), results
        assert loop.time() - lost_at <= 0.05
        while port.state is not PortState.CONNECTING and port.state is not PortState.ACTIVE:
            with pytest.raises(BusDisconnected):
                await host.request(1, GetNodeInfoRequest())
            await asyncio.sleep(0.01)
        other.start()
        await asyncio.sleep(0.1)
        assert (await host.request(1, GetNodeInfoRequest())).name == "b"
        for one in (host, other):
            await one.close()
        for one in (port, deaf, other.port):
            await one.close()

    run(main())


@pytest.mark.parametrize("state", [PortState.LOST, PortState.CONNECTING, PortState.DISCONNECTED])
def test_whichever_way_it_is_gone_nobody_waits_for_an_answer(state: PortState) -> None:
    async def main() -> None:
        adapter = Adapter(PortStatistics())
        adapter.trouble = PortError("Plug it in.", cause=None)
        version = SoftwareVersion(0, 1)
        host = Participant(adapter, node_id=127, name="host", unique_id=bytes(16), software_version=version)
        host.start()
        waiting = asyncio.create_task(host.request(1, GetNodeInfoRequest(), timeout=60))
        await asyncio.sleep(0.12)
        adapter.state = state
        began = asyncio.get_running_loop().time()
        with pytest.raises(BusDisconnected, match="Plug it in"):
            await waiting
        assert asyncio.get_running_loop().time() - began <= 0.05
        sent = len(adapter.sent)
        with pytest.raises(BusDisconnected):
            await host.request(1, GetNodeInfoRequest())
        assert len(adapter.sent) == sent
        await host.close()

    run(main())


def with_memory(scene: Callable[[MemoryBus, ReopeningPort], Coroutine[Any, Any, None]]) -> None:
    async def main() -> None:
        bus = MemoryBus()

        async def open_memory(statistics: PortStatistics) -> CanPort:
            port = bus.port("host")
            port.statistics = statistics
            return port

        port = ReopeningPort(open_memory, address="memory:host", bitrate=1_000_000)
        await port.open()
        await scene(bus, port)
        await port.close()

    run(main())


def test_counters_go_on_over_a_reopening_on_the_embedded_bus() -> None:
    async def scene(bus: MemoryBus, port: ReopeningPort) -> None:
        other = bus.port("other")
        heard: list[Frame] = []
        port.listen(heard.extend)
        for turn in range(3):
            port.send([Frame(1, bytes([turn]))])
            other.send([Frame(2, bytes([turn]))])
            await asyncio.sleep(0.01)
            await bus._medium.ports["host"].close()  # pyright: ignore[reportPrivateUsage]
            await asyncio.sleep(6)
        assert (port.statistics.tx_frames, port.statistics.rx_frames, port.statistics.reopened) == (3, 3, 3)
        assert [frame.data for frame in heard] == [b"\0", b"\1", b"\2"]
        await other.close()

    with_memory(scene)


def test_what_waited_when_a_controller_went_off_the_bus_never_leaves() -> None:
    """With real threads: one frame is with the adapter, others wait behind it."""

    async def main() -> None:
        opened: list[Refusing] = []

        async def open_it(statistics: PortStatistics) -> CanPort:
            opened.append(Refusing())
            return PythonCanPort(opened[-1], address="socketcan:x", bitrate=1_000_000, statistics=statistics)

        port = ReopeningPort(open_it, address="socketcan:x", bitrate=1_000_000)
        await port.open()
        adapter = opened[0]
        adapter.refuse = can.CanOperationError("no room", errno.ENOBUFS)
        port.send([Frame(number, b"old") for number in range(20)])
        await until(lambda: adapter.refused)
        adapter.tell(0x040)
        await until(lambda: port.state is PortState.BUS_OFF)
        with pytest.raises(BusDisconnected):
            port.send([Frame(0x100, b"old")])
        await until(lambda: port.statistics.errors == 20 + 1)  # every frame dropped, and the error frame
        adapter.refuse = None
        adapter.tell(0x100)
        await until(lambda: port.state is PortState.ACTIVE)
        port.send([Frame(0x200, b"new")])
        await until(lambda: port.statistics.tx_frames)
        await asyncio.sleep(0.02)
        assert [data for _, data in adapter.sent] == [b"new"]
        assert port.statistics.errors == 20 + 1
        await port.close()

    asyncio.run(main())
