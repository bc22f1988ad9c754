"""SocketcandLink: a CAN interface of another computer, served by socketcand over TCP.

python-can's own implementation is not used: it reads one frame per call, waits ten seconds for an unreachable server,
and does not detect a lost server.
"""

import errno
import re
import select
import socket
import time
from collections.abc import Callable, Sequence

from hornbill.bus.ports.errorframe import ErrorFrame
from hornbill.bus.ports.link import Received, pause
from hornbill.errors import PortOpenFailed
from hornbill.units import Instant
from hornbill.wire.frame import Frame

EXAMPLE = "socketcand:192.168.1.20:29536/can0"

_CHANNEL = re.compile(r"(?P<host>\[[0-9a-fA-F:.]+\]|[^\s:/\[\]]+):(?P<port>\d{1,5})/(?P<interface>[^\s/<>]+)")
_CONNECT_S = 2.0
_RESPONSE_S = 1.0
_SEND_S = 0.25
_READ_BYTES = 65536
_LONGEST = 200  # longer than any message


def parse_channel(channel: str) -> tuple[str, int, str]:
    """Host, TCP port and CAN interface of `HOST:PORT/CHANNEL`. Raises PortOpenFailed for other forms."""
    found = _CHANNEL.fullmatch(channel)
    if found is None or not 0 < int(found["port"]) < 65536:
        raise PortOpenFailed(
            f"{channel!r} is not HOST:PORT/CHANNEL. Example: {EXAMPLE}.",
            address=f"socketcand:{channel}",
            cause="socketcand_address_invalid",
        )
    return found["host"].strip("[]"), int(found["port"]), found["interface"]


class SocketcandLink:
    """An AdapterLink to one CAN interface of a socketcand server, in raw mode."""

    max_batch = 8

    def __init__(self, channel: str, wanted: Callable[[], bool] = lambda: True) -> None:
        """Connect to `HOST:PORT/CHANNEL`, within about five seconds.

        Raises PortOpenFailed for an invalid channel or if the server refuses, and OSError if it is unreachable or does
        not respond.
        """
        host, port, interface = parse_channel(channel)
        self._address = f"socketcand:{channel}"
        self._rest = b""
        self._socket = socket.create_connection((host, port), timeout=_CONNECT_S)
        try:
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._await(b"< hi >", wanted)
            for command in (f"< open {interface} >", "< rawmode >"):
                self._socket.sendall(command.encode("ascii", "replace"))
                self._await(b"< ok >", wanted)
            self._socket.settimeout(_SEND_S)
        except BaseException:
            self._socket.close()
            raise

    def receive(self, timeout_s: float, not_before: Instant) -> Received:
        """Receive until `not_before`. Raises OSError if the connection is lost."""
        pause(not_before)
        got = Received()
        data = self._read(timeout_s)
        if not data:
            return got
        at = time.monotonic()
        *messages, self._rest = (self._rest + data).split(b">")
        for message in messages:
            self._take(message.strip(b" <\r\n").split(), got, at)
        if len(self._rest) > _LONGEST:
            self._rest = b""
            got.garbled += 1
        return got

    def transmit(self, frames: Sequence[Frame]) -> int:
        """Send all of `frames`. Raises OSError if the connection is lost or blocked for a quarter of a second."""
        text = "".join(
            f"< send {frame.id:08X} {len(frame.data)}{''.join(f' {byte:02X}' for byte in frame.data)} >"
            for frame in frames
        )
        self._socket.sendall(text.encode("ascii"))
        return len(frames)

    def shutdown(self) -> None:
        """Close the connection."""
        self._socket.close()

    def _await(self, response: bytes, wanted: Callable[[], bool]) -> None:
        until = time.monotonic() + _RESPONSE_S
        while b">" not in self._rest:
            left = until - time.monotonic()
            if left <= 0 or not wanted():
                raise TimeoutError(f"no {response.decode()} received")
            self._rest += self._read(min(left, 0.1))
        received, _, self._rest = self._rest.partition(b">")
        if received.strip(b" <\r\n") != response.strip(b" <>"):
            text = (received + b">").decode("ascii", "replace").strip()
            remedy = "Check that a socketcand server is running there and serves this CAN interface."
            raise PortOpenFailed(
                f"{self._address} cannot be opened: the server responded {text[:_LONGEST]!r}. {remedy}",
                address=self._address, remedy=remedy, cause="socketcand_refused",
            )  # fmt: skip

    def _read(self, timeout_s: float) -> bytes:
        ready, _, _ = select.select([self._socket], [], [], timeout_s)
        if not ready:
            return b""
        data = self._socket.recv(_READ_BYTES)
        if not data:
            raise OSError(errno.ECONNRESET, "the server closed the connection")
        return data

    def _take(self, words: list[bytes], got: Received, at: Instant) -> None:
        """Parse one message: `frame ID SECONDS DATA`, with data as a whole or by byte, or `error CLASSES SECONDS`."""
        try:
            if words[0] == b"frame":
                data = bytes.fromhex(b"".join(words[3:]).decode("ascii"))
                if len(words[1]) == 8 and len(data) <= 8:
                    got.frames.append(Frame(int(words[1], 16) & 0x1FFF_FFFF, data, at))
                else:
                    got.ignored += 1
            elif words[0] in (b"rtr", b"fdframe"):
                got.ignored += 1
            elif words[0] == b"error":
                got.errors.append(ErrorFrame(int(words[1], 16) & 0x1FFF_FFFF))
            elif words[0] not in (b"ok", b"hi", b"echo"):
                got.garbled += 1
        except (ValueError, IndexError):
            got.garbled += 1
