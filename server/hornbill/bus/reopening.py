"""A CanPort that reconnects automatically after its adapter was lost."""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import replace

from hornbill.bus.adapters.serial_ports import BaudMemory
from hornbill.bus.address import check, open_port
from hornbill.bus.ports.frame_gap import FrameGap, parse_frame_gap
from hornbill.errors import PortError, PortOpenFailed
from hornbill.units import Instant
from hornbill.wire.frame import Frame
from hornbill.wire.port import PLAIN, CanPort, FrameSink, PortDetails, PortState, PortStatistics, not_connected

log = logging.getLogger(__name__)

Opener = Callable[[PortStatistics], Awaitable[CanPort]]
"""Opens the adapter once, with counters continued in the given statistics. Raises PortOpenFailed."""

CHECK_S = 0.05
"""How often the state of the adapter is checked."""

PAUSES_S = (0.2, 0.5, 1.0, 2.0, 5.0)
"""Delays before successive reconnects. The last one repeats."""

STEADY_S = 5.0
"""If an adapter is lost again within this time, the delays continue to increase."""

BUS_OFF_S = 1.0
"""How long a controller in bus-off may recover by itself before it is reopened."""

_LOST_STATES = frozenset((PortState.LOST, PortState.DISCONNECTED))


def adapter_port(
    address: str, bitrate: int = 1_000_000, memory: BaudMemory | None = None, *, listen_only: bool = False
) -> "ReopeningPort":
    """A port for the adapter at `INTERFACE:CHANNEL[?frame_gap_ms=…]`, not open yet. `bitrate` in bit/s.

    `listen_only`: in listen-only mode, if the adapter supports it. `memory` stores the baud rates of serial adapters.
    Raises PortOpenFailed for an invalid address or bit rate.
    """
    plain, gap_s = parse_frame_gap(address)
    plain = check(plain, bitrate)

    async def open_it(statistics: PortStatistics) -> CanPort:
        return await open_port(plain, bitrate=bitrate, statistics=statistics, memory=memory, listen_only=listen_only)

    return ReopeningPort(open_it, address=plain, bitrate=bitrate, frame_gap_s=gap_s)


class ReopeningPort:
    """A CanPort that keeps what `opener` opens connected.

    An adapter that is lost, or in bus-off for BUS_OFF_S, is closed and reopened after PAUSES_S. Meanwhile the state
    is LOST, or CONNECTING during an attempt. In these states and in bus-off, `send` raises BusDisconnected and
    queues nothing: an old command must never be sent once the bus is back. Counters continue and the sink remains.
    All times are those of the running event loop.
    """

    def __init__(self, opener: Opener, *, address: str, bitrate: int, frame_gap_s: float = 0.0) -> None:
        """Does not open the adapter yet. `address` and `bitrate` (bit/s) are those `opener` opens.

        `frame_gap_s` is the pause between the frames of one transfer.
        """
        self.address = address
        self.bitrate = bitrate
        self.statistics = PortStatistics()
        self._opener = opener
        self._sink: FrameSink | None = None
        self._inner: CanPort | None = None
        self._task: asyncio.Task[None] | None = None
        self._down: PortState | None = PortState.DISCONNECTED  # None: use the state of the adapter
        self._closed = False
        self._trouble: PortError | None = None
        self._due: Instant | None = None
        self._frame_gap_s = frame_gap_s

    async def open(self) -> None:
        """Open the adapter and keep it connected. Raises PortOpenFailed, without any retries."""
        await self._open()
        self._keep_connected()

    async def open_with_retries(self) -> None:
        """Open the adapter now or retry until it opens. `trouble` is the current reason for failure."""
        try:
            await self._open()
        except PortOpenFailed as error:
            self._down, self._trouble = PortState.LOST, error
        self._keep_connected()

    @property
    def state(self) -> PortState:
        """State of the adapter while it is open, LOST or CONNECTING while it is not, DISCONNECTED once closed."""
        if self._down is not None:
            return self._down
        assert self._inner is not None
        state = self._inner.state
        return PortState.LOST if state is PortState.DISCONNECTED else state  # not closed by us

    @property
    def sample_point(self) -> float | None:
        """Sample point of the adapter while it is open."""
        return None if self._inner is None else self._inner.sample_point

    @property
    def trouble(self) -> PortError | None:
        """Why the adapter is lost and the remedy, or its own problem while it is open."""
        if self._down is not None:
            return self._trouble
        assert self._inner is not None
        return self._loss() if self.state is PortState.LOST else self._inner.trouble

    @property
    def retry_in_s(self) -> float | None:
        """Time until the next reconnect, s. 0 during an attempt, None while it works and once closed."""
        if self._down not in (PortState.LOST, PortState.CONNECTING):
            return None
        return 0.0 if self._due is None else max(0.0, self._due - asyncio.get_running_loop().time())

    @property
    def details(self) -> PortDetails:
        """Details of the adapter while it is open, with the frame gap of this port."""
        inner = PLAIN if self._inner is None else self._inner.details
        return replace(inner, frame_gap_s=self._frame_gap_s) if self._frame_gap_s else inner

    def listen(self, sink: FrameSink) -> None:
        """Deliver received frames to `sink`, also after reconnects."""
        self._sink = sink
        if self._inner is not None:
            self._inner.listen(sink)

    def send(self, frames: Sequence[Frame]) -> None:
        """Send frames to the adapter.

        Raises BusDisconnected while it is lost, in bus-off or closed, and ValueError for an invalid frame.
        """
        inner = self._inner
        if inner is None or self._down is not None or inner.state is PortState.BUS_OFF:
            raise not_connected(self.address, self.trouble)
        inner.send(frames)

    async def close(self) -> None:
        """Stop reconnecting and close the adapter, even during an attempt. Idempotent."""
        self._closed = True
        self._down, self._trouble, self._sink = PortState.DISCONNECTED, None, None
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
        inner, self._inner = self._inner, None
        if inner is not None:
            await inner.close()

    async def _open(self) -> None:
        inner = await self._opener(self.statistics)
        if self._closed:
            await inner.close()
            raise PortOpenFailed(
                f"{self.address} was closed while it was being opened.",
                address=self.address,
                cause="closed_while_opening",
            )
        self._inner = FrameGap(inner, self._frame_gap_s) if self._frame_gap_s > 0 else inner
        self._down, self._trouble = None, None
        if self._sink is not None:
            self._inner.listen(self._sink)

    def _keep_connected(self) -> None:
        if not self._closed:
            self._task = asyncio.get_running_loop().create_task(self._run(), name=f"keep {self.address} connected")

    async def _run(self) -> None:
        clock = asyncio.get_running_loop().time
        opened = lost = clock()
        failures, first = 0, self._inner is None
        while True:
            if self._down is None:
                why = await self._watch()
                lost = clock()
                self._down, self._trouble = PortState.LOST, why
                log.warning("%s", why.detail)
                if lost - opened >= STEADY_S:
                    failures = 0
            self._due = clock() + PAUSES_S[min(failures, len(PAUSES_S) - 1)]
            failures += 1
            await self._close_lost()
            await asyncio.sleep(max(0.0, self._due - clock()))
            if await self._reopen():
                opened = clock()
                self.statistics.reopened += not first
                first = False
                log.warning("%s is open after %.1f s", self.address, opened - lost)

    async def _watch(self) -> PortError:
        """Wait until the adapter is lost. Returns the cause as far as known."""
        clock = asyncio.get_running_loop().time
        off_since: Instant | None = None
        while True:
            inner = self._inner
            assert inner is not None
            state = inner.state
            if state in _LOST_STATES:
                return self._loss()
            if state is not PortState.BUS_OFF:
                off_since = None
            elif off_since is None:
                off_since = clock()
            elif clock() - off_since >= BUS_OFF_S:
                text = f"{self.address} is in bus-off after too many errors. Check its wiring."
                return inner.trouble or PortError(text, cause="bus_off", address=self.address)
            await asyncio.sleep(CHECK_S)

    def _loss(self) -> PortError:
        trouble = None if self._inner is None else self._inner.trouble
        text = f"{self.address} was lost. Check the adapter and its cable."
        return trouble or PortError(text, cause="adapter_lost", address=self.address)

    async def _close_lost(self) -> None:
        """Close the lost adapter, because most adapters cannot be opened twice."""
        if self._inner is not None:
            try:
                await self._inner.close()
            except Exception:
                log.exception("%s did not close cleanly", self.address)
            self._inner = None

    async def _reopen(self) -> bool:
        """Try to open the adapter. Returns whether it is open."""
        self._due, self._down = None, PortState.CONNECTING
        try:
            await self._open()
        except PortOpenFailed as error:
            self._down, self._trouble = PortState.LOST, error
            return False
        except Exception as error:  # a driver may raise anything; keep retrying
            log.exception("%s could not be opened", self.address)
            text = f"{self.address} cannot be opened: {error}."
            self._down, self._trouble = PortState.LOST, PortError(text, cause="open_failed", address=self.address)
            return False
        return True
