"""FrameGap: a pause between the frames of one transfer, for receivers that lose frames sent back to back."""

import asyncio
import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

from hornbill.bus.transmit import check
from hornbill.errors import BusDisconnected, PortOpenFailed
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort, FrameSink, PortState, PortWrapper, split_frame_gap
from hornbill.wire.transfer import START

MAX_GAP_MS = 20.0
"""Maximum pause, ms. A request of five frames is then sent well before its timeout."""


def parse_frame_gap(address: str) -> tuple[str, float]:
    """Split the option `?frame_gap_ms=…` off an address. The second value is the pause in seconds, 0 without one.

    Raises PortOpenFailed for a pause that is not 0 to MAX_GAP_MS.
    """
    plain, text = split_frame_gap(address)
    if text is None:
        return plain, 0.0
    try:
        gap_ms = float(text)
    except ValueError:
        gap_ms = math.nan
    if not 0 <= gap_ms <= MAX_GAP_MS:
        raise PortOpenFailed(
            f"frame_gap_ms={text} is not 0 to {MAX_GAP_MS:g} ms. Enter the pause between the frames of one transfer, "
            "for example 3.",
            address=plain,
            cause="frame_gap_out_of_range",
            longest_ms=MAX_GAP_MS,
        )
    return plain, gap_ms / 1000


@dataclass(slots=True)
class _Held:
    """Held frames of one identifier: the rest of a transfer, and complete transfers after it."""

    frames: deque[Frame] = field(default_factory=deque[Frame])
    timer: asyncio.TimerHandle | None = None


class FrameGap(PortWrapper):
    """A CanPort that delays each frame of a transfer by `gap_s` after the previous one.

    Frames of one identifier keep their order. Those of other identifiers are not delayed, so a stop is not either.
    """

    def __init__(self, port: CanPort, gap_s: float) -> None:
        super().__init__(port)
        self._gap_s = gap_s
        self._held: dict[int, _Held] = {}

    def listen(self, sink: FrameSink) -> None:
        """Received frames pass without delay."""
        self._behind.listen(sink)

    def send(self, frames: Sequence[Frame]) -> None:
        """Send frames that need not wait, and hold the rest.

        Raises ValueError for an invalid frame, and the errors of the port behind. Then no frame of this call is held.
        """
        check(frames)
        now: list[Frame] = []
        later: dict[int, list[Frame]] = {}
        for frame in frames:
            begun = frame.id in self._held or frame.id in later
            if begun or not _starts(frame):
                later.setdefault(frame.id, []).append(frame)
            else:
                now.append(frame)
        if now:
            self._behind.send(now)
        for can_id, rest in later.items():
            held = self._held.setdefault(can_id, _Held())
            held.frames += rest
            if held.timer is None:
                self._wait(can_id, held)

    async def close(self) -> None:
        """Drop held frames and close the port behind."""
        self._clear()
        await self._behind.close()

    def _clear(self) -> None:
        for held in self._held.values():
            if held.timer is not None:
                held.timer.cancel()
        self._held.clear()

    def _wait(self, can_id: int, held: _Held) -> None:
        held.timer = asyncio.get_running_loop().call_later(self._gap_s, self._next, can_id)

    def _next(self, can_id: int) -> None:
        held = self._held[can_id]
        ready = [held.frames.popleft()]
        while held.frames and _starts(held.frames[0]):
            ready.append(held.frames.popleft())
        if held.frames:
            self._wait(can_id, held)
        else:
            del self._held[can_id]
        try:
            if self.state is not PortState.BUS_OFF:
                self._behind.send(ready)
                return
        except BusDisconnected:
            pass
        self._clear()  # an incomplete transfer is useless once the bus is back


def _starts(frame: Frame) -> bool:
    """Whether a frame is the first, or the only one, of a transfer."""
    return not frame.data or bool(frame.data[-1] & START)
