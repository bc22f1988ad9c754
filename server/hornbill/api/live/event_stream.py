"""Event stream: the WebSocket messages as server-sent events."""

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated, Any, Final

import orjson
from fastapi import Header, Query, Request
from fastapi.sse import format_sse_event
from starlette.responses import StreamingResponse

from hornbill.api.addressing import NAMES, ServoRefs
from hornbill.api.dependencies import TheHost
from hornbill.api.live.event_log import ALWAYS, TELEMETRY, Cursor, EventBuffer, EventLog, LogEntry, log_of
from hornbill.api.routing import Routes
from hornbill.api.security.access import WHO, Access, Identity
from hornbill.api.security.roles import Role

routes = Routes("live")

TOPICS: Final = ("servos", "events", "jobs", "bus", "telemetry")
HEARTBEAT_S: Final = 10.0
"""A comment is sent after this time without an event, so that both ends detect a lost connection."""
RETRY_MS: Final = 2000
"""Delay before a browser reconnects."""

_TOPIC = f"({'|'.join(TOPICS)})"
Topics = Annotated[
    str,
    Query(
        pattern=f"^{_TOPIC}(,{_TOPIC})*$",
        max_length=100,
        description="Any of servos, events, jobs, bus and telemetry, separated by commas. Lease and stop messages are "
        "always sent.",
    ),
]
Uids = Annotated[
    ServoRefs | None,
    Query(description=f"{NAMES}, separated by commas: limits servos, parameters and telemetry to these. Default: all."),
]
Last = Annotated[
    str | None,
    Header(alias="Last-Event-ID", max_length=200, description="ID of the last received event, to resume after it."),
]


@routes.get(
    "/events/stream",
    Role.VIEW,
    "unknown_servo",
    "invalid_value",
    response_class=StreamingResponse,
    responses={
        200: {
            "description": "Server-sent events. The data of each is a ServerMessage or a DroppedMessage.",
            "content": {"text/event-stream": {"schema": {"type": "string"}}},
        }
    },
)
async def stream_events(
    request: Request, host: TheHost, topics: Topics = "servos,events,jobs,bus", uids: Uids = None, last: Last = None
) -> StreamingResponse:
    """Stream the current state, then every change. Sends no request on the bus.

    A client that reconnects within one minute with the ID of its last event resumes there. A slow client receives only
    the newest change of each servo, reading and job, and every event. If messages are lost, a `dropped` message gives
    their number and the current state follows.
    """
    cursor = Cursor(set(topics.split(",")), None if uids is None else set(uids.split(",")))
    who: Identity | None = request.scope.get(WHO)
    return StreamingResponse(
        _lines(EventStream(log_of(request.app.state, host), cursor, last), request.app.state.access, who),
        media_type="text/event-stream",
        headers={"X-Accel-Buffering": "no"},  # prevents buffering by nginx
    )


def end_streams(state: Any) -> None:
    """End every stream of an application, so that its server can shut down."""
    log: EventLog | None = getattr(state, "event_log", None)
    if log is not None:
        log.close()


class EventStream:
    """Position of one client in the log, as server-sent events whose IDs allow resuming."""

    def __init__(self, log: EventLog, cursor: Cursor, last: str | None) -> None:
        """`last`: ID of the last event the client received; None for a new client."""
        self._log = log
        self._cursor = cursor
        self._resumes = last is not None
        self._known = places(last or "")
        self._seq = 0
        self._offset = log.host.base.utc_offset

    def join(self) -> bytes:
        """Start or resume. Returns the first lines."""
        log, cursor = self._log, self._cursor
        log.join(cursor)
        cursor.places = {
            buffer.name: place
            for buffer in self._buffers()
            if (place := self._known.get(buffer.name)) is not None and place <= buffer.next
        }
        cursor.waiting.set()
        return format_sse_event(retry=RETRY_MS) + format_sse_event(event="hello", data_str=log.hello(0))

    def take(self) -> bytes:
        """Pending events. Lost ones are counted, and the current state follows."""
        cursor = self._cursor
        cursor.waiting.clear()
        out: list[bytes] = []
        if self._offset != (offset := self._log.host.base.utc_offset):  # the system clock was set
            self._offset = offset
            out.append(format_sse_event(event="hello", data_str=self._log.hello(self._seq)))
        for buffer in self._buffers():
            place = cursor.places.get(buffer.name)
            lost, entries = buffer.since(buffer.next if place is None else place)
            telemetry = buffer is not self._log.changes()
            restate = not telemetry and (place is None or lost > 0)
            if lost or (place is None and self._resumes):
                out.append(self._event(_dropped(None if place is None else lost, telemetry=telemetry)))
            for number, entry in entries:
                cursor.places[buffer.name] = number + 1
                if cursor.wants(entry):
                    # With an ID before the state is complete, an interrupted client would resume without the rest.
                    out.append(self._event(entry, identified=not restate))
            cursor.places[buffer.name] = buffer.next
            if restate:
                topics = {ALWAYS, *cursor.topics}
                state = [one for one in self._log.state(topics, recent=place is None) if cursor.wants(one)]
                out += [self._event(one) for one in state[:-1]]
                out += [self._event(one, identified=True) for one in state[-1:]]
        return b"".join(out)

    def leave(self) -> None:
        """Leave the log."""
        self._log.leave(self._cursor)

    async def more(self) -> None:
        """Wait until there may be pending events."""
        await self._cursor.waiting.wait()

    @property
    def over(self) -> bool:
        """Whether the client or the server ended the stream."""
        return self._cursor.over

    def end(self) -> None:
        """End the stream."""
        self._cursor.end()

    def _buffers(self) -> list[EventBuffer]:
        changes = self._log.changes()
        return [changes, self._log.samples()] if TELEMETRY in self._cursor.topics else [changes]

    def _event(self, entry: LogEntry, *, identified: bool = False) -> bytes:
        self._seq += 1
        data = f'{{"type":"{entry.type}","seq":{self._seq},{entry.members}}}'
        known = self._cursor.places
        place = "~".join(f"{one.name}.{known[one.name]}" for one in self._buffers() if one.name in known)
        return format_sse_event(event=entry.type, data_str=data, id=place if identified else None)


def places(last: str) -> dict[str, int]:
    """Positions by buffer name in an event ID; malformed parts are ignored."""
    found: dict[str, int] = {}
    for part in last[:200].split("~"):
        name, _, number = part.partition(".")
        if number.isascii() and number.isdecimal():
            found[name] = int(number)
    return found


def _dropped(count: int | None, *, telemetry: bool) -> LogEntry:
    members = {"count": count, "telemetry": telemetry}
    return LogEntry(ALWAYS, "dropped", None, orjson.dumps(members).decode()[1:-1])


async def _lines(stream: EventStream, access: Access, who: Identity | None) -> AsyncIterator[bytes]:
    clock = asyncio.get_running_loop().time
    ended = None if who is None else access.watch(who)
    if ended is not None:
        ended.add_done_callback(lambda _: stream.end())
    try:
        yield stream.join()
        quiet_until = clock() + HEARTBEAT_S
        while not stream.over:
            lines = stream.take()
            if not lines and clock() >= quiet_until:
                lines = format_sse_event(comment="heartbeat")
            if lines:
                yield lines
                quiet_until = clock() + HEARTBEAT_S
                continue
            try:
                async with asyncio.timeout_at(quiet_until):
                    await stream.more()
            except TimeoutError:
                pass
    finally:
        stream.leave()
        if who is not None and ended is not None:
            access.unwatch(who, ended)
