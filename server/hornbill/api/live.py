"""Owns the WebSocket: one reader and one writer a socket, batched, and an orderly end whichever way it goes."""

import asyncio
import logging
from typing import Any

from fastapi import APIRouter, WebSocket
from starlette.websockets import WebSocketDisconnect

from hornbill.api import PREFIX
from hornbill.api.access import WHO
from hornbill.api.feed import BATCH_S
from hornbill.api.outbox import Outbox, Shared
from hornbill.api.session import Session
from hornbill.servo.host import Host
from hornbill.servo.hub import (
    BusChanged,
    Happened,
    JobChanged,
    LeaseChanged,
    ReadingChanged,
    ServoChanged,
    StopChanged,
)

log = logging.getLogger(__name__)

router = APIRouter(prefix=PREFIX)

REFRESH_S = 1.0
"""Servos that are online are sent again this often, so that ages and uptimes on a page go on."""

TOLD = (ServoChanged, ReadingChanged, Happened, JobChanged, BusChanged, LeaseChanged, StopChanged)
"""What an outbox is told by the hub; samples come through the feed."""


@router.websocket("/ws")
async def live(socket: WebSocket) -> None:
    """One page or program. When it goes, the leases it kept alive go with it."""
    host: Host = socket.app.state.host
    await socket.accept()
    outbox = Outbox(shared(socket.app.state, host), bool(socket.app.state.demo))
    forget = host.hub.listen(outbox.on_change, *TOLD)
    session = Session(host, outbox, socket.scope.get(WHO))
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


def shared(state: Any, host: Host) -> Shared:
    """What the sockets and streams of this host share, made for the first of them."""
    found: Shared | None = getattr(state, "shared", None)
    if found is None or found.host is not host:
        if found is not None:
            found.close()
        found = state.shared = Shared(host)
    return found


async def _write(socket: WebSocket, outbox: Outbox) -> None:
    now = asyncio.get_running_loop().time
    try:
        await socket.send_text(outbox.hello())
        refreshed = _second(now())
        while True:
            try:
                async with asyncio.timeout_at((refreshed + 1) * REFRESH_S):
                    await outbox.waiting.wait()
            except TimeoutError:
                pass
            if _second(now()) > refreshed:
                outbox.refresh()
                refreshed = _second(now())
            for packed in outbox.take():
                await socket.send_text(packed)
            await asyncio.sleep(BATCH_S)
    except (WebSocketDisconnect, RuntimeError):
        pass  # the page is gone; the reader notices as well and ends the session
    except Exception:  # a page that hears nothing more must not believe that nothing happens
        log.exception("a socket's writer failed")
        await socket.close(1011)


def _second(now: float) -> int:
    """All sockets refresh at the same instants, so that what they send is packed once for all of them."""
    return int(now / REFRESH_S)
