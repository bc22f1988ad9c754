"""MulticastLink: CAN over UDP multicast, as ArduPilot's simulator, Mission Planner and pydronecan use it.

Address 239.65.82.N, port 57732. A datagram is, little endian: magic 0x2934, CRC-16-CCITT of all that follows, flags
(bit 0: CAN FD), identifier (bit 31: extended), data. It is not python-can's udp_multicast.
"""

import errno
import select
import socket
import struct
import sys
import time
from binascii import crc_hqx
from collections.abc import Sequence
from typing import Final

from hornbill.bus.ports.link import Received, pause
from hornbill.errors import PortOpenFailed
from hornbill.units import Instant
from hornbill.wire.frame import Frame

EXAMPLE: Final = "mcast:0"
PORT: Final = 57732

_NETWORK: Final = "239.65.82"
_MAGIC: Final = 0x2934
_HEAD: Final = struct.Struct("<HH")
_BODY: Final = struct.Struct("<HI")
_CRC_START: Final = 0xFFFF
_CAN_FD: Final = 1
_EXTENDED: Final = 1 << 31
_LONGEST: Final = 74
"""Ten bytes of header and 64 of data."""


def parse_bus(channel: str) -> int:
    """Bus number 0 to 255 of an address `mcast:N`. Raises PortOpenFailed."""
    if not channel.isdecimal() or not 0 <= int(channel) <= 255:
        raise PortOpenFailed(
            f"{channel!r} is not a multicast bus. Enter mcast:N with N from 0 to 255, for example {EXAMPLE}.",
            address=f"mcast:{channel}",
            cause="multicast_bus_invalid",
        )
    return int(channel)


def datagram(frame: Frame) -> bytes:
    """The datagram of a frame."""
    body = _BODY.pack(0, frame.id | _EXTENDED) + frame.data
    return _HEAD.pack(_MAGIC, crc_hqx(body, _CRC_START)) + body


class MulticastLink:
    """An AdapterLink to one multicast bus on the local network."""

    max_batch = 8

    def __init__(self, channel: str) -> None:
        """Join the group of bus `channel`. Raises PortOpenFailed, and OSError without a network."""
        group = f"{_NETWORK}.{parse_bus(channel)}"
        self._in = socket.socket(socket.AF_INET, socket.SOCK_DGRAM, socket.IPPROTO_UDP)
        self._out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM, socket.IPPROTO_UDP)
        try:
            self._in.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._in.bind(("" if sys.platform == "win32" else group, PORT))
            member = socket.inet_aton(group) + socket.inet_aton("0.0.0.0")
            self._in.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
            self._in.setblocking(False)
            self._out.connect((group, PORT))
            self._own = self._out.getsockname()
        except BaseException:
            self.shutdown()
            raise

    def receive(self, timeout_s: float, not_before: Instant) -> Received:
        """Receive until `not_before`. Raises OSError if the network is lost."""
        pause(not_before)
        got = Received()
        select.select([self._in], [], [], timeout_s)
        at = time.monotonic()
        while True:
            try:
                data, sender = self._in.recvfrom(_LONGEST + 1)
            except BlockingIOError:
                return got
            if sender != self._own:  # our own datagrams come back
                _take(data, got, at)

    def transmit(self, frames: Sequence[Frame]) -> int:
        """Send `frames`. Raises OSError if the network is lost."""
        for count, frame in enumerate(frames):
            try:
                self._out.send(datagram(frame))
            except (BlockingIOError, InterruptedError):
                return count
            except OSError as error:
                if error.errno != errno.ENOBUFS:
                    raise
                return count
        return len(frames)

    def shutdown(self) -> None:
        """Leave the group."""
        self._in.close()
        self._out.close()


def _take(data: bytes, got: Received, at: Instant) -> None:
    """Add the frame of a datagram to `got`, or count why there is none."""
    if len(data) < _HEAD.size + _BODY.size or len(data) > _LONGEST:
        got.garbled += 1
        return
    magic, crc = _HEAD.unpack_from(data)
    flags, can_id = _BODY.unpack_from(data, _HEAD.size)
    payload = data[_HEAD.size + _BODY.size :]
    if magic != _MAGIC or crc != crc_hqx(data[_HEAD.size :], _CRC_START):
        got.garbled += 1
    elif flags & _CAN_FD or not can_id & _EXTENDED or len(payload) > 8:
        got.ignored += 1
    else:
        got.frames.append(Frame(can_id & 0x1FFF_FFFF, payload, at))
