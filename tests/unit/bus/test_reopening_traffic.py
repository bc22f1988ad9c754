"""ReopeningPort when its adapter is lost: pending requests, counters and queued frames."""

import asyncio
import errno
from collections.abc import Awaitable, Callable

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
from unit.bus.reopening_desk import Adapter
from unit.bus.test_pythoncan import Adapter as Scripted
from unit.bus.waiting import received_by, until


class Refusing(Scripted):
    """A python-can bus that may refuse frames, and reports error frames."""

    def __init__(self) -> None:
        super().__init__()
        self.refused = 0

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.refused += self.refuse is not None
        super().send(msg, timeout)

    def report(self, classes: int) -> None:
        """Receive an error frame of these classes (linux/can/error.h)."""
        self.incoming.put(can.Message(arbitration_id=classes, is_extended_id=False, is_error_frame=True, data=bytes(8)))


def opener(bus: MemoryBus) -> Callable[[PortStatistics], Awaitable[CanPort]]:
    async def open_memory(statistics: PortStatistics) -> CanPort:
        port = bus.port("host")
        port.statistics = statistics
        return port

    return open_memory


def adapter_of(bus: MemoryBus) -> CanPort:
    return bus._medium.ports["host"]  # pyright: ignore[reportPrivateUsage]


def host_on(port: CanPort, node_id: int = 127) -> Participant:
    return Participant(port, node_id=node_id, name="host", unique_id=bytes(16), software_version=SoftwareVersion(0, 1))


async def test_pending_requests_fail_within_50_ms_and_new_ones_succeed_after_reopening() -> None:
    bus = MemoryBus()
    port = ReopeningPort(opener(bus), address="memory:host", bitrate=1_000_000)
    await port.open()
    other = host_on(bus.port("b"), 1)
    deaf = bus.port("deaf")
    host = host_on(port)
    host.start()
    loop = asyncio.get_running_loop()
    waiting = [asyncio.create_task(host.request(node, GetNodeInfoRequest(), timeout=10)) for node in (1, 1, 1, 2, 3)]
    await asyncio.sleep(0.02)
    await adapter_of(bus).close()
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
    assert (await host.request(1, GetNodeInfoRequest())).name == "host"
    for one in (host, other):
        await one.close()
    for one in (port, deaf, other.port):
        await one.close()


@pytest.mark.parametrize("state", [PortState.LOST, PortState.CONNECTING, PortState.DISCONNECTED])
async def test_requests_fail_at_once_in_every_disconnected_state(state: PortState) -> None:
    adapter = Adapter(PortStatistics())
    adapter.trouble = PortError("Plug it in.", cause=None)
    host = host_on(adapter)
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


async def test_reopening_continues_the_counters() -> None:
    bus = MemoryBus()
    port = ReopeningPort(opener(bus), address="memory:host", bitrate=1_000_000)
    await port.open()
    other = bus.port("other")
    received = received_by(port)
    for turn in range(3):
        port.send([Frame(1, bytes([turn]))])
        other.send([Frame(2, bytes([turn]))])
        await asyncio.sleep(0.01)
        await adapter_of(bus).close()
        await asyncio.sleep(6)
    assert (port.statistics.tx_frames, port.statistics.rx_frames, port.statistics.reopened) == (3, 3, 3)
    assert [frame.data for frame in received] == [b"\0", b"\1", b"\2"]
    await other.close()


@pytest.mark.real_time
async def test_frames_queued_at_bus_off_are_never_sent() -> None:
    """With real threads: one frame is in the adapter, others are queued behind it."""
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
    adapter.report(0x040)
    await until(lambda: port.state is PortState.BUS_OFF)
    with pytest.raises(BusDisconnected):
        port.send([Frame(0x100, b"old")])
    await until(lambda: port.statistics.errors == 20 + 1)  # every frame dropped, and the error frame
    adapter.refuse = None
    adapter.report(0x100)
    await until(lambda: port.state is PortState.ACTIVE)
    port.send([Frame(0x200, b"new")])
    await until(lambda: port.statistics.tx_frames)
    await asyncio.sleep(0.02)
    assert [data for _, data in adapter.sent] == [b"new"]
    assert port.statistics.errors == 20 + 1
    await port.close()
