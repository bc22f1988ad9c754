"""Tests of socketcand: a server on this machine that says what one says, hangs, refuses and goes away."""

import asyncio
import socket
import threading
import time
from collections.abc import Callable, Coroutine
from types import TracebackType
from typing import Any, Self

import pytest

from hornbill.bus.address import check, open_port
from hornbill.bus.ports import socketcand
from hornbill.errors import PortOpenFailed
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort, PortState
from unit.bus.adapter import wait_until


class Server:
    """A socketcand server for one client, in a thread of its own. `refuses`: what it answers to open; `mute`: it says
    nothing at all."""

    def __init__(self, *, refuses: bytes | None = None, mute: bool = False) -> None:
        self.heard = ""
        self.client: socket.socket | None = None
        self._refuses = refuses
        self._mute = mute
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listening.getsockname()[1]
        self._thread = threading.Thread(target=self._live)
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

    def say(self, text: str) -> None:
        assert self.client is not None
        self.client.sendall(text.encode())

    def hang_up(self) -> None:
        if self.client is not None:
            try:
                self.client.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    def _live(self) -> None:
        try:
            self.client, _ = self._listening.accept()
        except OSError:
            return
        with self.client:
            if not self._mute:
                self.client.sendall(b"< hi >")
            while data := self._read():
                self.heard += data
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


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(5):
        while not condition():
            await asyncio.sleep(0.002)


def with_port(scenario: Callable[[Server, CanPort], Coroutine[Any, Any, None]]) -> None:
    async def main() -> None:
        with Server() as server:
            port = await open_port(server.address)
            try:
                await scenario(server, port)
            finally:
                await port.close()

    asyncio.run(main())


def test_frames_come_and_go() -> None:
    async def scenario(server: Server, port: CanPort) -> None:
        heard: list[Frame] = []
        port.listen(heard.extend)
        server.say("< frame 1E08FF05 23.424242 0102")
        server.say("C0 >< frame 123 23.5 11 >< rtr 1E08FF05 23.5 8 >< fdframe 123 00 23.5 11 >")
        server.say("< frame 00000007 23.5 AA BB ><frame 00000008 23.5  >\n")
        await until(lambda: len(heard) == 3)
        assert [frame[:2] for frame in heard] == [
            (0x1E08FF05, b"\x01\x02\xc0"), (7, b"\xaa\xbb"), (8, b""),
        ]  # fmt: skip
        assert (port.statistics.ignored, port.statistics.errors) == (3, 0)
        port.send([Frame(0x1FAA7F01, bytes(range(8))), Frame(0x1FAA7F02, b"")])
        await until(lambda: "send 1FAA7F02 0 >" in server.heard)
        assert "< open can0 >< rawmode >< send 1FAA7F01 8 00 01 02 03 04 05 06 07 >" in server.heard
        assert port.state is PortState.ACTIVE

    with_port(scenario)


def test_error_frames_and_garbage_are_counted() -> None:
    async def scenario(server: Server, port: CanPort) -> None:
        port.listen(list[Frame].clear)
        server.say("< error 00000040 23.1 >< frame xyz 1 2 >< frame 00000001 1 112233445566778899 >< what >")
        await until(lambda: port.statistics.bus_offs == 1)
        assert port.state is PortState.BUS_OFF
        await until(lambda: port.statistics.errors == 3)
        server.say("<" + "x" * 400)
        await until(lambda: port.statistics.errors == 4)

    with_port(scenario)


def test_a_server_that_goes_away_is_a_lost_adapter_within_a_second() -> None:
    async def scenario(server: Server, port: CanPort) -> None:
        began = time.monotonic()
        server.hang_up()
        await until(lambda: port.state is PortState.LOST)
        assert time.monotonic() - began < 1
        assert port.trouble is not None
        assert str(port.trouble).startswith(f"{server.address} was lost")

    with_port(scenario)


def failure(address: str) -> PortOpenFailed:
    threads = threading.active_count()
    with pytest.raises(PortOpenFailed) as caught:
        asyncio.run(open_port(address))
    wait_until(lambda: threading.active_count() <= threads)
    return caught.value


def test_a_server_that_refuses_the_interface_is_quoted() -> None:
    with Server(refuses=b"< error could not open bus >") as server:
        detail = failure(server.address).detail
    assert "the server responded '< error could not open bus >'" in detail
    assert "serves this CAN interface" in detail


def test_no_server_is_told_with_how_to_start_one() -> None:
    with socket.create_server(("127.0.0.1", 0)) as closed:
        port = closed.getsockname()[1]
    detail = failure(f"socketcand:127.0.0.1:{port}/can0").detail
    assert "No server is listening there. Start socketcand on that host (socketcand -i can0)" in detail


def test_a_server_that_says_nothing_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socketcand, "_RESPONSE_S", 0.2)
    with Server(mute=True) as server:
        assert "The server does not respond." in failure(server.address).detail


def test_a_host_that_is_not_known_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(*_: object, **__: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "create_connection", unknown)
    assert "Host not found." in failure("socketcand:nobody.invalid:29536/can0").detail


@pytest.mark.parametrize(
    "channel", ["can0", "host/can0", "host:29536", "host:0/can0", "host:70000/can0", "host:29536/", "h:1/c >< open x"]
)
def test_another_form_of_address_is_refused_with_an_example(channel: str) -> None:
    with pytest.raises(PortOpenFailed, match=r"is not HOST:PORT/CHANNEL.*socketcand:192\.168\.1\.20:29536/can0"):
        check(f"socketcand:{channel}", 1_000_000)


def test_a_host_may_be_an_address_of_ipv6() -> None:
    assert socketcand.parse_channel("[fe80::1]:29536/vcan0") == ("fe80::1", 29536, "vcan0")
