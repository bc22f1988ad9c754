"""SlcanBus: a serial adapter with the slcan protocol, as a python-can bus that handles a saturated bus.

It opens the same channels as python-can's slcan, such as `/dev/ttyACM0`, `COM3@2000000` or a pyserial URL, but reads
in blocks instead of byte by byte, and waits only for adapters that do not respond.
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
"""CAN bit rate of the servos, and of adapters with a fixed rate, bit/s."""

# Opening.
_RESPONSE_S = 0.25
_RESPONSE_SILENT_S = 0.05  # of an adapter that has not responded so far

_AHEAD = 10  # frames that may be queued in the adapter: one ArrayCommand of 15 servos. A stop cannot overtake them
_AHEAD_S = 1.2e-3  # and the bus time they need
_WRITE_S = 0.25  # timeout if the adapter does not accept a single byte
_PAUSE_S = 5e-4
_STUCK_S = 0.75  # lost after this time without progress
_REFUSING_S = 0.3  # continuous refusals for this long are an error, not just a full queue
_POLL_S = 1.0  # how often the flags of an adapter that supports F are requested
_SILENT_S = 2.0  # timeout of that request, if nothing else is received
_NEXT_RATE_S = 1.3  # how long to listen at a guessed rate: a servo without a node ID sends once a second
_LATENCY_MS = 2  # above this, an FTDI chip's latency timer is worth a note


class SlcanBus(can.BusABC):
    """An open slcan adapter: a python-can bus, and an AdapterLink for PythonCanPort.

    Adapters respond differently: with CR, BELL, z, Z, or not at all. A refusal counts, silence does not. Extended data
    frames of classic CAN are received, others counted as ignored. Until valid data arrives from an adapter with a
    guessed baud rate, it listens at one rate after the other.
    """

    max_batch = _AHEAD

    def __init__(
        self,
        channel: str,
        bitrate: int = SERVO_BITRATE,
        *,
        usb: UsbAdapter = UNKNOWN_ADAPTER,
        first_baud: int | None = None,
        wanted: Callable[[], bool] = lambda: True,
        listen_only: bool = False,
        **options: Any,
    ) -> None:
        """Open `channel` (`DEVICE[@BAUD]`) at `bitrate` (bit/s, one of BITRATES). Takes up to four seconds.

        `listen_only`: open the channel with L, so that the adapter neither sends nor acknowledges frames.
        Without BAUD the rate is detected, trying `first_baud` first. `wanted` is polled for whether to continue.
        Raises PortOpenFailed if slcan does not support the bit rate, the adapter refuses a command or the device is not
        an adapter; OSError if the serial port cannot be opened; Abandoned.
        """
        address = f"slcan:{channel}"
        if bitrate not in BITRATES:
            legal = ", ".join(str(rate) for rate in BITRATES)
            raise PortOpenFailed(
                f"slcan does not support {bitrate} bit/s. Supported: {legal}.",
                address=address,
                cause="slcan_bit_rate_unsupported",
                bitrate=bitrate,
            )
        device, baud = split_baud(channel)
        self._rates = _rates(device, baud, usb, first_baud)
        began = time.monotonic()
        self._line = SerialStream(device, self._rates[0])
        self._bitrate = bitrate
        self._opens = b"L" if listen_only else b"O"
        self._own: OwnFrames | None = None
        self._notes: list[Note] = []
        self._responded = False
        self._lines = Lines()
        self._messages: deque[can.Message] = deque()
        self._writing = threading.Lock()
        self._clear_at: Instant = 0.0
        self._backlog = 0
        self._stuck_since: Instant | None = None
        try:
            latency_ms = self._line.reduce_latency()
            found = Search(self._line, address, wanted, opens=self._opens).run(self._rates)
            self.line_info = SerialLineInfo(
                found.baud, found=baud is None and not usb.native_usb, confirmed=found.confirmed,
                native_usb=usb.native_usb, serial_number=usb.serial_number, latency_ms=latency_ms,
            )  # fmt: skip
            self.silent_since: Instant | None = None if found.confirmed else began
            """Since when no valid data has arrived. None if it arrived on opening."""
            self._set_up(address, found)
        except BaseException:
            self._line.close()
            raise
        state = "" if self._reports_flags else ", state not reported"
        self.channel_info = f"slcan on {channel}{state}"
        super().__init__(channel, **options)

    @property
    def notes(self) -> tuple[Note, ...]:
        """Remarks on the adapter."""
        return tuple(self._notes)

    # As an AdapterLink.

    def receive(self, timeout_s: float, not_before: Instant) -> Received:
        """Receive until `not_before`. Raises OSError if the adapter was removed or no longer responds."""
        pause(not_before)
        data = self._line.read(timeout_s)
        now = time.monotonic()
        if data:
            self._received_at = now
        if self._reports_flags and now >= self._poll_at:
            self._request_flags(now)
        got = self._lines.feed(data, now) if data else Received()
        got.line_bytes = len(data)
        if self._own is not None and got.frames:
            own = self._own
            got.frames = [frame for frame in got.frames if not own.take(frame)]
        self._check_refusals(got, now)
        if not self.line_info.confirmed:
            self._continue_search(got, now)
        return got

    def transmit(self, frames: Sequence[Frame]) -> int:
        """Write as many of `frames` at once as the adapter can send soon. Returns their number, which may be 0.

        Returns within a quarter of a second. Raises OSError if the adapter was removed or is stuck.
        """
        now = time.monotonic()
        chosen: list[bytes] = []
        clear_at = max(now, self._clear_at)
        if clear_at - now > _AHEAD_S:  # the bus is still busy with earlier frames
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
            raise OSError(errno.EIO, "it no longer sends frames")
        time.sleep(_PAUSE_S)
        return 0

    def shutdown(self) -> None:
        """Take the adapter off the bus, if it still responds, and close the port."""
        super().shutdown()
        try:
            self._line.write(b"C\r", _WRITE_S)
        except OSError:
            pass
        self._line.close()

    # As a python-can bus.

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Write one extended data frame. Raises CanOperationError for other frames, OSError if the adapter is stuck."""
        if not msg.is_extended_id or msg.is_remote_frame or msg.is_error_frame or msg.is_fd:
            raise can.CanOperationError("This slcan bus sends extended data frames of classic CAN only.")
        frame = Frame(msg.arbitration_id, bytes(msg.data))
        until = time.monotonic() + (_STUCK_S if timeout is None else timeout)
        while not self.transmit([frame]):
            if time.monotonic() >= until:
                raise can.CanOperationError("The slcan adapter did not accept a frame in time.")

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._messages:
            got = self.receive(_POLL_S if timeout is None else timeout, 0.0)
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
        """The file descriptor of the serial port. Raises io.UnsupportedOperation if there is none."""
        return self._line.fileno()

    # Opening.

    def _set_up(self, address: str, found: FoundBaud) -> None:
        self._set_byte_time()
        self._responded = found.responds
        self._response_s = _RESPONSE_SILENT_S if found.silent else _RESPONSE_S
        self._command(b"C")
        rate = BITRATES[self._bitrate]
        if not self._command(rate):
            # Adapters with a fixed bit rate refuse commands to set it. Their rate is that of the servos.
            if self._bitrate != SERVO_BITRATE:
                raise _refused(address, rate, f"the bit rate of {self._bitrate} bit/s")
            self._notes.append(
                Note(
                    "bit_rate_fixed", "The adapter does not accept a CAN bit rate (BELL to S8). Its own rate is used "
                    "and must be 1 Mbit/s.", {"command": rate.decode()},
                )
            )  # fmt: skip
        if not self._command(self._opens):
            raise _refused(address, self._opens, "to open" if self._opens == b"O" else "to open in listen-only mode")
        self._command(b"F")
        self._reports_flags = self._lines.flags > 0
        self._note(found)
        self._lines.reset()  # the flags are those of the time before opening
        self._received_at = time.monotonic()
        self._poll_at = self._received_at + _POLL_S
        self._next_rate_at = self._received_at + _NEXT_RATE_S
        self._refusing = False
        self._restart_at = 0.0

    def _note(self, found: FoundBaud) -> None:
        """Add remarks on the adapter."""
        notes = self._notes
        baud = {"baud": found.baud}
        if not self._responded and not found.echoes:
            text = "The adapter does not respond to commands. It is used anyway."
            notes.append(Note("adapter_silent", text))
        if not found.confirmed:
            text = f"Its baud rate is unknown: no data was received. {found.baud} baud is tried first, then others."
            notes.append(Note("baud_unknown", text, baud))
        if found.echoes:
            self._own = OwnFrames()
            notes.append(Note("adapter_echoes", "The adapter echoes sent frames. Echoes are dropped."))
        if found.noise:
            text = f"{found.noise} invalid bytes were received while opening the adapter. Check its cable."
            notes.append(Note("line_noise", text, {"bytes": found.noise}))
        latency_ms = self.line_info.latency_ms
        if latency_ms is not None and latency_ms > _LATENCY_MS:
            text = f"The latency timer of the FTDI chip is {latency_ms} ms. Set it to 1 ms for faster responses."
            notes.append(Note("latency_timer", text, {"latency_ms": latency_ms}))

    def _command(self, command: bytes) -> bool:
        """Send `command`. Returns False if the adapter refused it. Frames received meanwhile are lost."""
        lines = self._lines
        lines.reset()
        self._write(command + b"\r")
        until = time.monotonic() + self._response_s
        while (left := until - time.monotonic()) > 0 and not (lines.accepted or lines.refused or lines.flags):
            lines.feed(self._line.read(left), 0.0)
        self._responded = self._responded or lines.accepted + lines.refused + lines.flags > 0
        return not lines.refused

    def _set_byte_time(self) -> None:
        rate = self.line_info.bytes_per_s
        self._byte_s = 0.0 if rate is None else 1 / rate

    def _write(self, text: bytes) -> None:
        if not self._line.write(text, _WRITE_S):
            raise OSError(errno.ETIMEDOUT, "it does not accept any data")

    # While it is open.

    def _continue_search(self, got: Received, now: Instant) -> None:
        """Listen at the next rate if no valid data arrived at the current one for some time."""
        if got.frames or got.errors or self._lines.accepted or self._lines.flags:
            self.line_info = replace(self.line_info, confirmed=True)
            self._notes = [note for note in self._notes if note.code != "baud_unknown"]
        elif now >= self._next_rate_at and len(self._rates) > 1:
            rate = self._rates[(self._rates.index(self.line_info.baud) + 1) % len(self._rates)]
            self._next_rate_at = now + _NEXT_RATE_S
            with self._writing:
                if self._line.set_baud(rate):
                    self.line_info = replace(self.line_info, baud=rate)
                    self._set_byte_time()
                    self._line.write(b"\r\rC\r%b\r%b\r" % (BITRATES[self._bitrate], self._opens), 0.0)
                    self._lines = Lines()

    def _room(self) -> int:
        """How many frames may be written before too many are queued where they cannot be overtaken."""
        backlog = self._line.backlog()
        if backlog < self._backlog:
            self._stuck_since = None
        self._backlog = backlog
        return max(0, _AHEAD - backlog // LONGEST)

    def _request_flags(self, now: Instant) -> None:
        """Request the status flags. Raises OSError if nothing was received since the previous request."""
        if now - self._received_at > _SILENT_S:
            raise OSError(errno.EIO, "it no longer responds")
        if self._write_now(b"F\r"):
            self._poll_at = now + _POLL_S

    def _check_refusals(self, got: Received, now: Instant) -> None:
        """Handle an adapter in bus-off, or without a node to acknowledge, which refuses all frames.

        Reopening the channel ends bus-off and drops old frames the adapter may have queued.
        """
        since = self._lines.refused_since
        refusing = since is not None and now - since > _REFUSING_S
        if refusing != self._refusing:
            self._refusing = refusing
            got.errors.append(NOW_PASSIVE if refusing else NOW_ACTIVE)
        restart = b"C\r%b\r%b\r" % (BITRATES[self._bitrate], self._opens)
        if refusing and now >= self._restart_at and self._write_now(restart):
            self._lines.reopening()
            self._restart_at = now + _POLL_S

    def _write_now(self, text: bytes) -> bool:
        """Write `text` unless a frame is being written or the buffer is full."""
        if not self._writing.acquire(blocking=False):
            return False
        try:
            return self._line.write(text, 0.0)
        finally:
            self._writing.release()


def split_baud(channel: str) -> tuple[str, int | None]:
    """Split `DEVICE[@BAUD]`. The baud rate is None if not given."""
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
        f"The adapter at {address} refuses {what}: it responds to {command.decode()} with BELL. {remedy}",
        address=address, remedy=remedy, cause="slcan_setting_refused",
    )  # fmt: skip
