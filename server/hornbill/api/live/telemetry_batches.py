"""Telemetry batches, encoded once for all sockets, at a rate that all sockets can be served."""

import asyncio
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Protocol

import orjson

from hornbill.servo.runtime.hub import Hub, Sampled
from hornbill.units import Instant, Uid

BATCH_S = 1 / 30
"""Minimum time between two batches; changes in between are sent together."""

TELEMETRY_PER_S = 500
"""Telemetry messages per second and socket: with more servos, messages are less frequent and contain more samples."""

ALL_PER_S = 1000
"""Telemetry messages per second to all sockets together. Sending one takes about 20 µs, regardless of its size."""

KEPT_S = 20.0
SAMPLES_KEPT = 50_000
"""Samples retained for a slow socket: at most this time and number over all servos; older ones are dropped."""

Column = tuple[list[Instant], list[float | None]]
Columns = dict[str, Column]


class Reader(Protocol):
    """Consumer of batches, such as the queue of a socket."""

    def wants(self, uid: Uid) -> bool:
        """Whether it receives this servo."""
        ...

    def wake(self) -> None:
        """Signal that a batch is pending."""
        ...

    def missed(self, samples: int) -> None:
        """Report the number of samples that were dropped before this reader took them."""
        ...


@dataclass(slots=True)
class _Batch:
    number: int
    closed_at: Instant
    servos: dict[Uid, Columns]
    samples: int


class TelemetryBatches:
    """Batches of samples. Every reader has its own position, so that a slow reader gets several batches merged, or
    loses the oldest. Each batch is encoded once for all readers.
    """

    def __init__(self, hub: Hub, now: Callable[[], Instant]) -> None:
        self._hub = hub
        self._now = now
        self._open: dict[Uid, Columns] = {}
        self._batches: deque[_Batch] = deque()
        self._kept = 0
        self._next = 0
        self._next_at: Instant = 0.0
        self._alarm: asyncio.TimerHandle | None = None
        self._packed: dict[tuple[int, int, Uid], str] = {}
        self._places: dict[Reader, int] = {}
        self._unsubscribe: Callable[[], None] | None = None

    def join(self, reader: Reader) -> None:
        """Start delivering samples to this reader."""
        self.flush()
        self._places[reader] = self._next
        if self._unsubscribe is None:
            self._unsubscribe = self._hub.subscribe(self._on_sample, Sampled)

    def leave(self, reader: Reader) -> None:
        """Stop delivering samples to this reader. Idempotent."""
        self._places.pop(reader, None)
        if not self._places and self._unsubscribe is not None:
            self._unsubscribe()
            self._unsubscribe = None
            self.flush()
            self._batches.clear()
            self._kept = 0

    def take(self, reader: Reader) -> Iterable[tuple[Uid, str]]:
        """Pending samples of a reader, as one JSON object of channels per servo."""
        place = self._places.get(reader, self._next)
        if place == self._next:
            return []
        self._places[reader] = self._next
        waiting = [batch for batch in self._batches if batch.number >= place]
        uids = dict.fromkeys(uid for batch in waiting for uid in batch.servos if reader.wants(uid))
        return [(uid, self._pack(waiting, uid)) for uid in uids]

    def flush(self) -> None:
        """Close the open batch unless it is empty."""
        if self._alarm is not None:
            self._alarm.cancel()
            self._alarm = None
        if not self._open:
            return
        servos, self._open = self._open, {}
        now = self._now()
        samples = sum(len(times) for columns in servos.values() for times, _ in columns.values())
        self._batches.append(_Batch(self._next, now, servos, samples))
        self._kept += samples
        self._next += 1
        self._packed.clear()
        self._drop_old(now)
        counts = [sum(1 for uid in servos if reader.wants(uid)) for reader in self._places]
        most = max(counts, default=0)
        self._next_at = now + max(BATCH_S, most / TELEMETRY_PER_S, sum(counts) / ALL_PER_S)
        for reader, count in zip(self._places, counts, strict=True):
            if count:
                reader.wake()

    def _on_sample(self, sample: Sampled) -> None:
        columns = self._open.get(sample.uid)
        if columns is None:
            columns = self._open[sample.uid] = {}
        column = columns.get(sample.key)
        if column is None:
            column = columns[sample.key] = ([], [])
        column[0].append(round(sample.t, 4))
        column[1].append(sample.value)
        if self._alarm is None:
            loop = asyncio.get_running_loop()
            self._alarm = loop.call_later(max(0.0, self._next_at - self._now()), self.flush)

    def _drop_old(self, now: Instant) -> None:
        while self._kept > SAMPLES_KEPT or now - self._batches[0].closed_at > KEPT_S:
            if len(self._batches) == 1:
                return
            batch = self._batches.popleft()
            self._kept -= batch.samples
            for reader, place in self._places.items():
                if place <= batch.number:
                    reader.missed(_samples(batch, reader))
        behind = min(self._places.values(), default=self._next)
        while self._batches and self._batches[0].number < behind:
            self._kept -= self._batches.popleft().samples  # taken by every reader

    def _pack(self, waiting: list[_Batch], uid: Uid) -> str:
        key = (waiting[0].number, waiting[-1].number, uid)
        found = self._packed.get(key)
        if found is None:
            found = self._packed[key] = orjson.dumps(packable(_merged(waiting, uid))).decode()
        return found


def packable(columns: Columns) -> dict[str, Any]:
    """Columns in the form of `channels` of a TelemetryMessage."""
    return {key: {"t": times, "v": values} for key, (times, values) in columns.items()}


def _merged(batches: list[_Batch], uid: Uid) -> Columns:
    if len(batches) == 1:
        return batches[0].servos[uid]
    merged: Columns = {}
    for batch in batches:
        for key, (times, values) in batch.servos.get(uid, {}).items():
            column = merged.setdefault(key, ([], []))
            column[0].extend(times)
            column[1].extend(values)
    return merged


def _samples(batch: _Batch, reader: Reader) -> int:
    return sum(
        len(times) for uid, columns in batch.servos.items() if reader.wants(uid) for times, _ in columns.values()
    )
