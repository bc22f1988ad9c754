"""WebSocket endpoint: one reader and one writer per connection."""

import asyncio
import logging

from fastapi import WebSocket
from starlette.websockets import WebSocketDisconnect

from hornbill.api.live.event_log import log_of
from hornbill.api.live.session import SocketSession
from hornbill.api.live.socket_queue import SocketQueue
from hornbill.api.live.telemetry_batches import BATCH_S
from hornbill.api.routing import Routes
from hornbill.api.security.access import WHO
from hornbill.api.security.roles import Role
from hornbill.servo.host import Host

log = logging.getLogger(__name__)

routes = Routes("live")


@routes.websocket("/ws", Role.VIEW)
async def live(socket: WebSocket) -> None:
    """Serve one client. When it disconnects, the leases it renewed end."""
    host: Host = socket.app.state.host
    await socket.accept()
    queue = SocketQueue(log_of(socket.app.state, host))
    session = SocketSession(host, queue, socket.scope.get(WHO))
    writer = asyncio.create_task(_write(socket, queue))
    try:
        while True:
            await session.handle(await socket.receive_text())
    except (WebSocketDisconnect, RuntimeError, KeyError):
        pass  # disconnected, or sent bytes instead of text
    finally:
        writer.cancel()
        session.close()
        await asyncio.gather(writer, return_exceptions=True)


async def _write(socket: WebSocket, queue: SocketQueue) -> None:
    try:
        await socket.send_text(queue.hello())
        while True:
            await queue.waiting.wait()
            for packed in queue.take():
                await socket.send_text(packed)
            await asyncio.sleep(BATCH_S)
    except (WebSocketDisconnect, RuntimeError):
        pass  # disconnected; the reader ends the session
    except Exception:  # without updates, the client would show old values as current
        log.exception("WebSocket writer failed")
        await socket.close(1011)
