"""Counters and histograms of the servo layer for metrics, since the start of the process."""

from bisect import bisect_left
from collections import Counter
from collections.abc import Sequence

from hornbill.servo.runtime.hub import Hub, JobChanged, LogEvent


class Histogram:
    """Histogram of durations with fixed bounds. Adding a duration takes about 1 µs."""

    __slots__ = ("bounds", "counts", "total_s")

    def __init__(self, bounds: Sequence[float]) -> None:
        """`bounds` in seconds, ascending; a duration counts towards the first bound it does not exceed."""
        self.bounds = bounds
        self.counts = [0] * (len(bounds) + 1)
        self.total_s = 0.0

    def add(self, took_s: float) -> None:
        """Add a duration, s."""
        self.counts[bisect_left(self.bounds, took_s)] += 1
        self.total_s += took_s

    def cumulative(self) -> list[tuple[str, float]]:
        """Upper bound and cumulative count of each bucket, as Prometheus expects. The last bucket counts all."""
        found: list[tuple[str, float]] = []
        seen = 0
        for bound, count in zip((*map(str, self.bounds), "+Inf"), self.counts, strict=True):
            seen += count
            found.append((bound, seen))
        return found


class Counts:
    """Counters of published events and jobs."""

    def __init__(self, hub: Hub) -> None:
        self.events: Counter[tuple[str, str]] = Counter()
        """Entries of the event log, by level and code."""
        self.jobs: Counter[tuple[str, str]] = Counter()
        """Jobs that have ended, by kind and state."""
        hub.subscribe(self._on_event, LogEvent)
        hub.subscribe(self._on_job, JobChanged)

    def _on_event(self, event: LogEvent) -> None:
        self.events[event.level, event.code] += 1

    def _on_job(self, change: JobChanged) -> None:
        if change.job.ended:
            self.jobs[change.job.kind, change.job.state] += 1
