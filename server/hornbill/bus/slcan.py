"""Owns SlcanBus: a serial adapter that speaks slcan, as a python-can bus that keeps up with a full bus.

It opens what python-can's own slcan opens, `/dev/ttyACM0`, `COM3@2000000`, a pyserial URL, but reads all there
is at once where that one reads byte by byte, and waits for the adapter only where it does not answer.
"""

import errno
import threading
import time
from collections import deque
from collections.abc import Sequence
from typing import Any

import can

from hornbill.bus.errorframe import NOW_ACTIVE, NOW_PASSIVE
from hornbill.bus.link import Received, pause
from hornbill.bus.serial_line import SerialLine
from hornbill.bus.slcan_lines import BITRATES, LONGEST, Lines, line_of
from hornbill.errors import PortOpenFailed
from hornbill.units import Instant
from hornbill.wire.bittime import frame_bits
from hornbill.wire.frame import Frame

BAUD = 115_200
"""Bit/s of the serial line when the address names none. Adapters on USB do not care."""

# Opening. An adapter that starts anew when it is opened is deaf for up to two seconds.
_WAKE_S = 2.2
_QUIET_S = 0.03
_ANSWER_S = 0.25

_AHEAD = 10  # frames that may be with the adapter: one ArrayCommand of 15 servos. A stop cannot overtake these
_AHEAD_S = 1.2e-3  # and how long the bus needs for them
_WRITE_S = 0.25  # how long the adapter may refuse to take a single byte
_PAUSE_S = 5e-4
_STUCK_S = 0.75  # after so long without progress it is lost
_REFUSING_S = 0.3  # after so long of nothing but refusals something is wrong, not just a queue full
_ASK_S = 1.0  # how often an adapter that knows F is asked for its flags
_SILENT_S = 2.0  # how long it may leave that unanswered, and say nothing else either


class SlcanBus(can.BusABC):
    """An open slcan adapter: a python-can bus, and a Link for PythonCanPort.

    Adapters differ in what they answer: CR, BELL, z, Z, or nothing at all. A refusal counts, silence does not.
    Received are extended data frames of classic CAN; others are counted as ignored.
    """

    most = _AHEAD

    def __init__(self, channel: str, bitrate: int = 1_000_000, **options: Any) -> None:
        """Open `channel` (`DEVICE[@BAUD]`) at `bitrate` (bit/s, one of BITRATES). Takes up to four seconds.

        Raises PortOpenFailed when slcan has no such bit rate or the adapter refuses a command, OSError when
        the serial port cannot be opened.
        """
        address = f"slcan:{channel}"
        if bitrate not in BITRATES:
            legal = ", ".join(str(rate) for rate in BITRATES)
            raise PortOpenFailed(f"slcan has no bit rate of {bitrate} bit/s. It has: {legal}.", address=address)
        device, _, baud = channel.rpartition("@")
        named = device and baud.isdecimal()
        self._line = SerialLine(device if named else channel, int(baud) if named else BAUD)
        self._bitrate = bitrate
        self._lines = Lines()
        self._messages: deque[can.Message] = deque()
        self._writing = threading.Lock()
        self._clear_at: Instant = 0.0
        self._backlog = 0
        self._stuck_since: Instant | None = None
        try:
            self._set_up(address)
        except BaseException:
            self._line.close()
            raise
        told = "" if self._tells else ", its state is not told"
        self.channel_info = f"slcan on {channel}{told}"
        super().__init__(channel, **options)

    # As a Link.

    def receive(self, timeout_s: float, not_before: Instant) -> Received:
        """All the adapter has said by `not_before`. Raises OSError when it is gone or has fallen silent."""
        pause(not_before)
        data = self._line.read(timeout_s)
        now = time.monotonic()
        if data:
            self._heard_at = now
        if self._tells and now >= self._ask_at:
            self._ask(now)
        got = self._lines.feed(data, now) if data else Received()
        self._mind_refusals(got, now)
        return got

    def transmit(self, frames: Sequence[Frame]) -> int:
        """Write as many of `frames` as the adapter can pass on soon, in one go; zero when that is none.

        Returns within a quarter of a second. Raises OSError when the adapter is gone or stuck.
        """
        now = time.monotonic()
        chosen: list[bytes] = []
        clear_at = max(now, self._clear_at)
        if clear_at - now > _AHEAD_S:  # the bus is still busy with what was written before
            time.sleep(_PAUSE_S)
            return 0
        for frame in frames[: self._room()]:
            if clear_at - now > _AHEAD_S:
                break
            chosen.append(line_of(frame))
            clear_at += frame_bits(frame) / self._bitrate
        if chosen:
            with self._writing:
                written = self._line.write(b"".join(chosen), _WRITE_S)
            if written:
                self._clear_at, self._stuck_since = clear_at, None
                return len(chosen)
        if self._stuck_since is None:
            self._stuck_since = now
        elif now - self._stuck_since > _STUCK_S:
            raise OSError(errno.EIO, "it passes nothing on any more")
        time.sleep(_PAUSE_S)
        return 0

    def shutdown(self) -> None:
        """Take the adapter off the bus, if it still listens, and close the port."""
        super().shutdown()
        try:
            self._line.write(b"C\r", _WRITE_S)
        except OSError:
            pass
        self._line.close()

    # As a python-can bus.

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Write one extended data frame. Raises CanOperationError for any other, OSError when the adapter is stuck."""
        if not msg.is_extended_id or msg.is_remote_frame or msg.is_error_frame or msg.is_fd:
            raise can.CanOperationError("This slcan bus sends extended data frames of classic CAN only.")
        frame = Frame(msg.arbitration_id, bytes(msg.data))
        until = time.monotonic() + (_STUCK_S if timeout is None else timeout)
        while not self.transmit([frame]):
            if time.monotonic() >= until:
                raise can.CanOperationError("The slcan adapter did not take a frame in time.")

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._messages:
            got = self.receive(_ASK_S if timeout is None else timeout, 0.0)
            now = time.time()
            self._messages.extend(
                can.Message(timestamp=now, arbitration_id=error, is_error_frame=True, dlc=len(data), data=data)
                for error, data in got.errors
            )
            self._messages.extend(
                can.Message(timestamp=now, arbitration_id=frame.id, data=frame.data) for frame in got.frames
            )
        return (self._messages.popleft() if self._messages else None), False

    def fileno(self) -> int:
        """The descriptor of the serial port. Raises io.UnsupportedOperation where there is none."""
        return self._line.fileno()

    # Opening.

    def _set_up(self, address: str) -> None:
        self._wake()
        for command, what in ((BITRATES[self._bitrate], f"the bit rate of {self._bitrate} bit/s"), (b"O", "to open")):
            if not self._command(command):
                raise PortOpenFailed(
                    f"The adapter at {address} refuses {what}: it answers {command.decode()} with BELL. "
                    "Unplug it, plug it in again and retry.",
                    address=address,
                )
        self._command(b"F")
        self._tells = self._lines.told > 0
        self._lines.forget()  # the flags tell of what was before us
        self._heard_at = time.monotonic()
        self._ask_at = self._heard_at + _ASK_S
        self._refusing = False
        self._restart_at = 0.0

    def _wake(self) -> None:
        """Close the channel, ask for the version, and wait until the adapter has said what it has to say.

        The empty lines end what another program may have left half said.
        """
        until = time.monotonic() + _WAKE_S
        while time.monotonic() < until:
            self._say(b"\r\rC\rV\r")
            if self._line.read(_ANSWER_S):
                quiet_by = time.monotonic() + _ANSWER_S
                while self._line.read(_QUIET_S) and time.monotonic() < quiet_by:
                    pass
                return

    def _command(self, command: bytes) -> bool:
        """Whether the adapter took `command`: it said so, or said nothing. Frames that come meanwhile are gone."""
        lines = self._lines
        lines.forget()
        self._say(command + b"\r")
        until = time.monotonic() + _ANSWER_S
        while (left := until - time.monotonic()) > 0 and not (lines.accepted or lines.refused or lines.told):
            lines.feed(self._line.read(left), 0.0)
        return not lines.refused

    def _say(self, text: bytes) -> None:
        if not self._line.write(text, _WRITE_S):
            raise OSError(errno.EIO, "it takes nothing, not one byte")

    # While it is open.

    def _room(self) -> int:
        """How many frames may be written before too many wait where nothing can overtake them."""
        backlog = self._line.backlog()
        if backlog < self._backlog:
            self._stuck_since = None
        self._backlog = backlog
        return max(0, _AHEAD - backlog // LONGEST)

    def _ask(self, now: Instant) -> None:
        """Ask for the status flags. Raises OSError when it has not said anything since it was asked before."""
        if now - self._heard_at > _SILENT_S:
            raise OSError(errno.EIO, "it answers no more")
        if self._tell(b"F\r"):
            self._ask_at = now + _ASK_S

    def _mind_refusals(self, got: Received, now: Instant) -> None:
        """An adapter that is off the bus, or has nobody there to acknowledge, refuses frame after frame.

        Opening the channel anew brings it back on the bus, and drops the old frames it may still hold.
        """
        since = self._lines.refused_since
        refusing = since is not None and now - since > _REFUSING_S
        if refusing != self._refusing:
            self._refusing = refusing
            got.errors.append(NOW_PASSIVE if refusing else NOW_ACTIVE)
        if refusing and now >= self._restart_at and self._tell(b"C\r%b\rO\r" % BITRATES[self._bitrate]):
            self._lines.awaited = 3
            self._restart_at = now + _ASK_S

    def _tell(self, text: bytes) -> bool:
        """Write `text` unless a frame is being written or there is no room for it just now."""
        if not self._writing.acquire(blocking=False):
            return False
        try:
            return self._line.write(text, 0.0)
        finally:
            self._writing.release()
