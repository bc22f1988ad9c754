"""WebSocket of a frame: receives settings from its page, and sends clicks and projections to it."""

import asyncio
from contextlib import suppress
from functools import partial

import msgspec
from starlette.websockets import WebSocket, WebSocketState

from hornbill.view.view_settings import InvalidSettings, read
from hornbill.view.viewer import Viewer

LARGEST = 65536
"""Maximum size of settings, bytes. A wall of 127 servos takes about 5000, poses of 256 servos about 43 000."""


async def serve(websocket: WebSocket, viewer: Viewer, key: str) -> None:
    """Serve a socket until it closes.

    From the page: complete settings as JSON (hornbill.view.view_settings). To the page: `{"picked": UID}` and
    `{"projection": …}` (hornbill.view.projection). Invalid settings close the connection with 1007, 1009 or 1003.
    Nothing here has an effect on servos.
    """
    loop = asyncio.get_running_loop()
    messages: asyncio.Queue[bytes] = asyncio.Queue()
    await websocket.accept()

    def send(what: str, value: object) -> None:
        with suppress(RuntimeError):  # the server is ending
            loop.call_soon_threadsafe(messages.put_nowait, msgspec.json.encode({what: value}))

    unsubscribe = (viewer.on_pick(key, partial(send, "picked")), viewer.on_projection(key, partial(send, "projection")))
    tasks = {asyncio.create_task(_receive(websocket, viewer, key)), asyncio.create_task(_send(websocket, messages))}
    code = 1001
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            code = task.result() if task.exception() is None else code
    finally:
        for end in unsubscribe:
            end()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    if websocket.application_state is WebSocketState.CONNECTED and websocket.client_state is WebSocketState.CONNECTED:
        await websocket.close(code)


async def _receive(websocket: WebSocket, viewer: Viewer, key: str) -> int:
    """Apply settings until the page disconnects or sends something else. Returns the close code."""
    while (event := await websocket.receive())["type"] != "websocket.disconnect":
        text: str | None = event.get("text")
        if text is None:
            return 1003
        if len(text) > LARGEST:
            return 1009
        try:
            viewer.show(key, read(text))
        except InvalidSettings:
            return 1007
    return 1000


async def _send(websocket: WebSocket, messages: "asyncio.Queue[bytes]") -> int:
    while True:
        await websocket.send_text((await messages.get()).decode())
