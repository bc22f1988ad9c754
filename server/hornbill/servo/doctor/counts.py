"""What the adapter and our requests counted within the last minute, a sample a second."""

from collections import deque
from itertools import pairwise
from typing import Final, NamedTuple

from hornbill.node.requests import RequestCounters
from hornbill.units import Instant
from hornbill.wire.port import PortStatistics

KEPT_S: Final = 60.0
_SAMPLE_S: Final = 1.0


class Sample(NamedTuple):
    """Counters at an instant, or how far they went from one to another: then `at` is the seconds between."""

    at: float
    rx_frames: int = 0
    rx_dropped: int = 0
    ignored: int = 0
    errors: int = 0
    error_frames: int = 0
    unacknowledged: int = 0
    busy_s: float = 0.0
    tries: int = 0
    """Requests of ours that went out, repetitions included."""
    line_bytes: int = 0
    """Bytes that came over a serial line."""

    @property
    def disturbances(self) -> int:
        """Errors that have another cause than nobody being there to acknowledge."""
        return max(0, self.errors - self.unacknowledged)

    @property
    def bus_errors(self) -> int:
        """Those of the disturbances that were seen on the wire."""
        return max(0, self.error_frames - self.unacknowledged)

    def since(self, earlier: "Sample") -> "Sample":
        """How far the counters went from `earlier` to this one; never below zero."""
        return Sample(*(max(0, now - then) for now, then in zip(self, earlier, strict=True)))  # pyright: ignore[reportArgumentType] - each keeps its kind


def sample(statistics: PortStatistics, requests: RequestCounters, now: Instant) -> Sample:
    """The counters as they stand."""
    return Sample(
        now, statistics.rx_frames, statistics.rx_dropped, statistics.ignored, statistics.errors,
        statistics.error_frames, statistics.unacknowledged, statistics.busy_s, requests.requests + requests.retries,
        statistics.line_bytes,
    )  # fmt: skip


class CounterHistory:
    """A ring of samples, and the counters as of the last look."""

    def __init__(self, first: Sample) -> None:
        self.latest = first
        self._samples: deque[Sample] = deque([first], maxlen=int(KEPT_S / _SAMPLE_S) + 1)

    def take(self, now: Sample) -> None:
        """Take the counters; call it as often as you like."""
        self.latest = now
        if now.at - self._samples[-1].at >= _SAMPLE_S:
            self._samples.append(now)

    def over(self, seconds: float) -> Sample:
        """How far the counters went within the last so many seconds (up to 60), or since the start."""
        begin = self.latest.at - seconds
        earlier = self._samples[0]
        for each in self._samples:
            if each.at > begin:
                break
            earlier = each
        return self.latest.since(earlier)

    def disturbed(self) -> list[Instant]:
        """The ends of those seconds within the last minute in which there were disturbances."""
        ends = (*self._samples, self.latest)
        return [after.at for before, after in pairwise(ends) if after.since(before).disturbances]
