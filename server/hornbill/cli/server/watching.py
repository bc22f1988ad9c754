"""`hornbill watch`: live events, states and samples over the server's WebSocket."""

import json
import time
from collections.abc import AsyncGenerator, Iterator, Mapping, Sequence
from contextlib import aclosing
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hornbill.cli.connection import (
    LOCAL_URL,
    SERVO_HELP,
    AsJsonLines,
    Server,
    client,
    complete_key,
    complete_servo,
)

if TYPE_CHECKING:
    from hornbill.client import Hornbill, Servo

SUBSCRIPTION_S = 30.0
"""Lifetime of the telemetry subscription, renewed while this program runs."""
OWNER = "hornbill watch"


def watch(
    servos: Annotated[
        list[str] | None,
        typer.Argument(metavar="SERVO…", help=f"{SERVO_HELP} Default: all.", autocompletion=complete_servo),
    ] = None,
    channel: Annotated[
        list[str] | None,
        typer.Option(help="Parameter to poll and show. Repeatable.", autocompletion=complete_key),
    ] = None,
    rate: Annotated[float, typer.Option(help="Polling rate of channels, Hz.", min=0.1, max=200)] = 10.0,
    seconds: Annotated[float | None, typer.Option(help="Duration, s. Default: until Ctrl-C.", min=0.1)] = None,
    server: Server = LOCAL_URL,
    as_json: AsJsonLines = False,
) -> None:
    """Show events and state changes live, and samples of channels."""
    import asyncio

    with client(server) as hornbill:
        chosen = [hornbill.look_up(one) for one in servos] if servos else hornbill.servos()
        messages = _messages(hornbill, chosen, channel or [], rate, seconds, some=bool(servos))
        try:
            asyncio.run(_show(messages, {one.uid: one.title for one in chosen}, as_json=as_json))
        finally:
            for one in chosen if channel else ():
                one.telemetry([], rate, owner=OWNER)


async def _show(messages: AsyncGenerator[dict[str, Any]], titles: Mapping[str, str], *, as_json: bool) -> None:
    states: dict[str, str] = {}
    async with aclosing(messages):
        async for message in messages:
            for line in [json.dumps(message, ensure_ascii=False)] if as_json else lines_of(message, titles, states):
                print(line, flush=True)


def lines_of(message: dict[str, Any], titles: Mapping[str, str], states: dict[str, str]) -> Iterator[str]:
    """Output lines of a message. Updates `states` by uid. Servos without a title are skipped."""
    match message["type"]:
        case "event" if message["uid"] is None or message["uid"] in titles:
            yield f"{_clock(message['at'])}  {message['level']:<8} {message['text']}"
        case "servos":
            for one in message["servos"]:
                if one["uid"] in titles and states.get(one["uid"]) != one["state"]:
                    states[one["uid"]] = one["state"]
                    yield f"{_clock(time.time())}  state    {titles[one['uid']]}: {one['state']}"
        case "telemetry" if message["uid"] in titles:
            for key, column in message["channels"].items():
                if column["v"]:
                    yield f"{_clock(time.time())}  sample   {titles[message['uid']]} {key} {column['v'][-1]}"
        case _:
            return


async def _messages(
    hornbill: "Hornbill",
    chosen: "Sequence[Servo]",
    channels: list[str],
    rate: float,
    seconds: float | None,
    *,
    some: bool,
) -> AsyncGenerator[dict[str, Any]]:
    """Messages of the socket, for `seconds`. `some`: only of the chosen servos, not of servos that appear later."""
    import asyncio

    # Not the threaded client of websockets: over TLS two threads use one connection, and it sometimes hangs.
    from websockets.asyncio.client import connect
    from websockets.exceptions import WebSocketException

    from hornbill.client import ServerUnreachable

    topics = ["events", "servos", *(["telemetry"] if channels else [])]
    try:
        proxy = None if hornbill.local else True
        async with connect(
            hornbill.socket_url,
            ssl=hornbill.trusted,
            additional_headers=hornbill.credentials,
            max_size=None,
            proxy=proxy,
        ) as socket:
            uids = [one.uid for one in chosen] if some else None
            await socket.send(json.dumps({"type": "subscribe", "topics": topics, "uids": uids}))
            now = time.monotonic()  # connecting takes long on a busy computer, and is no part of the duration
            ends, renew_at = None if seconds is None else now + seconds, now
            while ends is None or now < ends:
                if channels and now >= renew_at:
                    renew_at = now + SUBSCRIPTION_S / 2
                    for one in chosen:
                        one.telemetry(channels, rate, ttl_s=SUBSCRIPTION_S, owner=OWNER)
                try:
                    async with asyncio.timeout(1.0 if ends is None else min(1.0, ends - now)):
                        message = json.loads(await socket.recv())
                    yield message
                except TimeoutError:
                    pass
                now = time.monotonic()
    except (OSError, WebSocketException) as error:
        raise ServerUnreachable(
            f"The connection to {hornbill.socket_url} was lost: {error}.", cause=None, sent=False
        ) from None


def _clock(at: float) -> str:
    return time.strftime("%H:%M:%S", time.localtime(at)) + f".{int(at * 10) % 10}"
