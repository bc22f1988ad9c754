"""Owns Tape: what all event streams are told, once and in order, kept for a while for those that come back."""

import asyncio
from collections import deque
from collections.abc import Iterable
from itertools import islice
from typing import Final

import orjson

from hornbill import __version__
from hornbill.api import messages, present
from hornbill.api.feed import BATCH_S
from hornbill.api.outbox import EVENTS_KEPT, READINGS_A_TIME, SERVOS_A_TIME, Shared
from hornbill.api.rings import ALWAYS, TELEMETRY, Entry, Reader, Ring
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

LINGER_S: Final = 60.0
"""How long it is told on when nobody listens, for those that come back."""


class Tape:
    """Listens to the hub for all streams together: from the first of them on, until a while after the last."""

    def __init__(self, shared: Shared, *, demo: bool) -> None:
        self.shared = shared
        self._host = shared.host
        self._demo = demo
        self._rings = {ALWAYS: Ring()}
        self._readers: set[Reader] = set()
        self._servos: dict[Uid, None] = {}
        self._readings: dict[tuple[Uid, str], None] = {}
        self._jobs: dict[str, Job] = {}
        self._events: deque[tuple[float, Happened]] = deque(maxlen=EVENTS_KEPT)
        self._flags: set[str] = set()
        self._moved = asyncio.Event()
        self._heard_at = {ALWAYS: self._now(), TELEMETRY: self._now()}
        self._forget = self._host.hub.listen(
            self._on_change,
            ServoChanged, ReadingChanged, JobChanged, Happened, BusChanged, LeaseChanged, StopChanged,
        )  # fmt: skip
        self.over = False
        self._pump = asyncio.create_task(self._run())

    def join(self, reader: Reader) -> str:
        """From now on for this reader, or from where it was interrupted. The answer: who serves."""
        if TELEMETRY in reader.topics and TELEMETRY not in self._rings:
            self._rings[TELEMETRY] = Ring()
            self.shared.feed.join(self)
        self._collect()
        self._readers.add(reader)
        for topic, ring in self._heard(reader):
            place = reader.known.get(ring.name)
            reader.places[topic] = place if place is not None and place <= ring.next else None
        base = self._host.base
        hello = messages.Hello(
            type="hello", seq=0, version=__version__, schema_revision=self._host.catalog.revision,
            utc_offset=base.utc_offset, now=base.now(), demo=self._demo,
        )  # fmt: skip
        return f"event: hello\ndata: {hello.model_dump_json()}\n\n"

    def take(self, reader: Reader) -> list[str]:
        """What waits for this reader. What it missed for good is counted, and then told how everything is now."""
        reader.waiting.clear()
        out: list[str] = []
        for topic, ring in self._heard(reader):
            place = reader.places[topic]
            lost, entries = ring.since(ring.next if place is None else place)
            anew = topic == ALWAYS and (place is None or lost > 0)
            if lost or (place is None and reader.back):
                out.append(reader.message(_dropped(None if place is None else lost, topic), None))
            for number, entry in entries:
                reader.places[topic] = number + 1
                if reader.wants(entry):
                    # While some of the state is still to come, whoever is interrupted must be told all of it again.
                    out.append(reader.message(entry, None if anew else self._place(reader)))
            reader.places[topic] = ring.next
            if anew:
                state = [one for one in self._state(recent=place is None) if reader.wants(one)]
                out += [reader.message(one, None) for one in state[:-1]]
                out += [reader.message(one, self._place(reader)) for one in state[-1:]]
        return out

    def leave(self, reader: Reader) -> None:
        """It has gone."""
        for topic, _ in self._heard(reader):
            self._heard_at[topic] = self._now()
        self._readers.discard(reader)

    def close(self) -> None:
        """End every stream."""
        self.over = True
        self._forget()
        self.shared.feed.leave(self)
        self._pump.cancel()
        for reader in self._readers:
            reader.end()

    def wants(self, uid: Uid) -> bool:
        """For the feed: telemetry of every servo is told."""
        return True

    def wake(self) -> None:
        """For the feed: a batch waits."""
        self._moved.set()

    def missed(self, samples: int) -> None:
        """For the feed: nothing is, for the batches are taken as they are made."""

    async def _run(self) -> None:
        while not self.over:
            try:
                async with asyncio.timeout(LINGER_S / 10):
                    await self._moved.wait()
            except TimeoutError:
                pass
            self._moved.clear()
            self._collect()
            for reader in self._readers:
                reader.waiting.set()
            self._rest()
            await asyncio.sleep(BATCH_S)

    def _rest(self) -> None:
        """Nobody may have listened for long."""
        heard = {topic for reader in self._readers for topic, _ in self._heard(reader)}
        deserted = {
            topic for topic in self._rings if topic not in heard and self._now() - self._heard_at[topic] > LINGER_S
        }
        if ALWAYS in deserted:
            self.close()
        elif TELEMETRY in deserted:
            self.shared.feed.leave(self)
            del self._rings[TELEMETRY]

    def _heard(self, reader: Reader) -> list[tuple[str, Ring]]:
        return [one for one in self._rings.items() if one[0] == ALWAYS or one[0] in reader.topics]

    def _place(self, reader: Reader) -> str:
        return "~".join(f"{ring.name}.{reader.places[topic]}" for topic, ring in self._heard(reader))

    def _on_change(self, change: Change) -> None:
        match change:
            case ServoChanged():
                self._servos[change.uid] = None
            case ReadingChanged():
                self._readings[change.uid, change.key] = None
                self._servos[change.uid] = None
            case Happened():
                self._events.append((self._host.base.utc_now(), change))
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
        self._moved.set()

    def _collect(self) -> None:
        """Write down what has changed; of a crowd that changes at once, some in the next go."""
        flags, self._flags = self._flags, set[str]()
        jobs, self._jobs = self._jobs, dict[str, Job]()
        events, self._events = self._events, deque[tuple[float, Happened]](maxlen=EVENTS_KEPT)
        uids = list(islice(self._servos, SERVOS_A_TIME))
        readings = list(islice(self._readings, READINGS_A_TIME))
        put = self._rings[ALWAYS].put
        for entry in (
            *self._flagged(flags), *map(_job, jobs.values()), *self._shown(uids), *self._read(readings),
            *(_event(at, event) for at, event in events),
        ):  # fmt: skip
            put(entry)
        for uid in uids:
            del self._servos[uid]
        for place in readings:
            del self._readings[place]
        if self._servos or self._readings:
            self._moved.set()
        if TELEMETRY in self._rings:
            for uid, channels in self.shared.feed.take(self):
                members = f'"uid":"{uid}","channels":{channels},"dropped":0'
                self._rings[TELEMETRY].put(Entry(TELEMETRY, TELEMETRY, uid, members))

    def _state(self, *, recent: bool) -> list[Entry]:
        """How everything is now, with the `recent` events for who has just come."""
        host = self._host
        return [
            *self._flagged({"bus", "lease", "stop"}),
            *(_job(job) for job in host.jobs.all() if not job.ended),
            *self._shown([one.uid for one in host.fleet.all()]),
            *(_event(at, event) for at, event in host.events if recent),
        ]

    def _flagged(self, flags: set[str]) -> Iterable[Entry]:
        fragments = self.shared.fragments
        shown = (("stop", fragments.stop), ("lease", fragments.lease), ("bus", fragments.bus))
        for kind, make in shown:
            if kind in flags:
                yield Entry("bus" if kind == "bus" else ALWAYS, kind, None, f'"{kind}":{make()}')

    def _shown(self, uids: Iterable[Uid]) -> Iterable[Entry]:
        for uid in uids:
            fragment = self.shared.fragments.servo(uid)
            if fragment is not None:
                yield Entry("servos", "servos", uid, f'"servos":[{fragment}]')

    def _read(self, places: Iterable[tuple[Uid, str]]) -> Iterable[Entry]:
        for uid, key in places:
            fragment = self.shared.fragments.reading(uid, key)
            if fragment is not None:
                yield Entry("servos", "parameter", uid, f'"uid":"{uid}","reading":{fragment}')

    def _now(self) -> float:
        return self._host.base.now()


def _job(job: Job) -> Entry:
    return Entry("jobs", "job", None, f'"job":{present.job(job).model_dump_json()}')


def _event(at: float, event: Happened) -> Entry:
    told = {"at": at, "level": event.level, "uid": event.uid, "code": event.code, "text": event.text}
    return Entry("events", "event", None, orjson.dumps(told).decode()[1:-1])


def _dropped(count: int | None, topic: str) -> Entry:
    told = {"count": count, "telemetry": topic == TELEMETRY}
    return Entry(ALWAYS, "dropped", None, orjson.dumps(told).decode()[1:-1])
