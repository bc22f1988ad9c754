"""Owns Telemetry: the last minutes of every channel of every servo, in columns of bounded length."""

from collections import deque
from collections.abc import Iterable

from hornbill.servo.hub import Hub, Sampled
from hornbill.units import Instant, Uid

KEPT = 30_000
"""Samples kept a channel: ten minutes at 50 Hz."""


class Telemetry:
    """Collects samples from the hub; nothing is ever interpolated, and a gap is a sample of None."""

    def __init__(self, hub: Hub) -> None:
        self._columns: dict[tuple[Uid, str], tuple[deque[Instant], deque[float | None]]] = {}
        hub.listen(self._on_sample, Sampled)

    def window(self, uid: Uid, key: str, since: Instant) -> tuple[list[Instant], list[float | None]]:
        """Times and values of one channel since an instant."""
        times, values = self._columns.get((uid, key), ((), ()))
        kept = [(t, v) for t, v in zip(times, values, strict=True) if t >= since]
        return [t for t, _ in kept], [v for _, v in kept]

    def channels(self, uid: Uid) -> Iterable[str]:
        """Keys of which there are samples of this servo."""
        return [key for owner, key in self._columns if owner == uid]

    def _on_sample(self, sample: Sampled) -> None:
        column = self._columns.get((sample.uid, sample.key))
        if column is None:
            column = self._columns[sample.uid, sample.key] = (deque(maxlen=KEPT), deque(maxlen=KEPT))
        column[0].append(sample.t)
        column[1].append(sample.value)
