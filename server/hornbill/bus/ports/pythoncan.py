"""PythonCanPort: a CanPort on a python-can bus, with a receive and a transmit thread."""

import asyncio
import logging
import socket
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import can

from hornbill.bus.ports.link import AdapterLink, MessageLink, Received
from hornbill.bus.ports.mavcan import MavcanLink
from hornbill.bus.ports.rawcan import RawLink
from hornbill.bus.ports.slcan import SlcanBus
from hornbill.bus.transmit import QueuedFrame, TransmitQueue, check
from hornbill.errors import BusDisconnected, PortError
from hornbill.units import Instant
from hornbill.wire.bittime import frame_bits
from hornbill.wire.frame import Frame
from hornbill.wire.port import FrameSink, Note, PortDetails, PortState, PortStatistics

RX_LIMIT = 8192
"""Frames buffered for a busy event loop: one second of a saturated bus."""

STALE_S = 1.0
"""A frame that could not be sent within this time is dropped: a command queued while a cable is broken must not move a
servo once it is repaired."""

NOTHING_S = 3.0
"""How long a bus may be silent after opening before it is reported as a problem: a servo sends at least once a second.
Includes the time of the search for a baud rate."""

_POLL_S = 0.05  # how soon the receive thread notices a stop
_GATHER_S = 5e-4  # while frames arrive in quick succession, the loop is woken once per this time
_CLOSE_BY_S = 1e-3
_CLOSE_S = 3.0

_CHECK_BUS = "Check the power of the servos, CAN_H, CAN_L, ground and the termination (120 Ω at both ends)."

_log = logging.getLogger(__name__)


class PythonCanPort:
    """A CanPort on an open python-can bus, which it owns. Created on the event loop by `open_port`.

    Threads access the loop only through call_soon_threadsafe, once per burst of frames. Time stamps are those of
    time.monotonic, the clock of asyncio's and uvloop's loops; a JumpingLoop cannot drive real threads.
    When a thread fails, the state is LOST, the queue is dropped and the adapter is released.
    """

    def __init__(
        self,
        bus: can.BusABC | AdapterLink,
        *,
        address: str,
        bitrate: int,
        statistics: PortStatistics | None = None,
        on_baud: Callable[[str, int], None] = lambda _serial_number, _baud: None,
    ) -> None:
        """`statistics` are those of the port this one replaces; they continue.

        `on_baud` is called on the loop with the USB serial number and the baud rate of a serial adapter once valid data
        was received at that rate.
        """
        self.address = address
        self.bitrate = bitrate
        self.statistics = PortStatistics() if statistics is None else statistics
        self.sample_point: float | None = None
        self.listen_only = False
        self.notes: tuple[Note, ...] = ()
        """Remarks in addition to those of the adapter."""
        self.retry_in_s: float | None = None
        self._link = _link(bus, address)
        self._slcan = bus if isinstance(bus, SlcanBus) else None
        self._on_baud = on_baud
        self._baud_reported = False
        self._loop = asyncio.get_running_loop()
        self._sink: FrameSink | None = None
        self._state = PortState.ACTIVE
        silent_since = None if self._slcan is None else self._slcan.silent_since
        self._silent_since: Instant = time.monotonic() if silent_since is None else silent_since
        self._received_any = False
        self._why = ""
        self._closed = False
        # One lock for the inbox, the queue, the statistics and `_stopping`.
        self._work = threading.Condition()
        self._inbox: list[Frame] = []
        self._queue = TransmitQueue()
        self._stopping = False
        self._running = 2
        self._released = asyncio.Event()
        self._threads = [
            threading.Thread(target=self._run_thread, args=(part,), name=f"{address} {name}", daemon=True)
            for name, part in (("receive", self._receive), ("transmit", self._transmit))
        ]
        for thread in self._threads:
            thread.start()

    @property
    def state(self) -> PortState:
        """Passive and bus-off are reported only by SocketCAN, candleLight and some slcan adapters.

        Also PASSIVE if no frame has been received within NOTHING_S of opening.
        """
        if self._closed:
            return PortState.DISCONNECTED
        return PortState.PASSIVE if self._state is PortState.ACTIVE and self._nothing_received else self._state

    @property
    def details(self) -> PortDetails:
        """Serial line and notes of the adapter."""
        link = self._link
        plain = PortDetails(notes=self.notes)
        if isinstance(link, SlcanBus):
            plain = PortDetails(link.line_info, link.notes)
        elif isinstance(link, MavcanLink):
            plain = PortDetails(link.line_info, self.notes, round_trip_s=link.round_trip_s)
        return replace(
            plain,
            listen_only=self.listen_only,
            nothing_received=not self._closed and self._state is not PortState.LOST and self._nothing_received,
        )

    @property
    def _nothing_received(self) -> bool:
        return not self._received_any and time.monotonic() - self._silent_since >= NOTHING_S

    @property
    def trouble(self) -> PortError | None:
        """Problem of the adapter or its bus, and the remedy. None while it works."""
        match self.state:
            case PortState.LOST:
                text = f"{self.address} was lost: {self._why}. Check the adapter and its cable."
                return PortError(text, cause="adapter_lost", address=self.address)
            case PortState.BUS_OFF:
                return PortError(
                    f"{self.address} is in bus-off after too many errors. Check the bit rate ({self.bitrate} bit/s), "
                    "wiring and termination, then connect again.",
                    cause="bus_off", address=self.address, bitrate=self.bitrate,
                )  # fmt: skip
            case PortState.PASSIVE if self._state is PortState.ACTIVE:
                return self._nothing_received_error()
            case PortState.PASSIVE:
                return PortError(
                    f"{self.address} sees too many errors, or no node acknowledges its frames. "
                    f"Check the power of the servos, the bit rate ({self.bitrate} bit/s), wiring and termination.",
                    cause="too_many_errors", address=self.address, bitrate=self.bitrate,
                )  # fmt: skip
            case _:
                return None

    def listen(self, sink: FrameSink) -> None:
        """Deliver received frames to `sink`. Frames received before the first call are lost."""
        self._sink = sink

    def send(self, frames: Sequence[Frame]) -> None:
        """Queue `frames` for the transmit thread, lowest identifier first.

        Raises BusDisconnected if the port is closed or lost, and ValueError for an invalid frame. Frames refused by the
        adapter or not sent within STALE_S are counted as errors.
        """
        if self._closed:
            raise BusDisconnected(
                f"{self.address} is closed. Connect the bus again.", cause="port_closed", address=self.address
            )
        if self._state is PortState.LOST:
            trouble = self.trouble
            assert trouble is not None
            facts: dict[str, Any] = {"cause": "bus_not_connected", **trouble.facts}
            raise BusDisconnected(f"{trouble.detail} Then connect again.", **facts)
        check(frames)
        now = time.monotonic()
        with self._work:
            for frame in frames:
                self.statistics.errors += self._queue.put(frame, now)
            self._work.notify()

    async def close(self) -> None:
        """Stop both threads and release the adapter, within a fraction of a second unless its driver hangs."""
        self._closed = True
        self._sink = None
        self._stop()
        try:
            async with asyncio.timeout(_CLOSE_S):
                await self._released.wait()
        except TimeoutError:
            _log.warning("%s did not close within %g s and is abandoned", self.address, _CLOSE_S)
            return
        for thread in self._threads:
            thread.join()  # it is about to return

    def _nothing_received_error(self) -> PortError:
        """Problem and remedy if no frame was ever received."""
        line = self.details.serial_line
        where = f"{self.address} is open"
        if line is None or line.native_usb:
            text = f"{where}, but no data was received. {_CHECK_BUS} Check the bit rate ({self.bitrate} bit/s)."
            return PortError(text, cause="no_data_received", address=self.address, bitrate=self.bitrate)
        if line.confirmed:
            text = f"{where} at {line.baud} baud, but no data was received from the bus. {_CHECK_BUS}"
            return PortError(text, cause="no_data_at_baud", address=self.address, baud=line.baud)
        if line.found:
            return PortError(
                f"{where}, but no data was received. Its baud rate is unknown: trying {line.baud} baud. "
                f"{_CHECK_BUS} If the adapter uses another baud rate, add it: {self.address}@BAUD.",
                cause="baud_unknown", address=self.address, baud=line.baud,
            )  # fmt: skip
        device = self.address.rpartition("@")[0]
        return PortError(
            f"{where} at {line.baud} baud, but no data was received. Remove @{line.baud} to detect the rate: "
            f"{device}. {_CHECK_BUS}",
            cause="no_data_at_given_baud", address=self.address, baud=line.baud, device=device,
        )  # fmt: skip

    # On the event loop.

    def _drain(self) -> None:
        with self._work:
            frames, self._inbox = self._inbox, []
        if frames and self._sink is not None:
            self._sink(frames)

    # On the two threads.

    def _run_thread(self, part: Callable[[], None]) -> None:
        try:
            part()
        except Exception as error:
            if self._stop(lost=error):
                _log.warning("%s was lost", self.address, exc_info=True)
        with self._work:
            self._running -= 1
            last = not self._running
        if last:
            try:
                self._link.shutdown()
            except Exception:
                _log.debug("%s did not close cleanly", self.address, exc_info=True)
            self._call_on_loop(self._released.set)

    def _stop(self, *, lost: Exception | None = None) -> bool:
        """Stop both threads and drop the queue. Returns False if stopped already."""
        with self._work:
            if self._stopping:
                return False
            self._stopping = True
            if lost is not None:
                self._why = _error_text(lost)
                self._state = PortState.LOST
            self._queue.clear()
            self._work.notify_all()
        return True

    def _call_on_loop(self, callback: Callable[[], None]) -> None:
        try:
            self._loop.call_soon_threadsafe(callback)
        except RuntimeError:  # the loop is closed
            self._stop()

    def _receive(self) -> None:
        before: Instant = 0.0
        not_before: Instant = 0.0
        while not self._stopping:
            if got := self._link.receive(_POLL_S, not_before):
                if not self._baud_reported:
                    self._report_baud()
                self._take(got)
                now = time.monotonic()
                not_before = now + _GATHER_S if now - before < _CLOSE_BY_S else 0.0
                before = now

    def _report_baud(self) -> None:
        line = None if self._slcan is None else self._slcan.line_info
        self._baud_reported = line is None or line.confirmed
        if line is not None and line.confirmed and line.serial_number:
            self._call_on_loop(partial(self._on_baud, line.serial_number, line.baud))

    def _take(self, got: Received) -> None:
        frames = got.frames
        busy_s = sum(map(frame_bits, frames)) / self.bitrate
        self._received_any = self._received_any or bool(frames)
        with self._work:
            seen = self.statistics
            waking = not self._inbox
            room = RX_LIMIT - len(self._inbox)
            self._inbox += frames if len(frames) <= room else frames[:room]
            seen.rx_frames += min(len(frames), room)
            seen.rx_dropped += max(0, len(frames) - room) + got.lost
            seen.busy_s += busy_s
            seen.ignored += got.ignored
            seen.line_bytes += got.line_bytes
            seen.errors += got.garbled + got.refused
            for error in got.errors:
                seen.rx_dropped += error.overflow
                seen.unacknowledged += error.unacknowledged
                if not error.harmless:
                    seen.error_frames += 1
                    seen.errors += 1
                if error.state is not None and self._state is not PortState.LOST:
                    if error.state is PortState.BUS_OFF and self._state is not PortState.BUS_OFF:
                        seen.bus_offs += 1
                        seen.errors += self._queue.clear()  # an old command must not be sent after recovery
                    self._state = error.state
        if frames and waking:
            self._call_on_loop(self._drain)

    def _transmit(self) -> None:
        link = self._link
        while batch := self._next(link.max_batch):
            try:
                taken = link.transmit([waiting.frame for waiting in batch])
            except can.CanError as error:
                taken = 0
                refused = batch.pop(0)
                _log.debug("%s refused %s: %s", self.address, refused, error)
                with self._work:
                    self.statistics.errors += 1
            busy_s = sum(frame_bits(waiting.frame) for waiting in batch[:taken]) / self.bitrate
            with self._work:
                self.statistics.tx_frames += taken
                self.statistics.busy_s += busy_s
                if self._state is PortState.BUS_OFF:
                    self.statistics.errors += len(batch) - taken
                elif not self._stopping:  # more urgent frames queued meanwhile go first
                    for waiting in batch[taken:]:
                        self._queue.put_back(waiting)

    def _next(self, limit: int) -> list[QueuedFrame]:
        """Up to `limit` frames to send, at least one that is not stale. Empty when stopping."""
        batch: list[QueuedFrame] = []
        with self._work:
            while not batch:
                while not self._queue and not self._stopping:
                    self._work.wait()
                if self._stopping:
                    return []
                latest = time.monotonic() - STALE_S
                while self._queue and len(batch) < limit:
                    waiting = self._queue.take()
                    if waiting.since < latest:
                        self.statistics.errors += 1
                    else:
                        batch.append(waiting)
        return batch


def _link(bus: can.BusABC | AdapterLink, address: str) -> AdapterLink:
    """The fastest link to `bus`."""
    interface = address.partition(":")[0]
    if isinstance(bus, SlcanBus) or not isinstance(bus, can.BusABC):
        return bus
    raw = getattr(bus, "socket", None)
    if interface == "socketcan" and isinstance(raw, socket.socket):
        return RawLink(bus, raw)
    return MessageLink(bus, interface)


def _error_text(error: Exception) -> str:
    """Why the adapter was lost, as part of a sentence."""
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return text.rstrip(".") or type(error).__name__
