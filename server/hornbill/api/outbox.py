"""Owns Outbox: what one socket has not been sent yet. Bounded, and the newest value wins."""

import asyncio
from collections import deque

import orjson

from hornbill import __version__
from hornbill.api import messages, present
from hornbill.api.frames import FrameWatch
from hornbill.servo.host import Host
from hornbill.servo.hub import (
    BusChanged,
    Change,
    Happened,
    JobChanged,
    LeaseChanged,
    ReadingChanged,
    Sampled,
    ServoChanged,
    StopChanged,
)
from hornbill.servo.jobs import Job
from hornbill.servo.reading import reading
from hornbill.units import Uid

SAMPLES_KEPT = 2000
EVENTS_KEPT = 200
TELEMETRY_PER_S = 500
"""Messages of telemetry a second: when more servos stream, each is told of less often, with more samples at a time."""

RECALL_S = 30.0
ANGLE = "current_angle"


class Outbox:
    """What one socket has not been sent yet. Bounded by what exists: one entry a servo, a reading, a job."""

    def __init__(self, host: Host, demo: bool) -> None:
        self._host = host
        self._demo = demo
        self._topics: set[str] = set()
        self._uids: set[str] | None = None
        self._seq = 0
        self._servos: dict[Uid, None] = {}
        self._readings: dict[tuple[Uid, str], None] = {}
        self._samples: dict[Uid, dict[str, deque[tuple[float, float | None]]]] = {}
        self._dropped = 0
        self._telemetry_at = 0.0
        self._events: deque[tuple[float, Happened]] = deque(maxlen=EVENTS_KEPT)
        self._jobs: dict[str, Job] = {}
        self._flags: set[str] = {"lease", "stop"}
        self._replies: deque[messages.ErrorMessage] = deque(maxlen=EVENTS_KEPT)
        self._frames: FrameWatch | None = None
        self.waiting = asyncio.Event()
        self.waiting.set()

    def subscribe(
        self, topics: list[messages.Topic], uids: list[str] | None, frames: messages.FrameFilter | None = None
    ) -> None:
        """More topics; `uids` limits servos, readings and telemetry to these. What exists is sent at once."""
        if "frames" in topics or (frames is not None and self._frames is not None):
            self._watch_frames(frames or messages.FrameFilter())
        if "telemetry" in topics and "telemetry" not in self._topics:
            self._recall_angles(uids)
        self._topics.update(topics)
        self._uids = None if uids is None else set(uids)
        if "servos" in topics:
            self._servos.update({one.uid: None for one in self._host.fleet.all()})
        if "bus" in topics:
            self._flags.add("bus")
        if "events" in topics:
            self._events.extend(self._host.events)
        if "jobs" in topics:
            self._jobs.update({job.id: job for job in self._host.jobs.all() if not job.ended})
        self.waiting.set()

    def _recall_angles(self, uids: list[str] | None) -> None:
        """What sparklines show is there at once: every angle of the last 30 s."""
        since = self._host.base.now() - RECALL_S
        for one in self._host.fleet.all():
            if uids is None or one.uid in uids:
                times, values = self._host.telemetry.window(one.uid, ANGLE, since)
                column = deque(zip(times, values, strict=True), maxlen=SAMPLES_KEPT)
                self._samples.setdefault(one.uid, {})[ANGLE] = column

    def unsubscribe(self, topics: list[messages.Topic]) -> None:
        """Fewer topics."""
        self._topics.difference_update(topics)
        if "frames" in topics and self._frames is not None:
            self._frames.close()
            self._frames = None

    def close(self) -> None:
        """Nobody takes any more: watch the bus no longer."""
        self.unsubscribe(["frames"])

    def _watch_frames(self, wanted: messages.FrameFilter) -> None:
        """A new filter is a new subscription, and counts from nothing."""
        self.unsubscribe(["frames"])
        self._frames = FrameWatch(self._host.monitor, wanted, self.waiting.set)

    def refuse(self, code: str, detail: str, uid: str | None = None) -> None:
        """Tell this socket that one of its messages could not be done."""
        self._replies.append(messages.ErrorMessage(type="error", seq=0, code=code, detail=detail, uid=uid))
        self.waiting.set()

    def on_change(self, change: Change) -> None:
        """Take a change from the hub; only what the socket asked for is kept."""
        match change:
            case Sampled() if "telemetry" in self._topics and self._wants(change.uid):
                columns = self._samples.get(change.uid)
                if columns is None:
                    columns = self._samples[change.uid] = {}
                column = columns.get(change.key)
                if column is None:
                    column = columns[change.key] = deque(maxlen=SAMPLES_KEPT)
                self._dropped += len(column) == SAMPLES_KEPT
                column.append((change.t, change.value))
            case ServoChanged() if "servos" in self._topics and self._wants(change.uid):
                self._servos[change.uid] = None
            case ReadingChanged() if "servos" in self._topics and self._wants(change.uid):
                self._readings[change.uid, change.key] = None
                self._servos[change.uid] = None
            case Happened() if "events" in self._topics:
                self._events.append((self._host.base.utc_now(), change))
            case JobChanged() if "jobs" in self._topics:
                self._jobs[change.job.id] = change.job
            case BusChanged() if "bus" in self._topics:
                self._flags.add("bus")
            case LeaseChanged():
                self._flags.add("lease")
            case StopChanged():
                self._flags.add("stop")
            case _:
                return
        self.waiting.set()

    def refresh(self) -> None:
        """Send every servo that is online again, and what the bus brought even if the filter hid all of it."""
        if self._frames is not None:
            self.waiting.set()
        if "servos" in self._topics:
            self._servos.update(
                {one.uid: None for one in self._host.fleet.all() if one.online and self._wants(one.uid)}
            )
            self.waiting.set()

    def hello(self) -> bytes:
        """The first message."""
        base = self._host.base
        return self._pack(
            messages.Hello(
                type="hello",
                seq=0,
                version=__version__,
                schema_revision=self._host.catalog.revision,
                utc_offset=base.utc_offset,
                demo=self._demo,
            )
        )

    def take(self) -> list[bytes]:
        """Everything that waits, as messages; the outbox is empty after it."""
        self.waiting.clear()
        host, out = self._host, list[messages.ServerMessageBase]()
        flags, self._flags = self._flags, set[str]()
        if "stop" in flags:
            out.append(messages.StopStateMessage(type="stop", seq=0, stop=present.stop(host)))
        if "lease" in flags:
            lease = host.leases.current(host.base.now())
            shown = None if lease is None else present.lease_view(host, lease)
            out.append(messages.LeaseMessage(type="lease", seq=0, lease=shown))
        if "bus" in flags:
            out.append(messages.BusMessage(type="bus", seq=0, bus=present.bus(host)))
        out.extend(self._replies)
        self._replies.clear()
        jobs, self._jobs = self._jobs, {}
        out.extend(messages.JobMessage(type="job", seq=0, job=present.job(job)) for job in jobs.values())
        servos, self._servos = self._servos, {}
        if servos:
            shown = [present.servo(host, host.fleet.get(uid)) for uid in servos if host.fleet.knows(uid)]
            out.append(messages.ServosMessage(type="servos", seq=0, servos=shown))
        changed, self._readings = self._readings, {}
        for uid, key in changed:
            if host.fleet.knows(uid) and key in (servo := host.fleet.get(uid)).registers:
                shown = present.reading(reading(servo, key, host.base))
                out.append(messages.ParameterMessage(type="parameter", seq=0, uid=uid, reading=shown))
        for at, event in self._events:
            out.append(
                messages.EventMessage(
                    type="event",
                    seq=0,
                    at=at,
                    level=event.level,  # pyright: ignore[reportArgumentType]
                    uid=event.uid,
                    code=event.code,
                    text=event.text,
                )
            )
        self._events.clear()
        return [*map(self._pack, out), *self._telemetry(), *self._seen_frames()]

    def _seen_frames(self) -> list[bytes]:
        """Packed without a model, as telemetry is."""
        seen = None if self._frames is None else self._frames.take()
        if seen is None:
            return []
        self._seq += 1
        return [orjson.dumps({**seen, "seq": self._seq})]

    def _telemetry(self) -> list[bytes]:
        """Columns, packed without a model: this is most of what a socket carries."""
        now = self._host.base.now()
        if now < self._telemetry_at:
            if self._samples:
                self.waiting.set()  # their time comes soon
            return []
        self._telemetry_at = now + len(self._samples) / TELEMETRY_PER_S
        samples, self._samples = self._samples, {}
        dropped, self._dropped = self._dropped, 0
        packed: list[bytes] = []
        for uid, columns in samples.items():
            self._seq += 1
            channels = {
                key: {"t": [round(t, 4) for t, _ in column], "v": [v for _, v in column]}
                for key, column in columns.items()
            }
            packed.append(
                orjson.dumps(
                    {"type": "telemetry", "seq": self._seq, "uid": uid, "channels": channels, "dropped": dropped}
                )
            )
            dropped = 0
        return packed

    def _wants(self, uid: str) -> bool:
        return self._uids is None or uid in self._uids

    def _pack(self, message: messages.ServerMessageBase) -> bytes:
        self._seq += 1
        message.seq = self._seq
        return orjson.dumps(message.model_dump())
