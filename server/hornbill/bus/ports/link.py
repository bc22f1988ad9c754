"""AdapterLink: batches of frames to and from an adapter; MessageLink, for any python-can bus."""

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
"""The pause when a driver's queue is full: about seven frames."""

_SEND_S = 0.25  # how long an adapter may take one frame
_GARBLED_IN_A_ROW = 100
_OLDEST_S = 1.0  # beyond this age a stamp is not of the wall clock
_UNSURE_S = 0.001  # how far two clocks may drift apart until they are compared again
_COMPARED_EVERY_S = 1.0
_LINUX_ERRORS = ("socketcan", "gs_usb", "candle")  # the interfaces that code error frames as ErrorFrame does
_RETURNING = ("udp_multicast",)  # the interfaces that return what was sent, and do not say so
_OWN_KEPT = 2048
_OWN_S = 1.0


@dataclass(slots=True)
class Received:
    """What came in one go. Empty when nothing came in time."""

    frames: list[Frame] = field(default_factory=list[Frame])
    errors: list[ErrorFrame] = field(default_factory=list[ErrorFrame])
    ignored: int = 0
    """Standard, remote and CAN FD frames."""
    garbled: int = 0
    """What could not be understood."""
    refused: int = 0
    """Frames of ours that the adapter took and then refused to send."""
    lost: int = 0
    """Frames the kernel had no room to keep for us."""
    line_bytes: int = 0
    """Bytes that came over a serial line."""

    def __bool__(self) -> bool:
        return bool(
            self.frames or self.errors or self.ignored or self.garbled or self.refused or self.lost or self.line_bytes
        )


class AdapterLink(Protocol):
    """An open adapter. One thread receives and another transmits; whatever either raises means it is lost,
    but for a CanError of `transmit`: the adapter refused the first of the frames.
    """

    most: int
    """How many frames may be handed to `transmit` at once: what it took can no longer be overtaken."""

    def receive(self, timeout_s: float, not_before: Instant) -> Received:
        """Everything there is by `not_before`; waits up to `timeout_s` seconds from then on for the first of it."""
        ...

    def transmit(self, frames: Sequence[Frame]) -> int:
        """Pass on `frames`, in turn, and tell how many were taken. Zero, after a short wait: none just now."""
        ...

    def shutdown(self) -> None:
        """Let go of the adapter. Called once, when no other call is under way."""
        ...


def pause(until: Instant) -> None:
    """Sleep until that instant, unless it is past."""
    left = until - time.monotonic()
    if left > 0:
        time.sleep(left)


class OwnFrames:
    """Frames that were sent lately, to tell what an adapter returns of them from frames of others.

    Sent on one thread and received on another. Each frame sent accounts for one that comes back within a second.
    """

    def __init__(self) -> None:
        self._sent: deque[tuple[int, bytes, Instant]] = deque(maxlen=_OWN_KEPT)
        self._lock = threading.Lock()

    def sent(self, frames: Sequence[Frame]) -> None:
        """Remember `frames`; call it before they leave."""
        now = time.monotonic()
        with self._lock:
            self._sent.extend((frame.id, bytes(frame.data), now) for frame in frames)

    def take(self, frame: Frame) -> bool:
        """Whether `frame` is one of ours that came back."""
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
    """Puts the wall-clock stamps of frames on time.monotonic, never backwards."""

    def __init__(self) -> None:
        self._latest: Instant = 0.0
        self._ahead = 0.0
        self._compared: Instant | None = None

    def instant(self, stamp: float) -> Instant:
        """`stamp` (seconds since 1970) as an instant; now, for an adapter with a clock of its own or none."""
        now = time.monotonic()
        if self._compared is None or now - self._compared > _COMPARED_EVERY_S:
            # Not for every frame: a look at a clock is a system call on some machines.
            self._ahead, self._compared = clocks.ahead(), now
        age = now - (stamp - self._ahead)
        self._latest = max(self._latest, now - max(age, 0.0) if -_UNSURE_S < age < _OLDEST_S else now)
        return self._latest


class MessageLink:
    """An AdapterLink through `recv` and `send` of a python-can bus: one frame at a time: not every driver can poll."""

    most = 1

    def __init__(self, bus: can.BusABC, interface: str) -> None:
        self._bus = bus
        self._linux_errors = interface in _LINUX_ERRORS
        # SocketCAN calls frames of other programs on this machine sent as well; its own it does not repeat.
        self._repeats_own = interface != "socketcan"
        self._own = OwnFrames() if interface in _RETURNING else None
        self._stamps = Stamps()
        self._garbled = 0

    def receive(self, timeout_s: float, not_before: Instant) -> Received:
        """What comes by `not_before`, at least one frame. Raises what the driver raises when the adapter is lost."""
        got = Received()
        came = self._one(got, timeout_s)
        while came and (left := not_before - time.monotonic()) > 0:
            came = self._one(got, left)
        return got

    def transmit(self, frames: Sequence[Frame]) -> int:
        """Send the first of `frames`. Raises CanError when the adapter refuses it."""
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
        """Add one message to `got`; whether there was one. Some it chokes on are put up with."""
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
        elif self._repeats_own and not message.is_rx:
            pass
        elif not message.is_extended_id or message.is_remote_frame or message.is_fd:
            got.ignored += 1
        else:
            frame = Frame(message.arbitration_id, bytes(message.data), self._stamps.instant(message.timestamp))
            if self._own is None or not self._own.take(frame):
                got.frames.append(frame)
        return True


def _is_garbled(error: Exception) -> bool:
    """Whether an adapter's driver choked on one message, rather than lost the adapter."""
    return isinstance(error if not isinstance(error, can.CanError) else error.__cause__, ValueError | IndexError)
