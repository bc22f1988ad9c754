"""AdapterLink: batches of frames to and from an adapter; MessageLink: for any python-can bus."""

import errno
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import can

from hornbill import clocks
from hornbill.bus.ports.errorframe import ErrorFrame
from hornbill.units import Instant
from hornbill.wire.frame import Frame

FULL_S = 0.001
"""Pause if a driver's queue is full: about seven frames."""

_SEND_S = 0.25  # timeout of sending one frame
_GARBLED_IN_A_ROW = 100
_OLDEST_S = 1.0  # an older time stamp is not from the wall clock
_UNSURE_S = 0.001  # drift of two clocks between comparisons
_COMPARED_EVERY_S = 1.0
_LINUX_ERRORS = ("socketcan", "gs_usb", "candle")  # interfaces with error frames coded as in ErrorFrame
_RETURNING = ("udp_multicast",)  # interfaces that return sent frames unmarked
_OWN_LIMIT = 2048
_OWN_S = 1.0


@dataclass(slots=True)
class Received:
    """One received batch. Empty after a timeout."""

    frames: list[Frame] = field(default_factory=list[Frame])
    errors: list[ErrorFrame] = field(default_factory=list[ErrorFrame])
    ignored: int = 0
    """Standard, remote and CAN FD frames."""
    garbled: int = 0
    """Invalid messages."""
    refused: int = 0
    """Our frames that the adapter accepted and then refused to send."""
    lost: int = 0
    """Frames the kernel dropped for lack of buffer space."""
    line_bytes: int = 0
    """Bytes received over a serial line."""

    def __bool__(self) -> bool:
        return bool(
            self.frames or self.errors or self.ignored or self.garbled or self.refused or self.lost or self.line_bytes
        )


class AdapterLink(Protocol):
    """An open adapter. One thread receives and another transmits. Any exception means that the adapter is lost, except
    a CanError of `transmit`: the adapter refused the first of the frames.
    """

    max_batch: int
    """Maximum number of frames per `transmit`. Accepted frames can no longer be overtaken."""

    def receive(self, timeout_s: float, not_before: Instant) -> Received:
        """Receive everything until `not_before`, then wait up to `timeout_s` seconds if nothing arrived."""
        ...

    def transmit(self, frames: Sequence[Frame]) -> int:
        """Send `frames` in order. Returns the number accepted; 0, after a short wait, if none now."""
        ...

    def shutdown(self) -> None:
        """Release the adapter. Called once, while no other call is active."""
        ...


def pause(until: Instant) -> None:
    """Sleep until `until`."""
    left = until - time.monotonic()
    if left > 0:
        time.sleep(left)


class OwnFrames:
    """Recently sent frames, to distinguish echoes of an adapter from frames of other nodes.

    Thread-safe: one thread sends, another receives. Each sent frame matches one echo within a second.
    """

    def __init__(self) -> None:
        self._sent: deque[tuple[int, bytes, Instant]] = deque(maxlen=_OWN_LIMIT)
        self._lock = threading.Lock()

    def sent(self, frames: Sequence[Frame]) -> None:
        """Record `frames`. Call it before sending them."""
        now = time.monotonic()
        with self._lock:
            self._sent.extend((frame.id, bytes(frame.data), now) for frame in frames)

    def take(self, frame: Frame) -> bool:
        """Whether `frame` is an echo. Each record matches once."""
        since = time.monotonic() - _OWN_S
        with self._lock:
            while self._sent and self._sent[0][2] < since:
                self._sent.popleft()
            for at, (can_id, data, _) in enumerate(self._sent):
                if can_id == frame.id and data == frame.data:
                    del self._sent[at]
                    return True
        return False


class Stamps:
    """Converts wall-clock time stamps of frames to time.monotonic. Never goes backwards."""

    def __init__(self) -> None:
        self._latest: Instant = 0.0
        self._ahead = 0.0
        self._compared: Instant | None = None

    def instant(self, stamp: float) -> Instant:
        """Convert `stamp` (seconds since 1970). Returns now if the adapter uses another clock or none."""
        now = time.monotonic()
        if self._compared is None or now - self._compared > _COMPARED_EVERY_S:
            # Not for every frame: reading a clock is a system call on some computers.
            self._ahead, self._compared = clocks.ahead(), now
        age = now - (stamp - self._ahead)
        self._latest = max(self._latest, now - max(age, 0.0) if -_UNSURE_S < age < _OLDEST_S else now)
        return self._latest


class MessageLink:
    """An AdapterLink using `recv` and `send` of a python-can bus, one frame at a time: not every driver can poll."""

    max_batch = 1

    def __init__(self, bus: can.BusABC, interface: str) -> None:
        self._bus = bus
        self._linux_errors = interface in _LINUX_ERRORS
        # SocketCAN marks frames of other programs on this computer as sent, too, and does not return its own.
        self._returns_own = interface != "socketcan"
        self._own = OwnFrames() if interface in _RETURNING else None
        self._stamps = Stamps()
        self._garbled = 0

    def receive(self, timeout_s: float, not_before: Instant) -> Received:
        """Receive until `not_before`, at least one frame. Raises the driver's errors if the adapter is lost."""
        got = Received()
        came = self._one(got, timeout_s)
        while came and (left := not_before - time.monotonic()) > 0:
            came = self._one(got, left)
        return got

    def transmit(self, frames: Sequence[Frame]) -> int:
        """Send the first of `frames`. Raises CanError if the adapter refuses it."""
        frame = frames[0]
        if self._own is not None:
            self._own.sent(frames[:1])
        try:
            self._bus.send(can.Message(arbitration_id=frame.id, data=frame.data), timeout=_SEND_S)
        except can.CanError as error:
            if error.error_code != errno.ENOBUFS:
                raise
            time.sleep(FULL_S)
            return 0
        return 1

    def shutdown(self) -> None:
        """Close the bus."""
        self._bus.shutdown()

    def _one(self, got: Received, timeout_s: float) -> bool:
        """Add one message to `got`. Returns whether there was one. Tolerates some messages the driver cannot parse."""
        try:
            message = self._bus.recv(timeout_s)
        except Exception as error:
            self._garbled += 1
            if not _is_garbled(error) or self._garbled > _GARBLED_IN_A_ROW:
                raise
            got.garbled += 1
            return True
        if message is None:
            return False
        self._garbled = 0
        if message.is_error_frame:
            known = self._linux_errors
            got.errors.append(ErrorFrame(message.arbitration_id, bytes(message.data)) if known else ErrorFrame())
        elif self._returns_own and not message.is_rx:
            pass
        elif not message.is_extended_id or message.is_remote_frame or message.is_fd:
            got.ignored += 1
        else:
            frame = Frame(message.arbitration_id, bytes(message.data), self._stamps.instant(message.timestamp))
            if self._own is None or not self._own.take(frame):
                got.frames.append(frame)
        return True


def _is_garbled(error: Exception) -> bool:
    """Whether the driver failed to parse one message, rather than lost the adapter."""
    return isinstance(error if not isinstance(error, can.CanError) else error.__cause__, ValueError | IndexError)
