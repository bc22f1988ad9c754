"""The frames one CAN controller still has to send, in the order of arbitration."""

from bisect import insort
from collections.abc import Sequence
from typing import NamedTuple

from hornbill.units import Instant
from hornbill.wire.frame import Frame

QUEUE_LIMIT = 4096
"""Frames a port keeps at most: half a second of a saturated bus."""

_LAST_IDENTIFIER = 0x1FFF_FFFF


class QueuedFrame(NamedTuple):
    """One queued frame. The first two fields order it, negated so that the next to leave sorts last."""

    rank: int
    turn: int
    frame: Frame
    since: Instant


class TransmitQueue:
    """Lowest identifier first, equal ones in the order they came, never more than `limit` frames.

    When it is full, the frame that would have left last goes: the newest of the highest identifier.
    So what is urgent always finds room.
    """

    def __init__(self, limit: int = QUEUE_LIMIT) -> None:
        self._limit = limit
        self._turn = 0
        self._waiting: list[QueuedFrame] = []

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, frame: Frame, since: Instant) -> int:
        """Queue `frame`; the number of frames dropped for it (0 or 1)."""
        self._turn -= 1
        insort(self._waiting, QueuedFrame(-frame.id, self._turn, frame, since))
        if len(self._waiting) <= self._limit:
            return 0
        del self._waiting[0]
        return 1

    def head(self) -> Frame:
        """The frame to leave next. Raises IndexError when nothing is queued."""
        return self._waiting[-1].frame

    def take(self) -> QueuedFrame:
        """Remove and return what leaves next. Raises IndexError when nothing is queued."""
        return self._waiting.pop()

    def put_back(self, waiting: QueuedFrame) -> None:
        """Return what was taken and could not be sent; it keeps its turn among its equals."""
        insort(self._waiting, waiting)

    def clear(self) -> int:
        """Drop everything; how many frames that were."""
        dropped = len(self._waiting)
        self._waiting.clear()
        return dropped


def check(frames: Sequence[Frame]) -> None:
    """Raise ValueError for a frame no CAN controller could send: over 29 bits, or over 8 bytes."""
    for frame in frames:
        if not 0 <= frame.id <= _LAST_IDENTIFIER:
            raise ValueError(f"identifier {frame.id:#x} is outside 0..{_LAST_IDENTIFIER:#x}: it must fit 29 bits")
        if len(frame.data) > 8:
            raise ValueError(f"{len(frame.data)} data bytes are above the 8 of a CAN frame: split the transfer")
