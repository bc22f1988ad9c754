"""A CanPort that is opened again by itself whenever its adapter was lost."""

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
"""Opens the adapter once; its counters go on in what it is given. Raises PortOpenFailed."""

LOOK_S = 0.05
"""How often the adapter is asked for its state."""

PAUSES_S = (0.2, 0.5, 1.0, 2.0, 5.0)
"""The pauses before it is opened again, the last one for as long as it takes."""

STEADY_S = 5.0
"""An adapter that is lost again sooner than this is waited for longer and longer."""

BUS_OFF_S = 1.0
"""How long a controller may be off the bus to recover by itself, before it is opened again."""

_GONE = frozenset((PortState.LOST, PortState.DISCONNECTED))


def adapter_port(address: str, bitrate: int = 1_000_000, memory: BaudMemory | None = None) -> "ReopeningPort":
    """A port on the adapter at `INTERFACE:CHANNEL[?frame_gap_ms=…]`, not open yet; `bitrate` in bit/s.

    `memory` holds the baud rates of serial adapters. Raises PortOpenFailed for an address or a bit rate that never
    could be opened.
    """
    plain, gap_s = parse_frame_gap(address)
    plain = check(plain, bitrate)

    async def open_it(statistics: PortStatistics) -> CanPort:
        return await open_port(plain, bitrate=bitrate, statistics=statistics, memory=memory)

    return ReopeningPort(open_it, address=plain, bitrate=bitrate, frame_gap_s=gap_s)


class ReopeningPort:
    """A CanPort around whatever `opener` opens, for as long as it is wanted.

    An adapter that is lost, or off the bus for BUS_OFF_S, is closed and opened again after PAUSES_S. Meanwhile the
    state is LOST, and CONNECTING while it is being opened. Then, and while a controller is off the bus, `send`
    raises BusDisconnected and keeps nothing: an old command must never leave once the bus is back. Counters go on
    and the sink stays. All times are those of the running event loop.
    """

    def __init__(self, opener: Opener, *, address: str, bitrate: int, frame_gap_s: float = 0.0) -> None:
        """Opens nothing yet. `address` and `bitrate` (bit/s) are those `opener` opens.

        `frame_gap_s` is the pause between the frames of one transfer.
        """
        self.address = address
        self.bitrate = bitrate
        self.statistics = PortStatistics()
        self._opener = opener
        self._sink: FrameSink | None = None
        self._inner: CanPort | None = None
        self._keeper: asyncio.Task[None] | None = None
        self._down: PortState | None = PortState.DISCONNECTED  # None while the adapter's own state counts
        self._closed = False
        self._trouble: PortError | None = None
        self._due: Instant | None = None
        self._frame_gap_s = frame_gap_s

    async def open(self) -> None:
        """Open it for the first time, and keep it open from then on. Raises PortOpenFailed, and then that was all."""
        await self._open()
        self._keep()

    async def open_sooner_or_later(self) -> None:
        """Open it now if that works, else try again and again; `trouble` says why not yet."""
        try:
            await self._open()
        except PortOpenFailed as error:
            self._down, self._trouble = PortState.LOST, error
        self._keep()

    @property
    def state(self) -> PortState:
        """The adapter's own while it is open; LOST, or CONNECTING, while it is not; DISCONNECTED once closed."""
        if self._down is not None:
            return self._down
        assert self._inner is not None
        state = self._inner.state
        return PortState.LOST if state is PortState.DISCONNECTED else state  # it was not we who closed it

    @property
    def sample_point(self) -> float | None:
        """That of the adapter, while it is open."""
        return None if self._inner is None else self._inner.sample_point

    @property
    def trouble(self) -> PortError | None:
        """Why it is lost and what helps, or what the adapter says of itself."""
        if self._down is not None:
            return self._trouble
        assert self._inner is not None
        return self._why_gone() if self.state is PortState.LOST else self._inner.trouble

    @property
    def retry_in_s(self) -> float | None:
        """Seconds until it is opened again; 0 while that is being tried, None while it works and once closed."""
        if self._down not in (PortState.LOST, PortState.CONNECTING):
            return None
        return 0.0 if self._due is None else max(0.0, self._due - asyncio.get_running_loop().time())

    @property
    def details(self) -> PortDetails:
        """Those of the adapter, while it is open, with the frame gap of this port."""
        inner = PLAIN if self._inner is None else self._inner.details
        return replace(inner, frame_gap_s=self._frame_gap_s) if self._frame_gap_s else inner

    def listen(self, sink: FrameSink) -> None:
        """Deliver received frames to `sink`, over every reopening."""
        self._sink = sink
        if self._inner is not None:
            self._inner.listen(sink)

    def send(self, frames: Sequence[Frame]) -> None:
        """Hand frames to the adapter.

        Raises BusDisconnected while it is lost, off the bus or closed; ValueError for an impossible frame.
        """
        inner = self._inner
        if inner is None or self._down is not None or inner.state is PortState.BUS_OFF:
            raise not_connected(self.address, self.trouble)
        inner.send(frames)

    async def close(self) -> None:
        """Stop trying and close the adapter, in whatever it is doing. Twice is harmless."""
        self._closed = True
        self._down, self._trouble, self._sink = PortState.DISCONNECTED, None, None
        keeper, self._keeper = self._keeper, None
        if keeper is not None:
            keeper.cancel()
            await asyncio.gather(keeper, return_exceptions=True)
        inner, self._inner = self._inner, None
        if inner is not None:
            await inner.close()

    async def _open(self) -> None:
        inner = await self._opener(self.statistics)
        if self._closed:
            await inner.close()
            raise PortOpenFailed(
                f"{self.address} was closed while it was being opened.", address=self.address, cause="closed_meanwhile"
            )
        self._inner = FrameGap(inner, self._frame_gap_s) if self._frame_gap_s > 0 else inner
        self._down, self._trouble = None, None
        if self._sink is not None:
            self._inner.listen(self._sink)

    def _keep(self) -> None:
        if not self._closed:
            self._keeper = asyncio.get_running_loop().create_task(self._run(), name=f"keep {self.address} open")

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
            await self._let_go()
            await asyncio.sleep(max(0.0, self._due - clock()))
            if await self._try_again():
                opened = clock()
                self.statistics.reopened += not first
                first = False
                log.warning("%s is open after %.1f s", self.address, opened - lost)

    async def _watch(self) -> PortError:
        """Until the adapter is lost; why, as far as it says."""
        clock = asyncio.get_running_loop().time
        off_since: Instant | None = None
        while True:
            inner = self._inner
            assert inner is not None
            state = inner.state
            if state in _GONE:
                return self._why_gone()
            if state is not PortState.BUS_OFF:
                off_since = None
            elif off_since is None:
                off_since = clock()
            elif clock() - off_since >= BUS_OFF_S:
                text = f"{self.address} is off the bus after too many errors. Check its wiring."
                return inner.trouble or PortError(text, cause="bus_off", address=self.address)
            await asyncio.sleep(LOOK_S)

    def _why_gone(self) -> PortError:
        trouble = None if self._inner is None else self._inner.trouble
        text = f"{self.address} was lost. Check the adapter and its cable."
        return trouble or PortError(text, cause="adapter_lost", address=self.address)

    async def _let_go(self) -> None:
        """Close what was lost: most adapters cannot be opened twice. It stays ours until that is done."""
        if self._inner is not None:
            try:
                await self._inner.close()
            except Exception:
                log.exception("%s did not close cleanly", self.address)
            self._inner = None

    async def _try_again(self) -> bool:
        """Whether the adapter is open again."""
        self._due, self._down = None, PortState.CONNECTING
        try:
            await self._open()
        except PortOpenFailed as error:
            self._down, self._trouble = PortState.LOST, error
            return False
        except Exception as error:  # a driver may raise anything, and the adapter is wanted all the same
            log.exception("%s could not be opened", self.address)
            text = f"{self.address} cannot be opened: {error}."
            self._down, self._trouble = PortState.LOST, PortError(text, cause="open_failed", address=self.address)
            return False
        return True
