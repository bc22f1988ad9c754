"""Owns the routes of the log of the bus, and of the logs written before."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Annotated

from fastapi import Path as InPath
from starlette.responses import StreamingResponse

from hornbill.api import bus_models
from hornbill.api.dependencies import TheBusLog
from hornbill.api.downloads import attachment
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.bus.recordings.bus_log import LogStatus
from hornbill.bus.recordings.writer import LogFormat

routes = Routes("logs")

_CHUNK = 1 << 18

LogName = Annotated[str, InPath(description="File name, as in `GET /bus/logs`.")]


@routes.post("/bus/log", Role.CONFIGURE, "busy", "invalid_value", "log_failed", status_code=201)
async def start_log(bus_log: TheBusLog, body: bus_models.LogRequest) -> bus_models.LogState:
    """Write every frame to a file in the data folder, sent ones included, until it is stopped or full.

    The log goes on when the bus is lost and found again. A slow disk never slows the bus: what it cannot take is
    counted as dropped.
    """
    return _shown(await bus_log.start(LogFormat(body.format), body.name, round(body.limit_mb * 1e6)))


@routes.get("/bus/log", Role.VIEW)
async def get_log(bus_log: TheBusLog) -> bus_models.LogState:
    """The log that is written, or the last one."""
    return _shown(bus_log.status)


@routes.delete("/bus/log", Role.CONFIGURE)
async def stop_log(bus_log: TheBusLog) -> bus_models.LogState:
    """End the log; it answers when the file is complete. Without one nothing happens."""
    return _shown(await bus_log.stop())


@routes.get("/bus/logs", Role.VIEW)
async def list_logs(bus_log: TheBusLog) -> list[bus_models.LogFile]:
    """The logs in the data folder, the newest first. One can be played: `PUT /bus` with address `file:NAME`."""
    kept = await asyncio.to_thread(bus_log.folder.all)
    return [bus_models.LogFile(name=one.name, bytes=one.size, modified_at=one.modified_at) for one in kept]


@routes.get(
    "/bus/logs/{name}",
    Role.VIEW,
    "unknown_log",
    response_class=StreamingResponse,
    responses={200: {"content": {"application/octet-stream": {}}}},
)
async def download_log(bus_log: TheBusLog, name: LogName) -> StreamingResponse:
    """The file; of the log being written, what is in it now."""
    path = bus_log.folder.path(name)
    size = path.stat().st_size
    headers = {"Content-Length": str(size), **attachment(path.name)}
    return StreamingResponse(_content(path, size), media_type="application/octet-stream", headers=headers)


@routes.delete("/bus/logs/{name}", Role.ADMIN, "unknown_log", "busy", "log_failed", status_code=204)
async def delete_log(bus_log: TheBusLog, name: LogName) -> None:
    """Remove a log from the data folder."""
    await bus_log.delete(name)


async def _content(path: Path, size: int) -> AsyncIterator[bytes]:
    """The first `size` bytes. A log grows while it is sent; FileResponse would send more than it announced."""
    loop = asyncio.get_running_loop()
    with path.open("rb") as file:
        while size > 0 and (chunk := await loop.run_in_executor(None, file.read, min(size, _CHUNK))):
            size -= len(chunk)
            yield chunk


def _shown(status: LogStatus) -> bus_models.LogState:
    return bus_models.LogState(
        state=status.phase.value,
        name=status.name,
        format=None if status.form is None else status.form.value,
        started_at=status.started_at,
        frames=status.frames,
        dropped=status.dropped,
        bytes=status.size,
        limit_bytes=status.limit,
        reason=status.reason,
    )
