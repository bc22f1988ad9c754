"""SlcanBus: a serial adapter that speaks slcan, as a python-can bus that keeps up with a full bus.

It opens what python-can's own slcan opens, `/dev/ttyACM0`, `COM3@2000000`, a pyserial URL, but reads all there
is at once where that one reads byte by byte, and waits for the adapter only where it does not answer.
"""

import errno
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import can

from hornbill.bus.adapters.serial_ports import UNKNOWN_ADAPTER, UsbAdapter
from hornbill.bus.ports.baud import RATES, FoundBaud, Search
from hornbill.bus.ports.errorframe import NOW_ACTIVE, NOW_PASSIVE
from hornbill.bus.ports.link import OwnFrames, Received, pause
from hornbill.bus.ports.serial_line import SerialStream
from hornbill.bus.ports.slcan_lines import BITRATES, LONGEST, Lines, line_of
from hornbill.errors import PortOpenFailed
from hornbill.units import Instant
from hornbill.wire.bittime import frame_bits
from hornbill.wire.frame import Frame
from hornbill.wire.port import Note, SerialLineInfo, line_bytes

SERVO_BITRATE = 1_000_000
"""CAN bit/s of the servos, and of the adapters that know no other."""

# Opening.
_ANSWER_S = 0.25
_ANSWER_SILENT_S = 0.05  # of an adapter that has answered nothing so far

_AHEAD = 10  # frames that may be with the adapter: one ArrayCommand of 15 servos. A stop cannot overtake these
_AHEAD_S = 1.2e-3  # and how long the bus needs for them
_WRITE_S = 0.25  # how long the adapter may refuse to take a single byte
_PAUSE_S = 5e-4
_STUCK_S = 0.75  # after so long without progress it is lost
_REFUSING_S = 0.3  # after so long of nothing but refusals something is wrong, not just a queue full
_ASK_S = 1.0  # how often an adapter that knows F is asked for its flags
_SILENT_S = 2.0  # how long it may leave that unanswered, and say nothing else either
_NEXT_RATE_S = 1.3  # how long a rate that is a guess is listened at: a servo without a node ID speaks once a second
_LATENCY_MS = 2  # above this, an FTDI chip's latency timer is worth a note


class SlcanBus(can.BusABC):
    """An open slcan adapter: a python-can bus, and a Link for PythonCanPort.

    Adapters differ in what they answer: CR, BELL, z, Z, or nothing at all. A refusal counts, silence does not.
    Received are extended data frames of classic CAN; others are counted as ignored. While nothing well-formed has
    come from an adapter whose baud rate is a guess, it is listened to at one rate after the other.
    """

    most = _AHEAD

    def __init__(
        self,
        channel: str,
        bitrate: int = SERVO_BITRATE,
        *,
        usb: UsbAdapter = UNKNOWN_ADAPTER,
        first_baud: int | None = None,
        wanted: Callable[[], bool] = lambda: True,
        **options: Any,
    ) -> None:
        """Open `channel` (`DEVICE[@BAUD]`) at `bitrate` (bit/s, one of BITRATES). Takes up to four seconds.

        Without BAUD it is found: `first_baud` is tried first. `wanted` is asked meanwhile whether to go on.
        Raises PortOpenFailed when slcan has no such bit rate, the adapter refuses a command or the device is no
        adapter; OSError when the serial port cannot be opened; Abandoned.
        """
        address = f"slcan:{channel}"
        if bitrate not in BITRATES:
            legal = ", ".join(str(rate) for rate in BITRATES)
            raise PortOpenFailed(
                f"slcan has no bit rate of {bitrate} bit/s. It has: {legal}.",
                address=address,
                cause="no_slcan_rate",
                bitrate=bitrate,
            )
        device, baud = split_baud(channel)
        self._rates = _rates(device, baud, usb, first_baud)
        began = time.monotonic()
        self._line = SerialStream(device, self._rates[0])
        self._bitrate = bitrate
        self._own: OwnFrames | None = None
        self._notes: list[Note] = []
        self._answered = False
        self._lines = Lines()
        self._messages: deque[can.Message] = deque()
        self._writing = threading.Lock()
        self._clear_at: Instant = 0.0
        self._backlog = 0
        self._stuck_since: Instant | None = None
        try:
            latency_ms = self._line.reduce_latency()
            found = Search(self._line, address, wanted).run(self._rates)
            self.line_info = SerialLineInfo(
                found.baud, found=baud is None and not usb.native_usb, confirmed=found.confirmed,
                native_usb=usb.native_usb, serial_number=usb.serial_number, latency_ms=latency_ms,
            )  # fmt: skip
            self.silent_since: Instant | None = None if found.confirmed else began
            """Since when nothing well-formed has come, where that was so when it was opened."""
            self._set_up(address, found)
        except BaseException:
            self._line.close()
            raise
        told = "" if self._tells else ", its state is not told"
        self.channel_info = f"slcan on {channel}{told}"
        super().__init__(channel, **options)

    @property
    def notes(self) -> tuple[Note, ...]:
        """What is unusual about the adapter."""
        return tuple(self._notes)

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
        got.line_bytes = len(data)
        if self._own is not None and got.frames:
            own = self._own
            got.frames = [frame for frame in got.frames if not own.take(frame)]
        self._mind_refusals(got, now)
        if not self.line_info.confirmed:
            self._go_on_searching(got, now)
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
            clear_at += max(frame_bits(frame) / self._bitrate, line_bytes(frame) * self._byte_s)
        if chosen:
            if self._own is not None:
                self._own.sent(frames[: len(chosen)])
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

    def _set_up(self, address: str, found: FoundBaud) -> None:
        self._set_byte_time()
        self._answered = found.answers
        self._answer_s = _ANSWER_SILENT_S if found.silent else _ANSWER_S
        self._command(b"C")
        rate = BITRATES[self._bitrate]
        if not self._command(rate):
            # Adapters that know one bit rate refuse any other command for it. The servos' is what they know.
            if self._bitrate != SERVO_BITRATE:
                raise _refused(address, rate, f"the bit rate of {self._bitrate} bit/s")
            self._notes.append(
                Note(
                    "bit_rate_fixed", "The adapter does not accept a CAN bit rate (BELL to S8). It is used at its own, "
                    "which must be 1 Mbit/s.", {"command": rate.decode()},
                )
            )  # fmt: skip
        if not self._command(b"O"):
            raise _refused(address, b"O", "to open")
        self._command(b"F")
        self._tells = self._lines.told > 0
        self._note(found)
        self._lines.forget()  # the flags tell of what was before us
        self._heard_at = time.monotonic()
        self._ask_at = self._heard_at + _ASK_S
        self._next_rate_at = self._heard_at + _NEXT_RATE_S
        self._refusing = False
        self._restart_at = 0.0

    def _note(self, found: FoundBaud) -> None:
        """Note what is unusual."""
        notes = self._notes
        baud = {"baud": found.baud}
        if not self._answered and not found.echoes:
            text = "The adapter answers no command. It is used all the same."
            notes.append(Note("adapter_silent", text))
        if not found.confirmed:
            text = f"Its baud rate is not known: nothing was received. {found.baud} baud is tried first, others follow."
            notes.append(Note("baud_unknown", text, baud))
        if found.echoes:
            self._own = OwnFrames()
            notes.append(Note("adapter_echoes", "The adapter returns what it is sent. Returned frames are dropped."))
        if found.noise:
            text = f"{found.noise} unreadable bytes were received while the adapter was opened. Check its cable."
            notes.append(Note("line_noise", text, {"bytes": found.noise}))
        latency_ms = self.line_info.latency_ms
        if latency_ms is not None and latency_ms > _LATENCY_MS:
            text = f"The latency timer of the FTDI chip is {latency_ms} ms. Set it to 1 ms for faster answers."
            notes.append(Note("latency_timer", text, {"latency_ms": latency_ms}))

    def _command(self, command: bytes) -> bool:
        """Whether the adapter took `command`: it said so, or said nothing. Frames that come meanwhile are gone."""
        lines = self._lines
        lines.forget()
        self._say(command + b"\r")
        until = time.monotonic() + self._answer_s
        while (left := until - time.monotonic()) > 0 and not (lines.accepted or lines.refused or lines.told):
            lines.feed(self._line.read(left), 0.0)
        self._answered = self._answered or lines.accepted + lines.refused + lines.told > 0
        return not lines.refused

    def _set_byte_time(self) -> None:
        rate = self.line_info.bytes_per_s
        self._byte_s = 0.0 if rate is None else 1 / rate

    def _say(self, text: bytes) -> None:
        if not self._line.write(text, _WRITE_S):
            raise OSError(errno.ETIMEDOUT, "it takes nothing, not one byte")

    # While it is open.

    def _go_on_searching(self, got: Received, now: Instant) -> None:
        """Listen at the next rate once the present one has brought nothing for a while."""
        if got.frames or got.errors or self._lines.accepted or self._lines.told:
            self.line_info = replace(self.line_info, confirmed=True)
            self._notes = [note for note in self._notes if note.code != "baud_unknown"]
        elif now >= self._next_rate_at and len(self._rates) > 1:
            rate = self._rates[(self._rates.index(self.line_info.baud) + 1) % len(self._rates)]
            self._next_rate_at = now + _NEXT_RATE_S
            with self._writing:
                if self._line.set_baud(rate):
                    self.line_info = replace(self.line_info, baud=rate)
                    self._set_byte_time()
                    self._line.write(b"\r\rC\r%b\rO\r" % BITRATES[self._bitrate], 0.0)
                    self._lines = Lines()

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


def split_baud(channel: str) -> tuple[str, int | None]:
    """The device of `DEVICE[@BAUD]`, and its baud rate where one is given."""
    device, _, baud = channel.rpartition("@")
    return (device, int(baud)) if device and baud.isdecimal() else (channel, None)


def _rates(device: str, baud: int | None, usb: UsbAdapter, first: int | None) -> tuple[int, ...]:
    """The baud rates to try, in order."""
    if baud is not None:
        return (baud,)
    if usb.native_usb or "://" in device:
        return RATES[:1]
    return RATES if first is None else (first, *(rate for rate in RATES if rate != first))


def _refused(address: str, command: bytes, what: str) -> PortOpenFailed:
    remedy = "Unplug it, plug it in again and retry."
    return PortOpenFailed(
        f"The adapter at {address} refuses {what}: it answers {command.decode()} with BELL. {remedy}",
        address=address, remedy=remedy, cause="slcan_refuses",
    )  # fmt: skip
