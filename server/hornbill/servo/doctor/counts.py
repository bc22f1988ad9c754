"""Counters of the adapter and of our requests within the last minute, one sample per second."""

from collections import deque
from itertools import pairwise
from typing import Final, NamedTuple

from hornbill.node.requests import RequestCounters
from hornbill.units import Instant
from hornbill.wire.port import PortStatistics

RETAIN_S: Final = 60.0
_SAMPLE_S: Final = 1.0


class Sample(NamedTuple):
    """Counters at an instant, or their increase between two instants; then `at` is the time between them, s."""

    at: float
    rx_frames: int = 0
    rx_dropped: int = 0
    ignored: int = 0
    errors: int = 0
    error_frames: int = 0
    unacknowledged: int = 0
    busy_s: float = 0.0
    tries: int = 0
    """Requests sent, including retries."""
    line_bytes: int = 0
    """Bytes received over the serial line."""

    @property
    def disturbances(self) -> int:
        """Errors other than missing acknowledgements."""
        return max(0, self.errors - self.unacknowledged)

    @property
    def bus_errors(self) -> int:
        """Disturbances seen on the bus."""
        return max(0, self.error_frames - self.unacknowledged)

    def since(self, earlier: "Sample") -> "Sample":
        """Increase since `earlier`, never negative."""
        return Sample(*(max(0, now - then) for now, then in zip(self, earlier, strict=True)))  # pyright: ignore[reportArgumentType] - each keeps its kind


def sample(statistics: PortStatistics, requests: RequestCounters, now: Instant) -> Sample:
    """The present counters."""
    return Sample(
        now, statistics.rx_frames, statistics.rx_dropped, statistics.ignored, statistics.errors,
        statistics.error_frames, statistics.unacknowledged, statistics.busy_s, requests.requests + requests.retries,
        statistics.line_bytes,
    )  # fmt: skip


class CounterHistory:
    """Ring buffer of samples, and the latest counters."""

    def __init__(self, first: Sample) -> None:
        self.latest = first
        self._samples: deque[Sample] = deque([first], maxlen=int(RETAIN_S / _SAMPLE_S) + 1)

    def take(self, now: Sample) -> None:
        """Update the counters. May be called at any rate."""
        self.latest = now
        if now.at - self._samples[-1].at >= _SAMPLE_S:
            self._samples.append(now)

    def over(self, seconds: float) -> Sample:
        """Increase within the last `seconds` (up to 60), or since the start."""
        begin = self.latest.at - seconds
        earlier = self._samples[0]
        for each in self._samples:
            if each.at > begin:
                break
            earlier = each
        return self.latest.since(earlier)

    def disturbed(self) -> list[Instant]:
        """Ends of the seconds with disturbances within the last minute."""
        ends = (*self._samples, self.latest)
        return [after.at for before, after in pairwise(ends) if after.since(before).disturbances]
