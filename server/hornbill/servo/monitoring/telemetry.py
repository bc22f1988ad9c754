"""Telemetry: the last minutes of every channel of every servo, with marks for gaps, wraps and restarts."""

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import chain
from typing import Literal

from hornbill.servo.device.servo import Servo
from hornbill.servo.monitoring.sample_ring import NO_SAMPLES, SampleColumns, SampleRing
from hornbill.servo.runtime.hub import Hub, LogEvent, Sampled, ServoChanged
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant, Uid

MINUTES = 10.0
"""Default retention of a channel, minutes."""

MAX_BYTES = 128_000_000
"""Limit of all rings together, above which the oldest samples of any servo are dropped. A full bus produces about 2000
samples per second: ten minutes take 20 MB."""

SILENCE_S = 5.0
"""A channel without samples for this time, and for three times its last interval, has a gap."""

WRAP_DEG = 180.0
WRAP_WITHIN_S = 0.25
"""Samples this close in time cannot be half a turn apart unless the angle wrapped at ±180° (4.17)."""

RATE_OVER_S = 5.0
MAX_MARKS = 1000

ANGLE = "current_angle"

Mark = tuple[Instant, Literal["wrap", "inactive", "gap", "restart"]]


@dataclass(slots=True)
class _Channel:
    ring: SampleRing
    marks: deque[Mark] = field(default_factory=lambda: deque[Mark](maxlen=MAX_MARKS))
    inactive: bool = False
    last_at: Instant | None = None


@dataclass(slots=True)
class _Presence:
    online: bool
    boot_count: int


class TelemetryCollector:
    """Collects samples from the hub. Never interpolates: a gap is a published sample of None.

    Times are seconds on the server's clock; see TimeBase for UTC.
    """

    def __init__(
        self,
        hub: Hub,
        base: TimeBase,
        find: Callable[[Uid], Servo | None],
        *,
        minutes: float = MINUTES,
        max_bytes: int = MAX_BYTES,
    ) -> None:
        """`find` returns the servo with a UID. Retains `minutes` of every channel in at most `max_bytes`."""
        self.retention_s = minutes * 60
        self._most_bytes = max_bytes
        self._hub = hub
        self._base = base
        self._find = find
        self._channels: dict[Uid, dict[str, _Channel]] = {}
        self._presence: dict[Uid, _Presence] = {}
        self._bytes = 0
        self._set_aside: tuple[dict[Uid, dict[str, _Channel]], dict[Uid, _Presence], int] | None = None
        self._publishing_gap = False
        hub.subscribe(self._on_sample, Sampled)
        hub.subscribe(self._on_servo, ServoChanged)
        hub.subscribe(self._on_event, LogEvent)

    @property
    def bytes(self) -> int:
        """Memory used by the rings of all channels, bytes."""
        return self._bytes

    def set_aside(self) -> None:
        """Set live samples aside and start empty, for a recording. Idempotent."""
        if self._set_aside is None:
            self._set_aside = self._channels, self._presence, self._bytes
            self._channels, self._presence, self._bytes = {}, {}, 0

    def restore(self) -> None:
        """Restore the live samples and discard those collected since. No effect if none were set aside."""
        if self._set_aside is not None:
            (self._channels, self._presence, self._bytes), self._set_aside = self._set_aside, None

    def channels(self, uid: Uid) -> Iterable[str]:
        """Keys of this servo that have samples."""
        return list(self._channels.get(uid, ()))

    def window(
        self, uid: Uid, key: str, since: Instant, until: Instant | None = None
    ) -> tuple[list[Instant], list[float | None]]:
        """Times and values of one channel from `since` to `until`, inclusive. None is a gap or inactive."""
        times, values = self.columns(uid, key, since, until).joined()
        # NaN is not equal to itself
        return times.tolist(), [value if value == value else None for value in values.tolist()]

    def columns(self, uid: Uid, key: str, since: Instant, until: Instant | None = None) -> SampleColumns:
        """The same as arrays, in pieces. Not affected by later samples."""
        channel = self._channels.get(uid, {}).get(key)
        return NO_SAMPLES if channel is None else channel.ring.window(since, until)

    def marks(self, uid: Uid, key: str, since: Instant) -> list[Mark]:
        """Marks of a channel since an instant: angle wrapped, command inactive, gap, restart. The newest 1000."""
        channel = self._channels.get(uid, {}).get(key)
        return [] if channel is None else [mark for mark in channel.marks if mark[0] >= since]

    def measured(self, uid: Uid, key: str) -> tuple[float, float | None]:
        """Measured samples per second over the last 5 s, and the age of the last sample, s (None: never)."""
        channel, now = self._channels.get(uid, {}).get(key), self._base.now()
        if channel is None:
            return 0.0, None
        count = channel.ring.window(now - RATE_OVER_S).count
        return count / RATE_OVER_S, None if channel.last_at is None else now - channel.last_at

    def _on_sample(self, sample: Sampled) -> None:
        channel = self._channel(sample.uid, sample.key)
        ring, value = channel.ring, sample.value
        before, at = ring.last_v, ring.last_t
        silent = not self._publishing_gap and sample.t - at > max(SILENCE_S, 3 * ring.last_interval)
        if silent and before == before:
            self._gap(sample.uid, sample.key, at + SILENCE_S, "gap")
        if self._publishing_gap:
            channel.inactive = False
        else:
            channel.last_at = sample.t
            if value is None and not channel.inactive:
                channel.marks.append((sample.t, "inactive"))
            channel.inactive = value is None
        if sample.key == ANGLE and value is not None and 0 <= sample.t - at < WRAP_WITHIN_S:
            self._check_wrap(sample, abs(value - before), channel)
        grown = ring.append(sample.t, float("nan") if value is None else value)
        if grown:
            self._bytes += grown
            self._bytes -= ring.drop_before(sample.t - self.retention_s)
            if self._bytes > self._most_bytes:
                self._drop_oldest()

    def _channel(self, uid: Uid, key: str) -> _Channel:
        channels = self._channels.get(uid)
        if channels is None:
            channels = self._channels[uid] = {}
        found = channels.get(key)
        if found is None:
            found = channels[key] = _Channel(SampleRing())
        return found

    def _check_wrap(self, sample: Sampled, jump_deg: float, channel: _Channel) -> None:
        servo = self._find(sample.uid) if jump_deg > WRAP_DEG else None
        if servo is not None and servo.raw("extended_angle") != 1:
            channel.marks.append((sample.t, "wrap"))

    def _on_servo(self, change: ServoChanged) -> None:
        servo = self._find(change.uid)
        if servo is None:
            return
        known = self._presence.get(change.uid)
        if known is None:
            self._presence[change.uid] = _Presence(servo.online, servo.boot_count)
            return
        restarted, silent = known.boot_count != servo.boot_count, known.online and not servo.online
        known.online, known.boot_count = servo.online, servo.boot_count
        if restarted or silent:
            self._gaps(change.uid, "restart" if restarted else "gap")

    def _on_event(self, change: LogEvent) -> None:
        if change.code == "bus_lost":
            for uid in list(self._channels):
                self._gaps(uid, "gap")

    def _gaps(self, uid: Uid, why: Literal["gap", "restart"]) -> None:
        """Add a gap to all channels of a servo."""
        now = self._base.now()
        for key, channel in list(self._channels.get(uid, {}).items()):
            if why == "restart" or channel.ring.last_v == channel.ring.last_v:
                self._gap(uid, key, max(now, channel.ring.last_t), why)

    def _gap(self, uid: Uid, key: str, at: Instant, why: Literal["gap", "restart"]) -> None:
        self._channels[uid][key].marks.append((at, why))
        self._publishing_gap = True
        try:
            self._hub.publish(Sampled(uid, key, at, None))
        finally:
            self._publishing_gap = False

    def _drop_oldest(self) -> None:
        """Drop the oldest samples of any servo until within the limit."""
        rings = [one.ring for one in chain.from_iterable(each.values() for each in self._channels.values())]
        while self._bytes > self._most_bytes:
            oldest = min(rings, key=lambda ring: ring.oldest_end)
            freed = oldest.drop_oldest()
            if not freed:
                return  # every channel has only the chunk being written
            self._bytes -= freed
