"""Samples of one channel in time order, in arrays of 16 bytes per sample that grow in chunks."""

import math
from array import array
from bisect import bisect_left, bisect_right
from collections import deque
from dataclasses import dataclass
from typing import Final, TypeAlias

from hornbill.units import Instant

FIRST_CHUNK: Final = 64
LARGEST_CHUNK: Final = 1024
"""Samples per chunk: small chunks first, so that a channel read once a minute takes little memory."""

BYTES_A_SAMPLE: Final = 16

Floats: TypeAlias = "array[float]"

# Not arrays of NumPy, which takes 12 MiB and 0.1 s to import. Values are float64 as well: a float32 cannot tell 0.1
# degrees from 0.2 at the end of the range of an angle (36,000,000.0 degrees, section 4.1), and the times take half of
# the memory anyway.


@dataclass(frozen=True, slots=True)
class SampleColumns:
    """Samples of one channel, in consecutive pieces of (times, values). NaN is a gap."""

    pieces: tuple[tuple[Floats, Floats], ...] = ()

    @property
    def count(self) -> int:
        """Number of samples."""
        return sum(len(times) for times, _ in self.pieces)

    def joined(self) -> tuple[Floats, Floats]:
        """All pieces joined."""
        times, values = _empty(), _empty()
        for t, v in self.pieces:
            times += t
            values += v
        return times, values


NO_SAMPLES: Final = SampleColumns()


class _Chunk:
    __slots__ = ("size", "times", "values")

    def __init__(self, size: int) -> None:
        self.size = size
        self.times = _empty()
        self.values = _empty()

    @property
    def nbytes(self) -> int:
        """Size once it is full, bytes."""
        return self.size * BYTES_A_SAMPLE


def _empty() -> Floats:
    return array("d")


class SampleRing:
    """Samples of one channel. A late sample (its frame was delayed) is inserted in time order."""

    def __init__(self) -> None:
        self._chunks: deque[_Chunk] = deque()
        self.last_t: Instant = -math.inf
        self.last_v = math.nan
        self.last_interval = 0.0

    def append(self, t: Instant, v: float) -> int:
        """Add a sample; NaN is a gap. Returns the bytes allocated."""
        grown = 0
        if not self._chunks or len(self._chunks[-1].times) == self._chunks[-1].size:
            chunk = _Chunk(min(LARGEST_CHUNK, FIRST_CHUNK << min(len(self._chunks), 4)))
            self._chunks.append(chunk)
            grown = chunk.nbytes
        chunk = self._chunks[-1]
        if t < self.last_t and chunk.times:
            self._insert(chunk, t, v)
            return grown
        t = max(t, self.last_t)
        chunk.times.append(t)
        chunk.values.append(v)
        if self.last_t > -math.inf:
            self.last_interval = t - self.last_t
        self.last_t, self.last_v = t, v
        return grown

    def _insert(self, chunk: _Chunk, t: Instant, v: float) -> None:
        """Insert into the newest chunk. An older sample goes first, at a time not before the previous chunk's end."""
        place = bisect_right(chunk.times, t)
        if place == 0 and len(self._chunks) > 1:
            t = max(t, self._chunks[-2].times[-1])
        chunk.times.insert(place, t)
        chunk.values.insert(place, v)

    def window(self, since: Instant, until: Instant | None = None) -> SampleColumns:
        """Samples from `since` to `until`, both inclusive. Not affected by later changes of the ring."""
        pieces: list[tuple[Floats, Floats]] = []
        for chunk in self._chunks:
            times = chunk.times
            if not times or times[-1] < since:
                continue
            if until is not None and times[0] > until:
                break
            first = bisect_left(times, since)
            end = len(times) if until is None else bisect_right(times, until)
            if end > first:
                pieces.append((times[first:end], chunk.values[first:end]))
        return SampleColumns(tuple(pieces))

    @property
    def oldest_end(self) -> Instant:
        """Time of the last sample of the oldest chunk that can be dropped; infinite if there is none."""
        return self._chunks[0].times[-1] if len(self._chunks) > 1 else math.inf

    def drop_oldest(self) -> int:
        """Drop the oldest chunk, never the one being written. Returns the bytes freed."""
        return self._chunks.popleft().nbytes if len(self._chunks) > 1 else 0

    def drop_before(self, t: Instant) -> int:
        """Drop chunks that end before `t`. Returns the bytes freed."""
        freed = 0
        while self.oldest_end < t:
            freed += self.drop_oldest()
        return freed
