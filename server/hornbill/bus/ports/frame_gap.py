"""FrameGap: a pause between the frames of one transfer, for receivers that lose frames in close succession."""

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

LONGEST_MS = 20.0
"""The longest pause, ms: a request of five frames is then out well before its timeout."""


def parse_frame_gap(address: str) -> tuple[str, float]:
    """An address without its option `?frame_gap_ms=…`, and the pause in seconds, 0 without one.

    Raises PortOpenFailed for a pause that is not 0 to LONGEST_MS.
    """
    plain, text = split_frame_gap(address)
    if text is None:
        return plain, 0.0
    try:
        gap_ms = float(text)
    except ValueError:
        gap_ms = math.nan
    if not 0 <= gap_ms <= LONGEST_MS:
        raise PortOpenFailed(
            f"frame_gap_ms={text} is not 0 to {LONGEST_MS:g} ms. Enter the pause between the frames of one transfer, "
            "for example 3.",
            address=plain,
            cause="no_frame_gap",
            longest_ms=LONGEST_MS,
        )
    return plain, gap_ms / 1000


@dataclass(slots=True)
class _Held:
    """Frames of one identifier that wait: the rest of a transfer, and whole transfers behind it."""

    frames: deque[Frame] = field(default_factory=deque[Frame])
    alarm: asyncio.TimerHandle | None = None


class FrameGap(PortWrapper):
    """A CanPort that passes frames on; within a transfer each waits `gap_s` after the one before.

    Frames of one identifier keep their order. Those of other identifiers do not wait, so a stop is not delayed.
    """

    def __init__(self, port: CanPort, gap_s: float) -> None:
        super().__init__(port)
        self._gap_s = gap_s
        self._held: dict[int, _Held] = {}

    def listen(self, sink: FrameSink) -> None:
        """Received frames pass at once."""
        self._behind.listen(sink)

    def send(self, frames: Sequence[Frame]) -> None:
        """Pass on what need not wait, hold the rest.

        Raises ValueError for an impossible frame, and what the port behind raises; then nothing of this call is held.
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
            if held.alarm is None:
                self._wait(can_id, held)

    async def close(self) -> None:
        """Drop what is held and close the port behind."""
        self._clear()
        await self._behind.close()

    def _clear(self) -> None:
        for held in self._held.values():
            if held.alarm is not None:
                held.alarm.cancel()
        self._held.clear()

    def _wait(self, can_id: int, held: _Held) -> None:
        held.alarm = asyncio.get_running_loop().call_later(self._gap_s, self._next, can_id)

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
        self._clear()  # half a transfer is worth nothing once the bus is back


def _starts(frame: Frame) -> bool:
    """Whether a frame is the first, or the only one, of a transfer."""
    return not frame.data or bool(frame.data[-1] & START)
