"""CAN over UDP multicast, against pydronecan's driver in both directions."""

import socket
import time
from collections.abc import Iterator
from typing import Any, cast

import pytest
from dronecan.driver.common import CANFrame
from dronecan.driver.mcast import mcast

from hornbill.bus.ports.mcast import PORT, MulticastLink, datagram
from hornbill.errors import PortOpenFailed
from hornbill.wire.frame import Frame

BUS = "7"
FRAME = Frame(0x1E0B_94FF, bytes.fromhex("000030783243c5"))


@pytest.fixture
def link() -> Iterator[MulticastLink]:
    try:
        made = MulticastLink(BUS)
    except OSError as error:
        pytest.skip(f"this machine has no network for multicast: {error}")
    yield made
    made.shutdown()


@pytest.fixture
def peer() -> Iterator[mcast]:
    made = mcast(BUS)
    yield made
    made.proc.kill()
    made.proc.join()


def received(link: MulticastLink, count: int, within_s: float = 5.0) -> list[Frame]:
    frames: list[Frame] = []
    end = time.monotonic() + within_s
    while len(frames) < count and time.monotonic() < end:
        frames += link.receive(0.1, 0.0).frames
    return frames


def test_frames_of_pydronecan_arrive_and_ours_arrive_there(link: MulticastLink, peer: mcast) -> None:
    end = time.monotonic() + 20
    back: Any = None
    while back is None and time.monotonic() < end:  # its process takes a while to start
        assert link.transmit([FRAME]) == 1
        back = cast("Any", peer).receive(0.2)
    assert back is not None
    assert (back.id, bytes(back.data), back.extended, back.canfd) == (FRAME.id, FRAME.data, True, False)
    assert link.receive(0.05, 0.0).frames == [], "our own datagrams are dropped"
    for number in range(50):
        peer.send_frame(CANFrame(FRAME.id, bytes([number]), True))
    assert [frame.data[0] for frame in received(link, 50)] == list(range(50))


@pytest.mark.parametrize(
    ("data", "counter"),
    [
        (datagram(FRAME)[:-1], "garbled"),
        (b"", "garbled"),
        (bytes(9), "garbled"),
        (bytes(10), "garbled"),
        (bytes(80), "garbled"),
    ],
)
def test_a_bad_datagram_is_counted(link: MulticastLink, data: bytes, counter: str) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(data, (f"239.65.82.{BUS}", PORT))
        sender.sendto(datagram(FRAME), (f"239.65.82.{BUS}", PORT))
    time.sleep(0.05)
    got = link.receive(1.0, 0.0)
    assert (getattr(got, counter), [frame.data for frame in got.frames]) == (1, [FRAME.data])


@pytest.mark.parametrize("channel", ["", "256", "-1", "a", "0:1"])
def test_an_invalid_bus_is_refused(channel: str) -> None:
    with pytest.raises(PortOpenFailed, match="0 to 255"):
        MulticastLink(channel)
