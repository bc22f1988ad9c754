"""Owns the WebSocket: one reader and one writer a socket, batched, and an orderly end whichever way it goes."""

import asyncio
import logging

from fastapi import APIRouter, WebSocket
from starlette.websockets import WebSocketDisconnect

from hornbill.api.outbox import Outbox
from hornbill.api.session import Session
from hornbill.servo.host import Host

log = logging.getLogger(__name__)

router = APIRouter()

BATCH_S = 1 / 30
"""At most so often is anything sent; what comes in between goes out together."""

REFRESH_S = 1.0
"""Servos that are online are sent again this often, so that ages and uptimes on a page go on."""


@router.websocket("/ws")
async def live(socket: WebSocket) -> None:
    """One page or program. When it goes, the leases it kept alive go with it."""
    host: Host = socket.app.state.host
    await socket.accept()
    outbox = Outbox(host, bool(socket.app.state.demo))
    forget = host.hub.listen(outbox.on_change)
    session = Session(host, outbox)
    writer = asyncio.create_task(_write(socket, outbox))
    try:
        while True:
            await session.handle(await socket.receive_text())
    except (WebSocketDisconnect, RuntimeError, KeyError):
        pass  # gone, or sent bytes where text was agreed: either way this socket is over
    finally:
        forget()
        writer.cancel()
        session.close()
        await asyncio.gather(writer, return_exceptions=True)


async def _write(socket: WebSocket, outbox: Outbox) -> None:
    try:
        await socket.send_text(outbox.hello().decode())
        refreshed = asyncio.get_running_loop().time()
        while True:
            try:
                async with asyncio.timeout(REFRESH_S):
                    await outbox.waiting.wait()
            except TimeoutError:
                pass
            now = asyncio.get_running_loop().time()
            if now - refreshed >= REFRESH_S:
                outbox.refresh()
                refreshed = now
            for packed in outbox.take():
                await socket.send_text(packed.decode())
            await asyncio.sleep(BATCH_S)
    except (WebSocketDisconnect, RuntimeError):
        pass  # the page is gone; the reader notices as well and ends the session
    except Exception:  # a page that hears nothing more must not believe that nothing happens
        log.exception("a socket's writer failed")
        await socket.close(1011)
