"""FrameRing: the last minutes of every frame of the bus, packed, within a bound of time and one of memory."""

from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from struct import Struct
from typing import Final, TypeAlias, cast

from hornbill.units import Instant
from hornbill.wire.frame import Frame, LoggedFrame

KEPT_S: Final = 600.0
LIMIT_BYTES: Final = 96 << 20
"""Ten minutes of a bus that is full all the time, at 7,000 frames a second, take 88 MB."""

CHUNK_S: Final = 10.0
CHUNK_BYTES: Final = 1 << 20
_ROOM: Final = 2 * CHUNK_BYTES  # what the open chunk may grow to: CHUNK_BYTES, and the batch that passed it

LATE_S: Final = 0.05
"""How long a frame received may have been under way to us, while one we sent is here at once."""

SLICE: Final = 250
"""Frames taken apart, put into words and looked through for writes in one go, in less than a millisecond."""

_RECORD: Final = Struct("<dIB8s")
_SENT: Final = 1 << 31
_pack: Final = _RECORD.pack
_time: Final = itemgetter(0)
# Without the constructors of the named tuples: a recording has hundreds of thousands of frames.
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
    """A record of 21 bytes a frame, appended to chunks of ten seconds; the oldest chunk goes first."""

    def __init__(self, kept_s: float = KEPT_S, limit_bytes: int = LIMIT_BYTES) -> None:
        """`limit_bytes` is at least 4 MiB."""
        self._kept_s = kept_s
        self._limit = max(limit_bytes, 2 * _ROOM)
        self._closed: deque[_FrameChunk] = deque()
        self._closed_bytes = 0
        self._open = _FrameChunk("bus", 0.0, 0.0)
        self._until = float("-inf")
        self.full = False
        """Whether frames younger than are kept otherwise had to go for want of memory."""
        self.channel = "bus"
        """What logs call the bus whose frames come from now on; `turn` sets it."""

    @property
    def size(self) -> int:
        """Bytes in use."""
        return self._closed_bytes + len(self._open.data)

    @property
    def frames(self) -> int:
        """Frames kept."""
        return self.size // _RECORD.size

    @property
    def since(self) -> Instant | None:
        """The instant of the oldest frame; None while there is none."""
        return next((chunk.first for chunk in (*self._closed, self._open) if chunk.data), None)

    def add(self, frames: Sequence[Frame], sent: bool) -> None:
        """Keep a batch; never raises, and takes about half a microsecond a frame."""
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

    def turn(self, channel: str) -> None:
        """Frames come from another bus from now on."""
        self.channel = channel
        self._until = float("-inf")

    def forget_old(self, now: Instant) -> None:
        """Drop what is older than is kept: on a silent bus no frame would."""
        while self._closed and self._closed[0].last < now - self._kept_s:
            self._closed_bytes -= len(self._closed.popleft().data)

    def slices(self, since: Instant, until: Instant, utc_offset: float = 0.0) -> Iterator[list[LoggedFrame]]:
        """The frames of a span of time in their order, a few at a time; what is added meanwhile is not among them.

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
        """Close the chunk that is open, and begin the next one."""
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
