"""Samples of one channel in time order, in arrays of 16 bytes per sample that grow in chunks."""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hornbill.units import Instant

FIRST_CHUNK: Final = 64
LARGEST_CHUNK: Final = 1024
"""Samples per chunk: small chunks first, so that a channel read once a minute takes little memory."""

Floats = NDArray[np.float64]

# Values are float64 as well: a float32 cannot tell 0.1 degrees from 0.2 at the end of the range of an angle
# (36,000,000.0 degrees, section 4.1), and the times take half of the memory anyway.


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
        if not self.pieces:
            return np.empty(0), np.empty(0)
        return np.concatenate([t for t, _ in self.pieces]), np.concatenate([v for _, v in self.pieces])


NO_SAMPLES: Final = SampleColumns()


class _Chunk:
    __slots__ = ("length", "rows")

    def __init__(self, size: int) -> None:
        self.rows = np.empty((2, size))
        self.length = 0

    @property
    def last_t(self) -> Instant:
        return float(self.rows[0, self.length - 1])


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
        if not self._chunks or self._chunks[-1].length == self._chunks[-1].rows.shape[1]:
            chunk = _Chunk(min(LARGEST_CHUNK, FIRST_CHUNK << min(len(self._chunks), 4)))
            self._chunks.append(chunk)
            grown = chunk.rows.nbytes
        chunk = self._chunks[-1]
        if t < self.last_t and chunk.length:
            self._insert(chunk, t, v)
            return grown
        t = max(t, self.last_t)
        chunk.rows[0, chunk.length] = t
        chunk.rows[1, chunk.length] = v
        chunk.length += 1
        if self.last_t > -math.inf:
            self.last_interval = t - self.last_t
        self.last_t, self.last_v = t, v
        return grown

    def _insert(self, chunk: _Chunk, t: Instant, v: float) -> None:
        """Insert into the newest chunk. An older sample goes first, at a time not before the previous chunk's end."""
        place = int(np.searchsorted(chunk.rows[0, : chunk.length], t, side="right"))
        if place == 0 and len(self._chunks) > 1:
            t = max(t, self._chunks[-2].last_t)
        chunk.rows[:, place + 1 : chunk.length + 1] = chunk.rows[:, place : chunk.length].copy()
        chunk.rows[:, place] = t, v
        chunk.length += 1

    def window(self, since: Instant, until: Instant | None = None) -> SampleColumns:
        """Samples from `since` to `until`, both inclusive. Not affected by later changes of the ring."""
        pieces: list[tuple[Floats, Floats]] = []
        newest = self._chunks[-1] if self._chunks else None
        for chunk in self._chunks:
            if not chunk.length or chunk.last_t < since:
                continue
            times = chunk.rows[0, : chunk.length]
            if until is not None and times[0] > until:
                break
            first = int(np.searchsorted(times, since, side="left"))
            end = chunk.length if until is None else int(np.searchsorted(times, until, side="right"))
            if end > first:
                rows = chunk.rows[:, first:end]
                rows = rows.copy() if chunk is newest else rows
                pieces.append((rows[0], rows[1]))
        return SampleColumns(tuple(pieces))

    @property
    def oldest_end(self) -> Instant:
        """Time of the last sample of the oldest chunk that can be dropped; infinite if there is none."""
        return self._chunks[0].last_t if len(self._chunks) > 1 else math.inf

    def drop_oldest(self) -> int:
        """Drop the oldest chunk, never the one being written. Returns the bytes freed."""
        return self._chunks.popleft().rows.nbytes if len(self._chunks) > 1 else 0

    def drop_before(self, t: Instant) -> int:
        """Drop chunks that end before `t`. Returns the bytes freed."""
        freed = 0
        while self.oldest_end < t:
            freed += self.drop_oldest()
        return freed
