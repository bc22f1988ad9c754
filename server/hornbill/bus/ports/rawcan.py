"""Direct access to a SocketCAN socket, bypassing python-can, in a third of the time per frame.

It also reports what python-can does not: frames dropped by the kernel because of RX overruns, and CAN FD frames.
"""

import errno
import select
import socket
import struct
import time
from collections.abc import Sequence

import can

from hornbill.bus.ports.errorframe import ErrorFrame
from hornbill.bus.ports.link import FULL_S, Received, Stamps, pause
from hornbill.units import Instant
from hornbill.wire.frame import Frame

_MAX_BATCH = 256  # frames per batch; the rest stays queued

_FRAME = struct.Struct("=IB3x8s")  # struct can_frame
_FD_BYTES = 72  # struct canfd_frame
_STAMP = struct.Struct("@ll")  # struct timespec
_COUNT = struct.Struct("=I")
_EXTENDED = 0x8000_0000
_REMOTE = 0x4000_0000
_ERROR = 0x2000_0000
_IDENTIFIER = 0x1FFF_FFFF

# asm-generic/socket.h and linux/can/raw.h. python-can enables time stamps.
_SO_TIMESTAMPNS = 35
_SO_RXQ_OVFL = 40
_ANCILLARY_BYTES = 128
_SOL_CAN_RAW = 101
_CAN_RAW_FD_FRAMES = 5

_BUFFER_BYTES = 1 << 20  # a quarter of a second of a saturated bus, if the kernel allows
_WRITABLE_S = 0.01


class RawLink:
    """An AdapterLink on the socket of an open python-can SocketcanBus, which keeps owning it."""

    max_batch = 1  # frames in the kernel keep their order and can no longer be overtaken

    def __init__(self, bus: can.BusABC, raw: socket.socket) -> None:
        self._bus = bus
        self._socket = raw
        self._stamps = Stamps()
        self._dropped = 0
        raw.setblocking(False)
        for level, option, value in (
            (socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES),
            (socket.SOL_SOCKET, _SO_RXQ_OVFL, 1),
            (_SOL_CAN_RAW, _CAN_RAW_FD_FRAMES, 1),  # to count them
        ):
            try:
                raw.setsockopt(level, option, value)
            except OSError:
                continue  # an old kernel, or another kind of socket: optional

    def receive(self, timeout_s: float, not_before: Instant) -> Received:
        """Receive until `not_before`, up to _MAX_BATCH frames. Raises OSError if the interface is down or removed."""
        pause(not_before)
        got = Received()
        ready, _, _ = select.select([self._socket], [], [], timeout_s)
        if not ready:
            return got
        frames, instant = got.frames, self._stamps.instant
        receive, unpack = self._socket.recvmsg, _FRAME.unpack
        for _ in range(_MAX_BATCH):
            try:
                data, ancillary, _, _ = receive(_FD_BYTES, _ANCILLARY_BYTES)
            except BlockingIOError:
                break
            stamp = 0.0
            for _, kind, content in ancillary:
                if kind == _SO_TIMESTAMPNS:
                    seconds, nanoseconds = _STAMP.unpack_from(content)
                    stamp = seconds + nanoseconds * 1e-9
                elif kind == _SO_RXQ_OVFL:
                    (dropped,) = _COUNT.unpack_from(content)
                    got.lost += (dropped - self._dropped) & 0xFFFF_FFFF
                    self._dropped = dropped
            if len(data) != _FRAME.size:
                got.ignored += 1
                continue
            identifier, length, payload = unpack(data)
            if identifier & _ERROR:
                got.errors.append(ErrorFrame(identifier & _IDENTIFIER, payload[:length]))
            elif identifier & _EXTENDED and not identifier & _REMOTE:
                frames.append(Frame(identifier & _IDENTIFIER, payload[:length], instant(stamp)))
            else:
                got.ignored += 1
        return got

    def transmit(self, frames: Sequence[Frame]) -> int:
        """Pass the first of `frames` to the kernel. Raises OSError if the interface is down or removed."""
        frame = frames[0]
        try:
            self._socket.send(_FRAME.pack(frame.id | _EXTENDED, len(frame.data), frame.data))
        except BlockingIOError:
            select.select([], [self._socket], [], _WRITABLE_S)
            return 0
        except OSError as error:
            if error.errno != errno.ENOBUFS:
                raise
            time.sleep(FULL_S)
            return 0
        return 1

    def shutdown(self) -> None:
        """Close the bus and its socket."""
        self._bus.shutdown()
