"""PythonCanPort on a real SocketCAN interface: order and loss, not speed."""

import asyncio
import errno
import os
import socket
import struct
from collections.abc import Callable, Iterator

import can
import pytest
from can.interfaces.socketcan import SocketcanBus

from hornbill.bus.address import open_port
from hornbill.bus.ports import rawcan
from hornbill.bus.ports.rawcan import RawLink
from hornbill.errors import BusDisconnected, PortOpenFailed
from hornbill.wire.frame import Frame
from hornbill.wire.port import PortState

_SIOCGIFFLAGS, _SIOCSIFFLAGS, _IFF_UP = 0x8913, 0x8914, 0x1


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(60):
        while not condition():
            await asyncio.sleep(0.005)


def test_four_hundred_frames_arrive_complete_and_in_order(vcan0: str) -> None:
    async def main() -> None:
        a, b = await open_port(vcan0), await open_port(vcan0)
        received: list[Frame] = []
        b.listen(received.extend)
        loop = asyncio.get_running_loop()
        began = loop.time()
        sent = [Frame(0x18AABB01, number.to_bytes(8, "big")[: 4 + number % 5]) for number in range(400)]
        a.send(sent)
        await until(lambda: len(received) == 400)
        assert [(frame.id, frame.data) for frame in received] == [(frame.id, frame.data) for frame in sent]
        stamps = [frame.at for frame in received]
        assert stamps == sorted(stamps)
        assert began - 0.01 <= stamps[0]
        assert stamps[-1] <= loop.time()
        await until(lambda: a.statistics.tx_frames == 400)
        assert a.statistics.errors == b.statistics.errors == a.statistics.rx_frames == 0
        await a.close()
        await b.close()

    asyncio.run(main())


def test_a_stop_overtakes_a_queue(vcan0: str) -> None:
    async def main() -> None:
        a, b = await open_port(vcan0), await open_port(vcan0)
        received: list[Frame] = []
        b.listen(received.extend)
        a.send([Frame(0x1F000001, bytes(8)) for _ in range(400)])
        a.send([Frame(0x10000001, b"stop")])
        await until(lambda: len(received) == 401)
        assert [frame.data for frame in received].index(b"stop") < 200
        await a.close()
        await b.close()

    asyncio.run(main())


def test_standard_remote_and_fd_frames_are_counted_only(vcan0: str) -> None:
    async def main() -> None:
        port = await open_port(vcan0)
        received: list[Frame] = []
        port.listen(received.extend)
        with can.Bus(interface="socketcan", channel="vcan0", fd=True, ignore_config=True) as other:
            other.send(can.Message(arbitration_id=0x123, is_extended_id=False, data=b"x"))
            other.send(can.Message(arbitration_id=0x123, is_remote_frame=True))
            other.send(can.Message(arbitration_id=0x123, is_fd=True, data=bytes(12)))
            other.send(can.Message(arbitration_id=0x456, data=b"ours"))
            await until(lambda: received)
        assert [(frame.id, frame.data) for frame in received] == [(0x456, b"ours")]
        assert (port.statistics.ignored, port.statistics.rx_dropped, port.statistics.errors) == (3, 0, 0)
        await port.close()

    asyncio.run(main())


def test_frames_dropped_by_the_kernel_are_counted(vcan0: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rawcan, "_BUFFER_BYTES", 1)
    bus = SocketcanBus("vcan0")
    link = RawLink(bus, bus.socket)
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as other:
        other.bind(("vcan0",))
        frame = struct.pack("=IB3x8s", 0x9234_5678, 8, bytes(8))
        for _ in range(500):
            other.send(frame)
        kept = link.receive(5, 0.0)
        other.send(frame)  # the kernel reports it with the next frame that fits
        later = link.receive(5, 0.0)
    assert 0 < len(kept.frames) < 500
    assert len(kept.frames) + len(later.frames) + later.lost == 501
    link.shutdown()


def test_a_missing_interface_is_refused_with_the_available_ones(vcan0: str) -> None:
    with pytest.raises(PortOpenFailed, match=r"CAN interface can77 not found\..*vcan0"):
        asyncio.run(open_port("socketcan:can77"))


def _set_up(name: str, up: bool) -> None:
    import fcntl

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        request = struct.pack("16sH14x", name.encode(), 0)
        (flags,) = struct.unpack_from("H", fcntl.ioctl(control, _SIOCGIFFLAGS, request), 16)
        flags = flags | _IFF_UP if up else flags & ~_IFF_UP
        fcntl.ioctl(control, _SIOCSIFFLAGS, struct.pack("16sH14x", name.encode(), flags))


@pytest.fixture
def pull_vcan1() -> Iterator[Callable[[], None]]:
    """A function that takes vcan1 down; it comes up again after the test."""
    try:
        _set_up("vcan1", True)
    except OSError as error:
        if error.errno in (errno.ENODEV, errno.EPERM):
            pytest.skip(f"vcan1 cannot be taken down and up here: {os.strerror(error.errno)}")
        raise
    yield lambda: _set_up("vcan1", False)
    _set_up("vcan1", True)


def test_an_interface_that_goes_down_is_a_lost_bus(vcan0: str, pull_vcan1: Callable[[], None]) -> None:
    async def main() -> None:
        port = await open_port("socketcan:vcan1")
        pull_vcan1()
        await until(lambda: port.state is PortState.LOST)
        with pytest.raises(BusDisconnected):
            port.send([Frame(1, b"")])
        assert "Network is down" in str(port.trouble)
        await port.close()
        with pytest.raises(PortOpenFailed, match="sudo ip link set vcan1 up"):
            await open_port("socketcan:vcan1")

    asyncio.run(main())
