"""`hornbill watch` with a server that is slow to connect to."""

import asyncio
import json
from types import SimpleNamespace
from typing import Any

import pytest
from websockets.asyncio.server import ServerConnection, serve
from websockets.http11 import Request

from hornbill.cli.server.watching import _messages  # pyright: ignore[reportPrivateUsage]

SLOW_S, WATCHED_S = 0.4, 0.2


@pytest.mark.real_time
def test_the_duration_begins_when_connected() -> None:
    async def slow(_: ServerConnection, __: Request) -> None:
        await asyncio.sleep(SLOW_S)

    async def answer(socket: ServerConnection) -> None:
        for kind in ("hello", "servos"):
            await socket.send(json.dumps({"type": kind}))
        await socket.wait_closed()

    async def main() -> list[dict[str, Any]]:
        async with serve(answer, "127.0.0.1", 0, process_request=slow) as server:
            port = next(iter(server.sockets)).getsockname()[1]
            hornbill: Any = SimpleNamespace(
                local=True, socket_url=f"ws://127.0.0.1:{port}/", trusted=None, credentials={}
            )
            return [one async for one in _messages(hornbill, [], [], 10.0, WATCHED_S, some=False)]

    assert asyncio.run(main()) == [{"type": "hello"}, {"type": "servos"}]
