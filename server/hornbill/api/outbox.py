"""Owns Outbox: what one socket has not been sent yet. Bounded, and the newest value wins."""

import asyncio
from collections import deque
from itertools import islice

import orjson

from hornbill import __version__
from hornbill.api import messages, present
from hornbill.api.feed import Column, Columns, Feed, packable
from hornbill.api.fragments import Fragments
from hornbill.api.frames import FrameWatch
from hornbill.servo.host import Host
from hornbill.servo.hub import (
    BusChanged,
    Change,
    Happened,
    JobChanged,
    LeaseChanged,
    ReadingChanged,
    ServoChanged,
    StopChanged,
)
from hornbill.servo.jobs import Job
from hornbill.units import Uid

EVENTS_KEPT = 200

SERVOS_A_TIME = 50
READINGS_A_TIME = 100
"""What is sent in one go: when a crowd goes silent, the thousands of readings that change with it wait for their
turn, and the loop with its motion and its stop does not wait for them."""

RECALL_S = 30.0
ANGLE = "current_angle"


class Shared:
    """What all sockets of a host have in common: everything is packed once."""

    def __init__(self, host: Host) -> None:
        self.host = host
        self.feed = Feed(host.hub, host.base.now)
        self.fragments = Fragments(host)
        self.dropped = 0
        """Samples that any socket was too slow for."""

    def close(self) -> None:
        """The host is another one now."""
        self.fragments.close()


class Outbox:
    """What one socket has not been sent yet. Bounded by what exists: one entry a servo, a reading, a job."""

    def __init__(self, shared: Shared, demo: bool) -> None:
        self._shared = shared
        self._host = shared.host
        self._demo = demo
        self._topics: set[str] = set()
        self._uids: set[str] | None = None
        self._seq = 0
        self._servos: dict[Uid, None] = {}
        self._readings: dict[tuple[Uid, str], None] = {}
        self._recalled: dict[Uid, Columns] = {}
        self._dropped = 0
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
            self._shared.feed.join(self)
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
                column: Column = ([round(t, 4) for t in times], values)
                if times:
                    self._recalled[one.uid] = {ANGLE: column}

    def unsubscribe(self, topics: list[messages.Topic]) -> None:
        """Fewer topics."""
        self._topics.difference_update(topics)
        if "telemetry" in topics:
            self._shared.feed.leave(self)
            self._recalled.clear()
        if "frames" in topics and self._frames is not None:
            self._frames.close()
            self._frames = None

    def close(self) -> None:
        """Nobody takes any more: watch the bus no longer."""
        self.unsubscribe(["frames", "telemetry"])

    def _watch_frames(self, wanted: messages.FrameFilter) -> None:
        """A new filter is a new subscription, and counts from nothing."""
        self.unsubscribe(["frames"])
        self._frames = FrameWatch(self._host.monitor, wanted, self.waiting.set)

    def refuse(self, code: str, detail: str, uid: str | None = None) -> None:
        """Tell this socket that one of its messages could not be done."""
        self._replies.append(messages.ErrorMessage(type="error", seq=0, code=code, detail=detail, uid=uid))
        self.waiting.set()

    def wants(self, uid: Uid) -> bool:
        """Whether this socket is told of a servo."""
        return self._uids is None or uid in self._uids

    def wake(self) -> None:
        """Telemetry waits."""
        self.waiting.set()

    def missed(self, samples: int) -> None:
        """So many samples are gone before they could be sent."""
        self._dropped += samples
        self._shared.dropped += samples

    def on_change(self, change: Change) -> None:
        """Take a change from the hub, but for samples; only what the socket asked for is kept."""
        match change:
            case ServoChanged() if "servos" in self._topics and self.wants(change.uid):
                self._servos[change.uid] = None
            case ReadingChanged() if "servos" in self._topics and self.wants(change.uid):
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
            self._servos.update({one.uid: None for one in self._host.fleet.all() if one.online and self.wants(one.uid)})
            self.waiting.set()

    def hello(self) -> str:
        """The first message."""
        base = self._host.base
        return self._pack(
            messages.Hello(
                type="hello",
                seq=0,
                version=__version__,
                schema_revision=self._host.catalog.revision,
                utc_offset=base.utc_offset,
                now=base.now(),
                demo=self._demo,
            )
        )

    def take(self) -> list[str]:
        """What waits, as messages; what would be too much for one go stays, and is still waiting."""
        self.waiting.clear()
        out = [*self._states(), *map(self._pack, self._told()), *self._fleet(), *map(self._pack, self._happened())]
        out += self._telemetry()
        out += self._seen_frames()
        if self._servos or self._readings:
            self.waiting.set()
        return out

    def _states(self) -> list[str]:
        fragments, flags = self._shared.fragments, self._flags
        self._flags = set()
        shown = (("stop", fragments.stop), ("lease", fragments.lease), ("bus", fragments.bus))
        return [self._spliced(kind, f'"{kind}":{make()}') for kind, make in shown if kind in flags]

    def _told(self) -> list[messages.ServerMessageBase]:
        """Answers to this socket, and jobs."""
        jobs, self._jobs = self._jobs, {}
        replies = list(self._replies)
        self._replies.clear()
        return [*replies, *(messages.JobMessage(type="job", seq=0, job=present.job(job)) for job in jobs.values())]

    def _fleet(self) -> list[str]:
        fragments, out = self._shared.fragments, list[str]()
        uids = list(islice(self._servos, SERVOS_A_TIME))
        shown = [fragment for uid in uids if (fragment := fragments.servo(uid)) is not None]
        if uids:
            out.append(self._spliced("servos", f'"servos":[{",".join(shown)}]'))
        changed = list(islice(self._readings, READINGS_A_TIME))
        for uid, key in changed:
            fragment = fragments.reading(uid, key)
            if fragment is not None:
                out.append(self._spliced("parameter", f'"uid":"{uid}","reading":{fragment}'))
        for uid in uids:
            del self._servos[uid]
        for place in changed:
            del self._readings[place]
        return out

    def _happened(self) -> list[messages.EventMessage]:
        events, self._events = self._events, deque[tuple[float, Happened]](maxlen=EVENTS_KEPT)
        return [
            messages.EventMessage(
                type="event",
                seq=0,
                at=at,
                level=event.level,  # pyright: ignore[reportArgumentType]
                uid=event.uid,
                code=event.code,
                text=event.text,
            )
            for at, event in events
        ]

    def _seen_frames(self) -> list[str]:
        """Packed without a model, as telemetry is."""
        seen = None if self._frames is None else self._frames.take()
        if seen is None:
            return []
        self._seq += 1
        return [orjson.dumps({**seen, "seq": self._seq}).decode()]

    def _telemetry(self) -> list[str]:
        """Columns as the feed packed them for everybody: this is most of what a socket carries."""
        out: list[str] = []
        recalled, self._recalled = self._recalled, {}
        for uid, columns in recalled.items():
            out.append(self._samples(uid, orjson.dumps(packable(columns)).decode()))
        for uid, channels in self._shared.feed.take(self):
            out.append(self._samples(uid, channels))
        return out

    def _samples(self, uid: Uid, channels: str) -> str:
        dropped, self._dropped = self._dropped, 0
        return self._spliced("telemetry", f'"uid":"{uid}","channels":{channels},"dropped":{dropped}')

    def _spliced(self, kind: str, members: str) -> str:
        """A message of members that are JSON already."""
        self._seq += 1
        return f'{{"type":"{kind}","seq":{self._seq},{members}}}'

    def _pack(self, message: messages.ServerMessageBase) -> str:
        self._seq += 1
        message.seq = self._seq
        return orjson.dumps(message.model_dump()).decode()
