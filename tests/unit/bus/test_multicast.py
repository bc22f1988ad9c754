"""Frames over UDP multicast, and own frames returned by a medium."""

import asyncio
import socket

import can
import pytest

from hornbill.bus.address import open_port
from hornbill.bus.ports import link
from hornbill.bus.ports.link import OwnFrames
from hornbill.errors import PortOpenFailed
from hornbill.wire.frame import Frame
from unit.bus.waiting import received_by, until

pytestmark = pytest.mark.real_time

GROUP = "239.74.163.77"


@pytest.fixture
def multicast() -> None:
    """Skips where this machine does not return what it multicasts."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        receiver.bind(("", 0))
        receiver.settimeout(0.5)
        try:
            member = socket.inet_aton(GROUP) + socket.inet_aton("0.0.0.0")
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
            sender.sendto(b"here", (GROUP, receiver.getsockname()[1]))
            receiver.recv(16)
        except OSError as error:
            pytest.skip(f"no multicast on this machine: {error}")


@pytest.mark.usefixtures("multicast")
async def test_a_node_does_not_receive_its_own_multicast_frames() -> None:
    pytest.importorskip("msgpack")
    one, other = await open_port(f"udp_multicast:{GROUP}"), await open_port(f"udp_multicast:{GROUP}")
    received: list[Frame] = []
    own = received_by(one)
    other.listen(received.extend)
    frames = [Frame(0x1E08FF7F, bytes([n])) for n in range(50)]
    one.send(frames)
    await until(lambda: len(received) == 50)
    other.send([Frame(0x1E08FF05, b"last")])
    await until(lambda: own)
    assert [frame[:2] for frame in own] == [(0x1E08FF05, b"last")]
    assert (one.statistics.rx_frames, one.statistics.tx_frames) == (1, 50)
    await one.close()
    await other.close()


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(**_: object) -> can.BusABC:
        raise can.CanInterfaceNotImplementedError("msgpack not installed")

    monkeypatch.setattr(can, "Bus", refuse)
    with pytest.raises(PortOpenFailed, match=r"The Python package msgpack is not installed\. Run: pip install msgpack"):
        asyncio.run(open_port(f"udp_multicast:{GROUP}"))


def test_each_sent_frame_accounts_for_one_frame_that_returns_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    own = OwnFrames()
    own.sent([Frame(1, b"a"), Frame(1, b"a"), Frame(2, b"b")])
    back = [Frame(2, b"b", 1.0), Frame(1, b"a", 1.0), Frame(1, b"a", 1.0), Frame(1, b"a", 1.0), Frame(1, b"x", 1.0)]
    assert [own.take(frame) for frame in back] == [True, True, True, False, False]
    monkeypatch.setattr(link, "_OWN_S", 0.0)
    own.sent([Frame(1, b"a")])
    assert not own.take(Frame(1, b"a")), "sent long ago: another node's"
