"""The socket beside a frame: its page tells what the frame shall show, and hears what was clicked and how it lies."""

import asyncio
from contextlib import suppress
from functools import partial

import msgspec
from starlette.websockets import WebSocket, WebSocketState

from hornbill.view.viewer import Viewer
from hornbill.view.wish import NotAWish, read

LARGEST = 65536
"""Bytes of the largest wish: a wall of 127 servos takes about 5000, an instant of 256 about 43 000."""


async def serve(websocket: WebSocket, viewer: Viewer, key: str) -> None:
    """Runs an accepted or refused socket to its end.

    From the page: a wish as JSON (hornbill.view.wish), each one whole. To the page: `{"picked": UID}` and
    `{"sight": …}` (hornbill.view.sight). What is no wish ends the connection with 1007, 1009 or 1003. Nothing said here
    reaches a servo.
    """
    loop = asyncio.get_running_loop()
    news: asyncio.Queue[bytes] = asyncio.Queue()
    await websocket.accept()

    def hear(what: str, value: object) -> None:
        with suppress(RuntimeError):  # the server ends
            loop.call_soon_threadsafe(news.put_nowait, msgspec.json.encode({what: value}))

    ends = (viewer.on_pick(key, partial(hear, "picked")), viewer.on_sight(key, partial(hear, "sight")))
    ways = {asyncio.create_task(_hear(websocket, viewer, key)), asyncio.create_task(_tell(websocket, news))}
    code = 1001
    try:
        done, _ = await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        for way in done:
            code = way.result() if way.exception() is None else code
    finally:
        for end in ends:
            end()
        for way in ways:
            way.cancel()
        await asyncio.gather(*ways, return_exceptions=True)
    if websocket.application_state is WebSocketState.CONNECTED and websocket.client_state is WebSocketState.CONNECTED:
        await websocket.close(code)


async def _hear(websocket: WebSocket, viewer: Viewer, key: str) -> int:
    """Takes wishes until the page leaves or sends something else; the code to close with."""
    while (event := await websocket.receive())["type"] != "websocket.disconnect":
        text: str | None = event.get("text")
        if text is None:
            return 1003
        if len(text) > LARGEST:
            return 1009
        try:
            viewer.show(key, read(text))
        except NotAWish:
            return 1007
    return 1000


async def _tell(websocket: WebSocket, news: "asyncio.Queue[bytes]") -> int:
    while True:
        await websocket.send_text((await news.get()).decode())
