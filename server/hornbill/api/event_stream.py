"""Owns the route of the event stream: what the WebSocket tells, for programs that would rather read lines of HTTP."""

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated, Any, Final

from fastapi import APIRouter, Header, Query, Request
from starlette.responses import StreamingResponse

from hornbill.api import PREFIX
from hornbill.api.access import WHO, Access, Identity
from hornbill.api.dependencies import TheHost
from hornbill.api.live import shared
from hornbill.api.problems import declared
from hornbill.api.rings import Reader
from hornbill.api.tape import Tape
from hornbill.servo.host import Host

router = APIRouter(prefix=PREFIX, tags=["live"])

TOPICS: Final = ("servos", "events", "jobs", "bus", "telemetry")
HEARTBEAT_S: Final = 10.0
"""After so long without news there is a comment: whoever reads knows that both ends are there."""
RETRY_MS: Final = 2000
"""When a browser comes back."""

_TOPIC = f"({'|'.join(TOPICS)})"
Topics = Annotated[
    str,
    Query(
        pattern=f"^{_TOPIC}(,{_TOPIC})*$",
        max_length=100,
        description="of servos, events, jobs, bus and telemetry, with commas between them; lease and stop always come",
    ),
]
Uids = Annotated[
    str | None,
    Query(
        pattern="^[0-9a-f]{32}(,[0-9a-f]{32})*$",
        max_length=33 * 127,
        description="unique ids, with commas between them: servos, parameters and telemetry of these only",
    ),
]
Last = Annotated[
    str | None,
    Header(alias="Last-Event-ID", max_length=200, description="the id of the last event that was read, to go on there"),
]


@router.get(
    "/events/stream",
    operation_id="stream_events",
    response_class=StreamingResponse,
    responses={
        200: {
            "description": "server-sent events; the data of each is a ServerMessage, or a DroppedMessage",
            "content": {"text/event-stream": {"schema": {"type": "string"}}},
        },
        **declared("invalid_value"),
    },
)
async def stream_events(
    request: Request, host: TheHost, topics: Topics = "servos,events,jobs,bus", uids: Uids = None, last: Last = None
) -> StreamingResponse:
    """What changes, as it changes: first how everything is now, then each change. Nothing is asked of the bus for it.

    Whoever comes back within a minute with the id of the last event goes on where they were. What is gone by then is
    said: `dropped`, with how many, and after it how everything is now. A slow reader is told so, too.
    """
    wanted = Reader(frozenset(topics.split(",")), None if uids is None else frozenset(uids.split(",")), last)
    who: Identity | None = request.scope.get(WHO)
    access: Access = request.app.state.access
    return StreamingResponse(
        _lines(_tape(request.app.state, host), wanted, access, who),
        media_type="text/event-stream",
        headers={"X-Accel-Buffering": "no"},  # nginx would collect it
    )


def end_streams(state: Any) -> None:
    """End every stream of an application: its server goes, and waits for its requests."""
    tape: Tape | None = getattr(state, "tape", None)
    if tape is not None:
        tape.close()


def _tape(state: Any, host: Host) -> Tape:
    """What the streams of this host share, made for the first of them."""
    found: Tape | None = getattr(state, "tape", None)
    common = shared(state, host)
    if found is None or found.over or found.shared is not common:
        if found is not None and not found.over:
            found.close()
        found = state.tape = Tape(common, demo=bool(state.demo))
    return found


async def _lines(tape: Tape, reader: Reader, access: Access, who: Identity | None) -> AsyncIterator[str]:
    clock = asyncio.get_running_loop().time
    ended = None if who is None else access.watch(who)
    if ended is not None:
        ended.add_done_callback(lambda _: reader.end())
    try:
        yield f"retry: {RETRY_MS}\n\n{tape.join(reader)}"
        quiet_until = clock() + HEARTBEAT_S
        while not reader.over and not tape.over:
            told = "".join(tape.take(reader))
            if not told and clock() >= quiet_until:
                told = ": here\n\n"
            if told:
                yield told
                quiet_until = clock() + HEARTBEAT_S
                continue
            try:
                async with asyncio.timeout_at(quiet_until):
                    await reader.waiting.wait()
            except TimeoutError:
                pass
    finally:
        tape.leave(reader)
        if who is not None and ended is not None:
            access.unwatch(who, ended)
