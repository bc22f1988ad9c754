"""Ring buffer of all frames on the bus, limited by age and memory."""

from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from struct import Struct
from typing import Final, TypeAlias, cast

from hornbill.units import Instant
from hornbill.wire.frame import Frame, LoggedFrame

RETAIN_S: Final = 600.0
LIMIT_BYTES: Final = 96 << 20
"""Ten minutes of a fully loaded bus (7,000 frames/s) take 88 MB."""

CHUNK_S: Final = 10.0
CHUNK_BYTES: Final = 1 << 20
_ROOM: Final = 2 * CHUNK_BYTES  # maximum of the open chunk: CHUNK_BYTES, plus the batch that exceeded it

LATE_S: Final = 0.05
"""Maximum delay of a received frame. Sent frames are recorded without delay, so the order may differ by this much."""

SLICE: Final = 250
"""Frames unpacked, formatted and searched for writes at once, in less than a millisecond."""

_RECORD: Final = Struct("<dIB8s")
_SENT: Final = 1 << 31
_pack: Final = _RECORD.pack
_time: Final = itemgetter(0)
# Bypasses the constructors of the named tuples: a recording has hundreds of thousands of frames.
_frame: Final = cast("Callable[[type[Frame], tuple[int, bytes, Instant]], Frame]", tuple.__new__)
_logged: Final = cast("Callable[[type[LoggedFrame], tuple[Frame, str, bool]], LoggedFrame]", tuple.__new__)

_Record: TypeAlias = tuple[Instant, int, int, bytes]
"""Time, identifier with the sent bit, length, data padded to eight bytes."""


@dataclass(slots=True)
class _FrameChunk:
    channel: str
    first: Instant
    last: Instant
    data: bytearray | bytes = field(default_factory=bytearray, repr=False)


class FrameRing:
    """Frames as records of 21 bytes, in chunks of ten seconds. The oldest chunk is dropped first."""

    def __init__(self, retain_s: float = RETAIN_S, limit_bytes: int = LIMIT_BYTES) -> None:
        """`limit_bytes` is at least 4 MiB."""
        self._retain_s = retain_s
        self._limit = max(limit_bytes, 2 * _ROOM)
        self._closed: deque[_FrameChunk] = deque()
        self._closed_bytes = 0
        self._open = _FrameChunk("bus", 0.0, 0.0)
        self._until = float("-inf")
        self.full = False
        """Whether the memory limit, not the age limit, determines the oldest frame."""
        self.channel = "bus"
        """Channel name of new frames in logs; see `switch_channel`."""

    @property
    def size(self) -> int:
        """Memory in use, bytes."""
        return self._closed_bytes + len(self._open.data)

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self.size // _RECORD.size

    @property
    def since(self) -> Instant | None:
        """Instant of the oldest frame. None if empty."""
        return next((chunk.first for chunk in (*self._closed, self._open) if chunk.data), None)

    def add(self, frames: Sequence[Frame], sent: bool) -> None:
        """Add a batch. Never raises. Takes about 0.5 µs per frame."""
        if not frames:
            return
        chunk, first = self._open, frames[0].at
        if first >= self._until or len(chunk.data) >= CHUNK_BYTES:
            chunk = self._roll(first)
        flag = _SENT if sent else 0
        if len(frames) == 1:
            number, data, at = frames[0]
            chunk.data += _pack(at, number & 0x1FFF_FFFF | flag, len(data), data)
        else:
            packed = [_pack(at, number & 0x1FFF_FFFF | flag, len(data), data) for number, data, at in frames]
            chunk.data += b"".join(packed)
        chunk.last = frames[-1].at

    def switch_channel(self, channel: str) -> None:
        """Assign the following frames to another bus."""
        self.channel = channel
        self._until = float("-inf")

    def forget_old(self, now: Instant) -> None:
        """Drop frames beyond the age limit. Needed on a silent bus, where no new frame triggers it."""
        while self._closed and self._closed[0].last < now - self._retain_s:
            self._closed_bytes -= len(self._closed.popleft().data)

    def slices(self, since: Instant, until: Instant, utc_offset: float = 0.0) -> Iterator[list[LoggedFrame]]:
        """Frames of a time span in chronological order, a few at a time. Excludes frames added during iteration.

        `utc_offset` is added to their times.
        """
        waiting: list[_Record] = []
        channel = self.channel
        for chunk in [
            *self._closed,
            _FrameChunk(self._open.channel, self._open.first, self._open.last, self._open.data),
        ]:
            if chunk.last < since - LATE_S or chunk.first > until + LATE_S:
                continue
            if waiting and chunk.channel != channel:
                yield _frames(waiting, channel, utc_offset)
                waiting = []
            channel = chunk.channel
            whole = chunk.first - LATE_S >= since and chunk.last + LATE_S <= until
            data = bytes(chunk.data)
            for start in range(0, len(data), SLICE * _RECORD.size):
                records = _RECORD.iter_unpack(data[start : start + SLICE * _RECORD.size])
                waiting += records if whole else [record for record in records if since <= record[0] <= until]
                waiting.sort(key=_time)
                cut = bisect_right(waiting, waiting[-1][0] - LATE_S, key=_time) if waiting else 0
                if cut:
                    yield _frames(waiting[:cut], channel, utc_offset)
                    waiting = waiting[cut:]
        if waiting:
            yield _frames(waiting, channel, utc_offset)

    def _roll(self, first: Instant) -> _FrameChunk:
        """Close the open chunk and begin the next one."""
        if self._open.data:
            self._open.data = bytes(self._open.data)
            self._closed.append(self._open)
            self._closed_bytes += len(self._open.data)
        self.forget_old(first)
        self.full = bool(self._closed) and self._closed_bytes + _ROOM > self._limit
        while self._closed and self._closed_bytes + _ROOM > self._limit:
            self._closed_bytes -= len(self._closed.popleft().data)
        self._until = first + CHUNK_S
        self._open = _FrameChunk(self.channel, first, first)
        return self._open


def _frames(records: Sequence[_Record], channel: str, utc_offset: float) -> list[LoggedFrame]:
    return [
        _logged(
            LoggedFrame,
            (_frame(Frame, (number & 0x1FFF_FFFF, data[:length], at + utc_offset)), channel, number >= _SENT),
        )
        for at, number, length, data in records
    ]
