"""Socketcand: a simulated server that responds, refuses, hangs and disconnects."""

import asyncio
import socket
import threading
from collections.abc import AsyncGenerator, Iterator
from contextlib import asynccontextmanager
from types import TracebackType
from typing import Self

import pytest

from hornbill.bus.address import check, open_port
from hornbill.bus.ports import socketcand
from hornbill.errors import PortOpenFailed
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort, PortState
from unit.bus.waiting import no_leaks, received_by, until

pytestmark = pytest.mark.real_time


class Server:
    """A socketcand server for one client. `refuses`: its response to open. `mute`: it sends nothing."""

    def __init__(self, *, refuses: bytes | None = None, mute: bool = False) -> None:
        self.received = ""
        self.client: socket.socket | None = None
        self._refuses = refuses
        self._mute = mute
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listening.getsockname()[1]
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()
        self.hang_up()
        self._thread.join()

    @property
    def address(self) -> str:
        return f"socketcand:127.0.0.1:{self.port}/can0"

    def send(self, text: str) -> None:
        assert self.client is not None
        self.client.sendall(text.encode())

    def hang_up(self) -> None:
        if self.client is not None:
            try:
                self.client.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    def _run(self) -> None:
        try:
            self.client, _ = self._listening.accept()
        except OSError:
            return
        with self.client:
            if not self._mute:
                self.client.sendall(b"< hi >")
            while data := self._read():
                self.received += data
                if "open" in data and self._refuses is not None:
                    self.client.sendall(self._refuses)
                elif not self._mute and ("open" in data or "rawmode" in data):
                    self.client.sendall(b"< ok >")

    def _read(self) -> str:
        assert self.client is not None
        try:
            return self.client.recv(4096).decode()
        except OSError:
            return ""


@pytest.fixture
def server() -> Iterator[Server]:
    with Server() as server:
        yield server


@pytest.fixture
@asynccontextmanager
async def port(server: Server) -> AsyncGenerator[CanPort]:
    port = await open_port(server.address)
    yield port
    await port.close()


async def test_frames_are_received_and_sent(server: Server, port: CanPort) -> None:
    received = received_by(port)
    server.send("< frame 1E08FF05 23.424242 0102")
    server.send("C0 >< frame 123 23.5 11 >< rtr 1E08FF05 23.5 8 >< fdframe 123 00 23.5 11 >")
    server.send("< frame 00000007 23.5 AA BB ><frame 00000008 23.5  >\n")
    await until(lambda: len(received) == 3)
    assert [frame[:2] for frame in received] == [
        (0x1E08FF05, b"\x01\x02\xc0"), (7, b"\xaa\xbb"), (8, b""),
    ]  # fmt: skip
    assert (port.statistics.ignored, port.statistics.errors) == (3, 0)
    port.send([Frame(0x1FAA7F01, bytes(range(8))), Frame(0x1FAA7F02, b"")])
    await until(lambda: "send 1FAA7F02 0 >" in server.received)
    assert "< open can0 >< rawmode >< send 1FAA7F01 8 00 01 02 03 04 05 06 07 >" in server.received
    assert port.state is PortState.ACTIVE


async def test_error_frames_and_invalid_data_are_counted(server: Server, port: CanPort) -> None:
    port.listen(list[Frame].clear)
    server.send("< error 00000040 23.1 >< frame xyz 1 2 >< frame 00000001 1 112233445566778899 >< what >")
    await until(lambda: port.statistics.bus_offs == 1)
    assert port.state is PortState.BUS_OFF
    await until(lambda: port.statistics.errors == 3)
    server.send("<" + "x" * 400)
    await until(lambda: port.statistics.errors == 4)


async def test_a_server_that_disconnects_is_a_lost_adapter(server: Server, port: CanPort) -> None:
    server.hang_up()
    await until(lambda: port.state is PortState.LOST)
    assert port.trouble is not None
    assert str(port.trouble).startswith(f"{server.address} was lost")


def failure(address: str) -> PortOpenFailed:
    with no_leaks(), pytest.raises(PortOpenFailed) as caught:
        asyncio.run(open_port(address))
    return caught.value


def test_a_server_that_refuses_the_interface_is_quoted() -> None:
    with Server(refuses=b"< error could not open bus >") as server:
        detail = failure(server.address).detail
    assert "the server responded '< error could not open bus >'" in detail
    assert "serves this CAN interface" in detail


def test_a_missing_server_is_reported_with_how_to_start_one() -> None:
    with socket.create_server(("127.0.0.1", 0)) as closed:
        port = closed.getsockname()[1]
    detail = failure(f"socketcand:127.0.0.1:{port}/can0").detail
    assert "No server is listening there. Start socketcand on that host (socketcand -i can0)" in detail


def test_a_server_that_does_not_respond_times_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socketcand, "_RESPONSE_S", 0.2)
    with Server(mute=True) as server:
        assert "The server does not respond." in failure(server.address).detail


def test_an_unknown_host_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(*_: object, **__: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "create_connection", unknown)
    assert "Host not found." in failure("socketcand:nobody.invalid:29536/can0").detail


@pytest.mark.parametrize(
    "channel", ["can0", "host/can0", "host:29536", "host:0/can0", "host:70000/can0", "host:29536/", "h:1/c >< open x"]
)
def test_an_invalid_address_is_refused_with_an_example(channel: str) -> None:
    with pytest.raises(PortOpenFailed, match=r"is not HOST:PORT/CHANNEL.*socketcand:192\.168\.1\.20:29536/can0"):
        check(f"socketcand:{channel}", 1_000_000)


def test_a_host_may_be_an_ipv6_address() -> None:
    assert socketcand.parse_channel("[fe80::1]:29536/vcan0") == ("fe80::1", 29536, "vcan0")
