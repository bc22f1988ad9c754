"""Queue of unsent messages of one WebSocket. Bounded; the newest value wins."""

from collections import deque
from collections.abc import Iterator
from itertools import chain, islice

import orjson

from hornbill.api import remedies
from hornbill.api.live import messages
from hornbill.api.live.event_log import ALWAYS, EVENTS_KEPT, REFRESH, SERVOS_A_TIME, Cursor, EventLog, LogEntry
from hornbill.api.live.frames import FrameWatch
from hornbill.api.live.telemetry_batches import Column, Columns, packable
from hornbill.errors import HornbillError
from hornbill.units import Uid

ENTRIES_A_TIME = 200
"""Log entries sent per batch. SERVOS_A_TIME limits the servos per message and the entries of the current state."""

RECALL_S = 30.0
ANGLE = "current_angle"


class SocketQueue:
    """Cursor in the event log, with the current state of new topics, telemetry, frames and replies."""

    def __init__(self, log: EventLog) -> None:
        self._log = log
        self._cursor = Cursor({ALWAYS})
        self._state: Iterator[LogEntry] = log.state({ALWAYS})
        self._stating = True
        self._seq = 0
        self._offset: float | None = None
        self._recalled: dict[Uid, Columns] = {}
        self._dropped = 0
        self._replies: deque[messages.ErrorMessage] = deque(maxlen=EVENTS_KEPT)
        self._frames: FrameWatch | None = None
        self.waiting = self._cursor.waiting
        log.join(self._cursor)
        self._place = log.changes().next

    @property
    def uids(self) -> list[str] | None:
        """Servos the socket is limited to; None for all."""
        return None if self._cursor.uids is None else sorted(self._cursor.uids)

    def subscribe(
        self, topics: list[messages.Topic], uids: list[str] | None, frames: messages.FrameFilter | None = None
    ) -> None:
        """Add topics and send their current state. `uids` limits servos, readings and telemetry of all topics."""
        cursor = self._cursor
        cursor.uids = None if uids is None else set(uids)
        if "frames" in topics or (frames is not None and self._frames is not None):
            self._watch_frames(frames or messages.FrameFilter())
        if "telemetry" in topics and "telemetry" not in cursor.topics:
            self._log.telemetry.join(self)
            self._recall_angles()
        cursor.topics.update(topics)
        if "servos" in topics:
            cursor.topics.add(REFRESH)
        self._send(self._log.state(set(topics)))

    def _send(self, state: Iterator[LogEntry]) -> None:
        self._state = chain(self._state, state)
        self._stating = True
        self.waiting.set()

    def _recall_angles(self) -> None:
        """Queue the angles of the last RECALL_S, for sparklines."""
        host = self._log.host
        since = host.base.now() - RECALL_S
        for one in host.fleet.all():
            if self.wants(one.uid):
                times, values = host.telemetry.window(one.uid, ANGLE, since)
                column: Column = ([round(t, 4) for t in times], values)
                if times:
                    self._recalled[one.uid] = {ANGLE: column}

    def unsubscribe(self, topics: list[messages.Topic]) -> None:
        """Remove topics."""
        self._cursor.topics.difference_update(topics)
        if "servos" in topics:
            self._cursor.topics.discard(REFRESH)
        if "telemetry" in topics:
            self._log.telemetry.leave(self)
            self._recalled.clear()
        if "frames" in topics and self._frames is not None:
            self._frames.close()
            self._frames = None

    def close(self) -> None:
        """End all subscriptions."""
        self.unsubscribe(["frames", "telemetry"])
        self._log.leave(self._cursor)

    def _watch_frames(self, wanted: messages.FrameFilter) -> None:
        """Start a new subscription; its counts start at zero."""
        self.unsubscribe(["frames"])
        self._frames = FrameWatch(self._log.host.monitor, wanted, self.waiting.set)

    def refuse(self, error: HornbillError, uid: str | None = None) -> None:
        """Queue an `error` reply to a message of this socket."""
        self._replies.append(
            messages.ErrorMessage(
                type="error", seq=0, code=error.code, detail=remedies.detail(error), summary=error.detail,
                params=error.params, uid=uid,
            )
        )  # fmt: skip
        self.waiting.set()

    def wants(self, uid: Uid) -> bool:
        """Whether this socket receives a servo."""
        return self._cursor.uids is None or uid in self._cursor.uids

    def wake(self) -> None:
        """Telemetry is pending."""
        self.waiting.set()

    def missed(self, samples: int) -> None:
        """Count samples that were dropped before they could be sent."""
        self._dropped += samples
        self._log.dropped += samples

    def hello(self) -> str:
        """First message; repeated after a step of the system clock, which shifts every telemetry time."""
        self._offset = self._log.host.base.utc_offset
        self._seq += 1
        return self._log.hello(self._seq)

    def take(self) -> list[str]:
        """Pending messages, at most one batch; if more remain, `waiting` stays set."""
        self.waiting.clear()
        stepped = self._offset not in (None, self._log.host.base.utc_offset)
        out = [self.hello()] if stepped else []
        while self._replies:
            self._seq += 1
            out.append(self._replies.popleft().model_copy(update={"seq": self._seq}).model_dump_json())
        out += self._messages(self._next_entries())
        out += self._telemetry()
        out += self._seen_frames()
        return out

    def _next_entries(self) -> list[LogEntry]:
        """Entries of the current state first, then those of the log."""
        wants = self._cursor.wants
        if self._stating:
            entries = list(islice(self._state, SERVOS_A_TIME))
            self._stating = len(entries) == SERVOS_A_TIME
            self.waiting.set()
            return [entry for entry in entries if wants(entry)]
        changes = self._log.changes()
        lost, found = changes.since(self._place)
        if lost:
            self._send(chain(self._log.state(set(self._cursor.topics), recent=False), self._log.readings()))
        found = found[:ENTRIES_A_TIME]
        self._place = found[-1][0] + 1 if found else changes.next
        if self._place < changes.next:
            self.waiting.set()
        return [entry for _, entry in found if wants(entry)]

    def _messages(self, entries: list[LogEntry]) -> Iterator[str]:
        """Servos together, in messages of at most SERVOS_A_TIME; the other entries one by one."""
        servos = {entry.uid: entry.json for entry in entries if entry.type == "servos"}
        shown = list(servos.values())
        for first in range(0, len(shown), SERVOS_A_TIME):
            yield self._spliced("servos", f'"servos":[{",".join(shown[first : first + SERVOS_A_TIME])}]')
        for entry in entries:
            if entry.type != "servos":
                yield self._spliced(entry.type, entry.members)

    def _telemetry(self) -> list[str]:
        """Columns as encoded once for all sockets."""
        out: list[str] = []
        recalled, self._recalled = self._recalled, {}
        for uid, columns in recalled.items():
            out.append(self._samples(uid, orjson.dumps(packable(columns)).decode()))
        for uid, channels in self._log.telemetry.take(self):
            out.append(self._samples(uid, channels))
        return out

    def _samples(self, uid: Uid, channels: str) -> str:
        dropped, self._dropped = self._dropped, 0
        return self._spliced("telemetry", f'"uid":"{uid}","channels":{channels},"dropped":{dropped}')

    def _seen_frames(self) -> list[str]:
        seen = None if self._frames is None else self._frames.take()
        if seen is None:
            return []
        self._seq += 1
        return [orjson.dumps({**seen, "seq": self._seq}).decode()]

    def _spliced(self, kind: str, members: str) -> str:
        """Message built from members that are already JSON."""
        self._seq += 1
        return f'{{"type":"{kind}","seq":{self._seq},{members}}}'
