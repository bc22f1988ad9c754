"""Event log: every change encoded once as JSON, numbered, and read by WebSockets and event streams with cursors."""

import asyncio
import secrets
from collections import OrderedDict, deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from itertools import islice, takewhile
from typing import Any, Final, NamedTuple

import orjson

from hornbill import __version__
from hornbill.api import present
from hornbill.api.live import messages
from hornbill.api.live.telemetry_batches import BATCH_S, TelemetryBatches
from hornbill.servo.device.reading import STALE_AFTER_S
from hornbill.servo.host import Host
from hornbill.servo.runtime.hub import (
    BusChanged,
    Change,
    JobChanged,
    LeaseChanged,
    LogEvent,
    ReadingChanged,
    ServoChanged,
    StopChanged,
)
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.units import Uid

ENTRIES_KEPT: Final = 10_000
BYTES_KEPT: Final = 8 << 20
"""Limits of a buffer; the first one reached applies."""

LINGER_S: Final = 60.0
"""How long the log continues after its last client, so that clients can resume."""

REFRESH_S: Final = 1.0
"""Period at which sockets receive every online servo again, so that ages and uptimes advance."""

EVENTS_KEPT: Final = 200
SERVOS_A_TIME: Final = 50
READINGS_A_TIME: Final = 100
REFRESHED_A_TIME: Final = 4
"""Encoded per batch; for the periodic refresh, per turn of the event loop. When many servos change at once, the rest
follows in later batches, so that the event loop stays responsive for motion and stop."""

ALWAYS: Final = "always"
"""Topic that every client receives: the stop latch and the lease."""
REFRESH: Final = "refresh"
"""Topic of the periodic servo messages, which only sockets receive."""
TELEMETRY: Final = "telemetry"


class LogEntry(NamedTuple):
    """One message without `type` and `seq`.

    `json`: its members, or of a `servos` message the one servo. An entry replaces the earlier one with the same `key`.
    """

    topic: str
    type: str
    uid: str | None
    json: str
    key: str | None = None

    @property
    def members(self) -> str:
        """The members as JSON, without braces."""
        return f'"servos":[{self.json}]' if self.type == "servos" else self.json


class EventBuffer:
    """Recent entries by number: all entries without a key, and the newest of each key. `name` is unique per buffer."""

    def __init__(self, entries: int = ENTRIES_KEPT, size: int = BYTES_KEPT) -> None:
        self.name = secrets.token_hex(4)
        self.next = 0
        """Number of the next entry."""
        self._first = 0
        self._limits = entries, size
        self._entries: OrderedDict[int, LogEntry] = OrderedDict()
        self._newest: dict[str, int] = {}
        self._bytes = 0

    def put(self, entry: LogEntry) -> None:
        """Append an entry; drop the oldest beyond the limits."""
        if entry.key is not None:
            older = self._newest.pop(entry.key, None)
            if older is not None:
                self._bytes -= len(self._entries.pop(older).json)
            self._newest[entry.key] = self.next
        self._entries[self.next] = entry
        self._bytes += len(entry.json)
        self.next += 1
        entries, size = self._limits
        while len(self._entries) > entries or self._bytes > size:
            number, gone = self._entries.popitem(last=False)
            self._first = number + 1
            self._bytes -= len(gone.json)
            self._newest.pop(gone.key or "", None)

    def since(self, place: int) -> tuple[int, list[tuple[int, LogEntry]]]:
        """Number of entries lost since `place`, and the remaining ones with their numbers."""
        found = list(takewhile(lambda item: item[0] >= place, reversed(self._entries.items())))
        return max(0, self._first - place), found[::-1]


@dataclass(eq=False)
class Cursor:
    """Subscription of one client, and its position in each buffer."""

    topics: set[str]
    uids: set[str] | None = None
    """Servos it is limited to; null for all."""
    places: dict[str, int] = field(default_factory=dict[str, int])
    """Number of the next entry to read, by the name of the buffer."""
    waiting: asyncio.Event = field(default_factory=asyncio.Event)
    """Set when there may be something to read."""
    over: bool = False

    def wants(self, entry: LogEntry) -> bool:
        """Whether the client receives this entry."""
        named = entry.topic == ALWAYS or entry.topic in self.topics
        return named and (entry.uid is None or self.uids is None or entry.uid in self.uids)

    def end(self) -> None:
        """End the stream."""
        self.over = True
        self.waiting.set()


class EventLog:
    """Shared subscription to the hub, from the first client until LINGER_S after the last."""

    def __init__(self, host: Host, *, demo: bool) -> None:
        self.host = host
        self.over = False
        self.telemetry = TelemetryBatches(host.hub, host.base.now)
        self.dropped = 0
        """Samples dropped because a socket was too slow."""
        self._demo = demo
        self._buffers: dict[str, EventBuffer] = {}
        self._left_at = self._sampled_at = 0.0
        self._cursors: set[Cursor] = set()
        self._servos: dict[Uid, None] = {}
        self._readings: dict[tuple[Uid, str], None] = {}
        self._jobs: dict[str, RunningJob] = {}
        self._events: deque[tuple[float, LogEvent]] = deque(maxlen=EVENTS_KEPT)
        self._flags: set[str] = set()
        self._unsubscribe: Callable[[], None] | None = None
        self._batch: asyncio.TimerHandle | None = None
        self._second: asyncio.TimerHandle | None = None
        self._next_at = 0.0

    @property
    def listening(self) -> bool:
        """Whether changes are recorded."""
        return self._unsubscribe is not None

    def join(self, cursor: Cursor) -> None:
        """Start waking `cursor` when there are entries for it."""
        self._cursors.add(cursor)
        if self._unsubscribe is None:
            self._unsubscribe = self.host.hub.subscribe(
                self._on_change,
                ServoChanged, ReadingChanged, JobChanged, LogEvent, BusChanged, LeaseChanged, StopChanged,
            )  # fmt: skip
            self._buffers[ALWAYS] = EventBuffer()
            self._tick()
        self.collect()

    def leave(self, cursor: Cursor) -> None:
        """Stop waking `cursor`. Idempotent."""
        self._cursors.discard(cursor)
        self._left_at = self._now()

    def close(self) -> None:
        """End every event stream. Sockets end with their connection."""
        self.over = True
        for cursor in self._cursors:
            cursor.end()

    def changes(self) -> EventBuffer:
        """Buffer of everything except telemetry. Exists only while a cursor has joined."""
        return self._buffers[ALWAYS]

    def samples(self) -> EventBuffer:
        """Buffer of telemetry, for event streams; recording starts with the first call."""
        self._sampled_at = self._now()
        if TELEMETRY not in self._buffers:
            self._buffers[TELEMETRY] = EventBuffer()
            self.telemetry.join(self)
        return self._buffers[TELEMETRY]

    def hello(self, seq: int) -> str:
        """The first message of every client."""
        base = self.host.base
        return messages.Hello(
            type="hello", seq=seq, version=__version__, schema_revision=self.host.catalog.revision,
            utc_offset=base.utc_offset, now=base.now(), demo=self._demo, stale_after_s=STALE_AFTER_S,
        ).model_dump_json()  # fmt: skip

    def state(self, topics: Iterable[str], *, recent: bool = True) -> Iterator[LogEntry]:
        """Current state of `topics`, encoded lazily; with `recent`, also the latest events."""
        host = self.host
        if ALWAYS in topics:
            yield from self._flagged({"stop", "lease"})
        if "bus" in topics:
            yield from self._flagged({"bus"})
        if "jobs" in topics:
            yield from (_job(job) for job in host.jobs.all() if not job.ended)
        if "servos" in topics:
            yield from self._packed_servos([one.uid for one in host.fleet.all()])
        if "events" in topics and recent:
            yield from (_event(at, event) for at, event in list(host.events))

    def readings(self) -> Iterator[LogEntry]:
        """Every reading of every servo, encoded lazily."""
        for one in self.host.fleet.all():
            yield from self._packed_readings((one.uid, key) for key in list(one.registers))

    def collect(self) -> None:
        """Record changes and wake the clients."""
        if self._batch is not None:
            self._batch.cancel()
            self._batch = None
        self._next_at = self._now() + BATCH_S
        flags, self._flags = self._flags, set[str]()
        jobs, self._jobs = self._jobs, dict[str, RunningJob]()
        uids = list(islice(self._servos, SERVOS_A_TIME))
        readings = list(islice(self._readings, READINGS_A_TIME))
        put = self.changes().put
        for entry in (
            *self._flagged(flags), *map(_job, jobs.values()), *self._packed_servos(uids),
            *self._packed_readings(readings), *(_event(at, event) for at, event in self._events),
        ):  # fmt: skip
            put(entry)
        self._events.clear()
        for uid in uids:
            del self._servos[uid]
        for place in readings:
            del self._readings[place]
        if TELEMETRY in self._buffers:
            for uid, channels in self.telemetry.take(self):
                members = f'"uid":"{uid}","channels":{channels},"dropped":0'
                self._buffers[TELEMETRY].put(LogEntry(TELEMETRY, TELEMETRY, uid, members))
        if self._servos or self._readings:
            self.wake()
        for cursor in self._cursors:
            cursor.waiting.set()

    def wants(self, uid: Uid) -> bool:
        """True: telemetry of every servo is recorded."""
        return True

    def wake(self) -> None:
        """Schedule `collect`, at most once per BATCH_S."""
        if self._batch is None and self._unsubscribe is not None:
            delay = max(0.0, self._next_at - self._now())
            self._batch = asyncio.get_running_loop().call_later(delay, self.collect)

    def missed(self, samples: int) -> None:
        """Batches are taken immediately, so none is missed."""

    def _on_change(self, change: Change) -> None:
        match change:
            case ServoChanged():
                self._servos[change.uid] = None
            case ReadingChanged():
                self._readings[change.uid, change.key] = None
                self._servos[change.uid] = None
            case LogEvent():
                if len(self._events) == EVENTS_KEPT:
                    self.collect()
                self._events.append((self.host.base.utc_now(), change))
            case JobChanged():
                self._jobs[change.job.id] = change.job
            case BusChanged():
                self._flags.add("bus")
            case LeaseChanged():
                self._flags.add("lease")
            case StopChanged():
                self._flags.add("stop")
            case _:
                return
        self.wake()

    def _tick(self) -> None:
        """Every REFRESH_S: refresh the servos of sockets, and stop after LINGER_S without a client."""
        self._second = asyncio.get_running_loop().call_later(REFRESH_S, self._tick)
        watched = any(REFRESH in cursor.topics for cursor in self._cursors)
        self._refresh([one.uid for one in self.host.fleet.all() if one.online and watched])
        since = self._now() - LINGER_S
        if not self._cursors and self._left_at < since:
            self._suspend()
        elif self._sampled_at < since:
            self._stop_telemetry()

    def _refresh(self, uids: list[Uid]) -> None:
        """Encode a few of these servos again, and the rest in later turns of the event loop; then wake the clients."""
        if not self.listening:
            return
        for entry in self._packed_servos(uids[:REFRESHED_A_TIME]):
            self.changes().put(entry._replace(topic=REFRESH, key=f"refresh {entry.uid}"))
        if rest := uids[REFRESHED_A_TIME:]:
            asyncio.get_running_loop().call_soon(self._refresh, rest)
            return
        for cursor in self._cursors:
            cursor.waiting.set()

    def _suspend(self) -> None:
        for timer in (self._batch, self._second):
            if timer is not None:
                timer.cancel()
        if self._unsubscribe is not None:
            self._unsubscribe()
        self._batch = self._second = self._unsubscribe = None
        self._stop_telemetry()
        self._buffers.clear()

    def _stop_telemetry(self) -> None:
        self.telemetry.leave(self)
        self._buffers.pop(TELEMETRY, None)

    def _flagged(self, flags: set[str]) -> Iterable[LogEntry]:
        host = self.host
        if "stop" in flags:
            yield LogEntry(ALWAYS, "stop", None, f'"stop":{present.stop(host).model_dump_json()}', "stop")
        if "lease" in flags:
            held = [present.lease_view(host, one).model_dump_json() for one in host.leases.valid(host.base.now())]
            members = f'"lease":{held[0] if held else "null"},"leases":[{",".join(held)}]'
            yield LogEntry(ALWAYS, "lease", None, members, "lease")
        if "bus" in flags:
            yield LogEntry("bus", "bus", None, f'"bus":{present.bus(host).model_dump_json()}', "bus")

    def _packed_servos(self, uids: Iterable[Uid]) -> Iterable[LogEntry]:
        fleet = self.host.fleet
        for uid in uids:
            if fleet.knows(uid):
                packed = present.servo(self.host, fleet.get(uid)).model_dump_json()
                yield LogEntry("servos", "servos", uid, packed, f"servo {uid}")

    def _packed_readings(self, places: Iterable[tuple[Uid, str]]) -> Iterable[LogEntry]:
        fleet = self.host.fleet
        for uid, key in places:
            if fleet.knows(uid) and key in (servo := fleet.get(uid)).registers:
                packed = present.reading_json(self.host, servo, key).decode()
                yield LogEntry("servos", "parameter", uid, f'"uid":"{uid}","reading":{packed}', f"{key} {uid}")

    def _now(self) -> float:
        return self.host.base.now()


def log_of(state: Any, host: Host) -> EventLog:
    """Event log of an application; created for its first client, and again when the host is replaced."""
    found: EventLog | None = getattr(state, "event_log", None)
    if found is None or found.over or found.host is not host:
        if found is not None:
            found.close()
        found = state.event_log = EventLog(host, demo=bool(state.demo))
    return found


def is_followed(state: Any) -> bool:
    """Whether an application has a client with a live stream, or had one LINGER_S ago."""
    log: EventLog | None = getattr(state, "event_log", None)
    return log is not None and log.listening


def _job(job: RunningJob) -> LogEntry:
    return LogEntry("jobs", "job", None, f'"job":{present.job(job).model_dump_json()}', f"job {job.id}")


def _event(at: float, event: LogEvent) -> LogEntry:
    members = {
        "at": at, "level": event.level, "uid": event.uid, "code": event.code, "text": event.text,
        "params": event.params,
    }  # fmt: skip
    return LogEntry("events", "event", None, orjson.dumps(members).decode()[1:-1])
