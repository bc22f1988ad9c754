"""Owns PythonCanPort: a CanPort over a python-can bus, with one thread that receives and one that sends."""

import asyncio
import errno
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence

import can

from hornbill.bus import socketcan
from hornbill.bus.bittime import frame_bits
from hornbill.bus.transmit import TransmitQueue, Waiting, check
from hornbill.errors import BusDisconnected
from hornbill.units import Instant
from hornbill.wire.frame import Frame
from hornbill.wire.port import FrameSink, PortState, PortStatistics

RX_LIMIT = 8192
"""Frames kept for a busy event loop: one second of a saturated bus."""

STALE_S = 1.0
"""A frame that could not leave for so long is dropped: a command from before a broken cable must not move
a servo once the cable is whole again."""

_POLL_S = 0.05  # how soon the receive thread notices that it should end
_SEND_S = 0.25  # how long an adapter may take one frame
_FULL_S = 0.001  # the pause when the kernel's queue is full: about seven frames
_CLOSE_S = 3.0
_GARBLED_IN_A_ROW = 100
_OLDEST_S = 1.0  # beyond this age a stamp is not of the wall clock

_log = logging.getLogger(__name__)


class PythonCanPort:
    """A CanPort on an open python-can bus, which it owns from now on. Made on the event loop by `open_port`.

    Threads touch the loop through call_soon_threadsafe alone, once for each burst of frames. Time stamps
    are on time.monotonic, the clock of asyncio's and uvloop's loops; a JumpingLoop cannot drive real threads.
    Standard, remote and FD frames count as dropped, error frames as errors; neither is delivered. When a
    thread fails the state is LOST, what is queued is dropped and the adapter is let go.
    """

    def __init__(self, bus: can.BusABC, *, address: str, bitrate: int) -> None:
        self.address = address
        self.bitrate = bitrate
        self.statistics = PortStatistics()
        self.sample_point: float | None = None
        self.trouble: str | None = None
        self.retry_in_s: float | None = None
        self._bus = bus
        self._loop = asyncio.get_running_loop()
        self._sink: FrameSink | None = None
        self._state = PortState.ACTIVE
        self._closed = False
        self._inbox: deque[Frame] = deque()
        self._waking = False
        self._latest: Instant = 0.0
        # One lock for the queue, the statistics and `_stopping`.
        self._work = threading.Condition()
        self._queue = TransmitQueue()
        self._stopping = False
        self._running = 2
        self._released = asyncio.Event()
        self._threads = [
            threading.Thread(target=self._live, args=(part,), name=f"{address} {name}", daemon=True)
            for name, part in (("receive", self._receive), ("transmit", self._transmit))
        ]
        for thread in self._threads:
            thread.start()

    @property
    def state(self) -> PortState:
        """Passive and bus-off are known from SocketCAN's error frames only; other adapters say nothing of it."""
        return PortState.DISCONNECTED if self._closed else self._state

    def listen(self, sink: FrameSink) -> None:
        """Deliver received frames to `sink`; what came before the first call is gone."""
        self._sink = sink

    def send(self, frames: Sequence[Frame]) -> None:
        """Queue `frames` for the send thread, the lowest identifier first.

        Raises BusDisconnected when the port is closed or lost, ValueError for an impossible frame. What
        the adapter refuses is counted as an error, as is a frame that could not leave within STALE_S.
        """
        if self._closed:
            raise BusDisconnected(f"{self.address} is closed. Connect the bus again.")
        if self._state is PortState.LOST:
            raise BusDisconnected(f"{self.address} was lost. Check the adapter and its cable, then connect again.")
        check(frames)
        now = time.monotonic()
        with self._work:
            for frame in frames:
                self.statistics.errors += self._queue.put(frame, now)
            self._work.notify()

    async def close(self) -> None:
        """Stop both threads and free the adapter, within a fraction of a second unless its driver hangs."""
        self._closed = True
        self._sink = None
        self._stop()
        try:
            async with asyncio.timeout(_CLOSE_S):
                await self._released.wait()
        except TimeoutError:
            _log.warning("%s did not let go within %g s and is left to itself", self.address, _CLOSE_S)
            return
        for thread in self._threads:
            thread.join()  # it has nothing left to do but return

    # On the event loop.

    def _drain(self) -> None:
        self._waking = False  # before the deque is read: who appends from here on wakes us again
        frames = [self._inbox.popleft() for _ in range(len(self._inbox))]
        if frames and self._sink is not None:
            self._sink(frames)

    # On the two threads.

    def _live(self, part: Callable[[], None]) -> None:
        try:
            part()
        except Exception:
            if self._stop(lost=True):
                _log.warning("%s was lost", self.address, exc_info=True)
        with self._work:
            self._running -= 1
            last = not self._running
        if last:
            try:
                self._bus.shutdown()
            except Exception:
                _log.debug("%s did not close cleanly", self.address, exc_info=True)
            self._tell(self._released.set)

    def _stop(self, *, lost: bool = False) -> bool:
        """End both threads and drop what is queued; whether that was news."""
        with self._work:
            if self._stopping:
                return False
            self._stopping = True
            if lost:
                self._state = PortState.LOST
            self._queue.clear()
            self._work.notify_all()
        return True

    def _tell(self, callback: Callable[[], None]) -> None:
        try:
            self._loop.call_soon_threadsafe(callback)
        except RuntimeError:  # the loop is closed: nobody is left to listen
            self._stop()

    def _receive(self) -> None:
        garbled = 0
        while not self._stopping:
            try:
                message = self._bus.recv(_POLL_S)
            except Exception as error:
                garbled += 1
                if not _is_garbled(error) or garbled > _GARBLED_IN_A_ROW:
                    raise
                self._count_error()
                continue
            if message is not None:
                garbled = 0
                self._take(message)

    def _take(self, message: can.Message) -> None:
        if message.is_error_frame:
            self._count_error()
            if self.address.startswith("socketcan:"):
                self._state = socketcan.state_after(message.arbitration_id, message.data) or self._state
            return
        usable = message.is_extended_id and not (message.is_remote_frame or message.is_fd)
        if not usable or len(self._inbox) >= RX_LIMIT:
            with self._work:
                self.statistics.rx_dropped += 1
            return
        frame = Frame(message.arbitration_id, bytes(message.data), self._instant(message.timestamp))
        with self._work:
            self.statistics.rx_frames += 1
            self.statistics.busy_s += frame_bits(frame) / self.bitrate
        self._inbox.append(frame)
        if not self._waking:
            self._waking = True
            self._tell(self._drain)

    def _instant(self, stamp: float) -> Instant:
        """A wall-clock stamp on the monotonic clock; now, for an adapter with a clock of its own or none."""
        age = time.time() - stamp
        now = time.monotonic()
        self._latest = max(self._latest, now - age if 0 <= age < _OLDEST_S else now)
        return self._latest

    def _transmit(self) -> None:
        while (waiting := self._next()) is not None:
            frame = waiting.frame
            if time.monotonic() - waiting.since > STALE_S:
                self._count_error()
                continue
            try:
                self._bus.send(can.Message(arbitration_id=frame.id, data=frame.data), timeout=_SEND_S)
            except can.CanError as error:
                if error.error_code == errno.ENOBUFS:
                    self._put_back(waiting)
                else:
                    self._count_error()
                    _log.debug("%s did not take a frame: %s", self.address, error)
            else:
                with self._work:
                    self.statistics.tx_frames += 1
                    self.statistics.busy_s += frame_bits(frame) / self.bitrate

    def _next(self) -> Waiting | None:
        with self._work:
            while not self._queue and not self._stopping:
                self._work.wait()
            return None if self._stopping else self._queue.take()

    def _put_back(self, waiting: Waiting) -> None:
        """The kernel's queue is full: let a more urgent frame that comes meanwhile go before this one."""
        with self._work:
            if not self._stopping:
                self._queue.put_back(waiting)
        time.sleep(_FULL_S)

    def _count_error(self) -> None:
        with self._work:
            self.statistics.errors += 1


def _is_garbled(error: Exception) -> bool:
    """Whether an adapter's driver choked on one message, rather than lost the adapter."""
    return isinstance(error if not isinstance(error, can.CanError) else error.__cause__, ValueError | IndexError)
