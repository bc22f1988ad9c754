"""RawLink on a pair of sockets that carry the data of a SocketCAN socket."""

import socket
import struct
import sys
import time
from collections.abc import Iterator

import can
import pytest

from hornbill.bus.ports.errorframe import ErrorFrame
from hornbill.bus.ports.link import Received
from hornbill.bus.ports.rawcan import RawLink
from hornbill.wire.frame import Frame

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="SocketCAN is a matter of Linux")

STAMPS = 35  # SO_TIMESTAMPNS, which python-can switches on


class Reporting(socket.socket):
    """A socket for which the kernel reports dropped frames."""

    drops: list[int] = []  # noqa: RUF012

    def recvmsg(self, *sizes: int):  # type: ignore[no-untyped-def] # pyright: ignore
        data, ancillary, flags, sender = super().recvmsg(*sizes)
        if self.drops:
            ancillary = [*ancillary, (socket.SOL_SOCKET, 40, struct.pack("=I", self.drops.pop(0)))]
        return data, ancillary, flags, sender


class Bus(can.BusABC):
    """The owner of the socket."""

    def __init__(self, raw: socket.socket) -> None:
        super().__init__("can0")
        self.raw = raw

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise NotImplementedError

    def shutdown(self) -> None:
        super().shutdown()
        self.raw.close()


@pytest.fixture
def pair() -> Iterator[tuple[RawLink, socket.socket]]:
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    with Reporting(fileno=near.detach()) as reporting, far:
        reporting.setsockopt(socket.SOL_SOCKET, STAMPS, 1)
        link = RawLink(Bus(reporting), reporting)
        yield link, far
        link.shutdown()
        assert reporting.fileno() == -1


def packed(identifier: int, data: bytes, size: int = 16) -> bytes:
    return struct.pack("=IB3x", identifier, len(data)) + data.ljust(size - 8, b"\xee")


def test_all_available_frames_are_received_at_once_in_order_with_timestamps(
    pair: tuple[RawLink, socket.socket],
) -> None:
    link, far = pair
    began = time.monotonic()
    for number in range(9):
        far.send(packed(0x8000_0000 | 0x1FFF_FFF0 + number, bytes([number]) * number))
    got = link.receive(1, 0.0)
    assert [frame[:2] for frame in got.frames] == [(0x1FFF_FFF0 + n, bytes([n]) * n) for n in range(9)]
    stamps = [frame.at for frame in got.frames]
    assert stamps == sorted(stamps)
    assert began - 0.01 <= stamps[0]
    assert stamps[-1] <= time.monotonic()
    assert not link.receive(0, 0.0)


def test_foreign_frames_and_error_frames_are_distinguished(pair: tuple[RawLink, socket.socket]) -> None:
    link, far = pair
    for text in (
        packed(0x123, b"standard"),
        packed(0xC000_0123, b""),  # remote
        packed(0x8000_0123, bytes(48), 72),  # CAN FD
        packed(0x2000_0000 | 0x0A8, bytes([0, 0, 0, 0x19, 0, 0, 0, 0])),
        packed(0x8000_0007, b"ours"),
    ):
        far.send(text)
    got = link.receive(1, 0.0)
    assert [frame[:2] for frame in got.frames] == [(7, b"ours")]
    assert (got.ignored, got.errors) == (3, [ErrorFrame(0x0A8, bytes([0, 0, 0, 0x19, 0, 0, 0, 0]))])


def test_receiving_waits_until_not_before(pair: tuple[RawLink, socket.socket]) -> None:
    link, far = pair
    far.send(packed(0x8000_0001, b""))
    until = time.monotonic() + 0.02
    assert len(link.receive(1, until).frames) == 1
    assert time.monotonic() >= until


def test_frames_dropped_by_the_kernel_are_counted_once(
    pair: tuple[RawLink, socket.socket], monkeypatch: pytest.MonkeyPatch
) -> None:
    link, far = pair
    monkeypatch.setattr(Reporting, "drops", [3, 3, 10])
    lost: list[int] = []
    for _ in range(3):
        far.send(packed(0x8000_0001, b""))
        lost.append(link.receive(1, 0.0).lost)
    assert lost == [3, 0, 7]
    assert Received(lost=1)


def test_frames_are_written_in_kernel_format_and_wait_while_its_queue_is_full(
    pair: tuple[RawLink, socket.socket],
) -> None:
    link, far = pair
    sent = 0
    while link.transmit([Frame(0x1234567, b"\x01\x02"), Frame(2, b"")]):
        sent += 1
        assert sent < 100_000
    far.setblocking(False)
    assert far.recv(72) == packed(0x8123_4567, b"\x01\x02").replace(b"\xee", b"\0")
    for _ in range(sent - 1):
        far.recv(72)
    with pytest.raises(BlockingIOError):
        far.recv(72)
    assert link.transmit([Frame(2, b"")]) == 1


def test_a_removed_interface_raises(pair: tuple[RawLink, socket.socket]) -> None:
    link, far = pair
    far.close()
    with pytest.raises(OSError, match=r"."):
        link.transmit([Frame(1, b"")])
