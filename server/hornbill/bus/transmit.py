"""Transmit queue of a CAN controller, in order of arbitration."""

from bisect import insort
from collections.abc import Sequence
from typing import NamedTuple

from hornbill.units import Instant
from hornbill.wire.frame import Frame

QUEUE_LIMIT = 4096
"""Maximum number of frames queued in a port: half a second of a saturated bus."""

_LAST_IDENTIFIER = 0x1FFF_FFFF


class QueuedFrame(NamedTuple):
    """One queued frame. The first two fields order it, negated so that the next frame sorts last."""

    rank: int
    turn: int
    frame: Frame
    since: Instant


class TransmitQueue:
    """Lowest identifier first, equal ones in order of arrival, at most `limit` frames.

    When full, it drops the frame that would be sent last: the newest with the highest identifier. Urgent frames
    therefore always find room.
    """

    def __init__(self, limit: int = QUEUE_LIMIT) -> None:
        self._limit = limit
        self._turn = 0
        self._waiting: list[QueuedFrame] = []

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, frame: Frame, since: Instant) -> int:
        """Queue `frame`. Returns the number of frames dropped for it (0 or 1)."""
        self._turn -= 1
        insort(self._waiting, QueuedFrame(-frame.id, self._turn, frame, since))
        if len(self._waiting) <= self._limit:
            return 0
        del self._waiting[0]
        return 1

    def head(self) -> Frame:
        """The next frame. Raises IndexError if the queue is empty."""
        return self._waiting[-1].frame

    def take(self) -> QueuedFrame:
        """Remove and return the next frame. Raises IndexError if the queue is empty."""
        return self._waiting.pop()

    def put_back(self, waiting: QueuedFrame) -> None:
        """Requeue a frame that could not be sent. It keeps its position among its equals."""
        insort(self._waiting, waiting)

    def clear(self) -> int:
        """Drop all frames. Returns their number."""
        dropped = len(self._waiting)
        self._waiting.clear()
        return dropped


def check(frames: Sequence[Frame]) -> None:
    """Raise ValueError for an invalid frame: an identifier above 29 bits, or more than 8 bytes."""
    for frame in frames:
        if not 0 <= frame.id <= _LAST_IDENTIFIER:
            raise ValueError(f"Identifier {frame.id:#x} is outside 0 to {_LAST_IDENTIFIER:#x} (29 bits).")
        if len(frame.data) > 8:
            raise ValueError(f"{len(frame.data)} data bytes exceed the 8 of a CAN frame. Split the transfer.")
