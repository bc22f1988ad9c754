"""Routes of bus logs."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Annotated, Literal

from fastapi import Path as InPath
from pydantic import Field
from starlette.responses import StreamingResponse

from hornbill.api.dependencies import TheBusLog
from hornbill.api.downloads import attachment
from hornbill.api.paging import Page, pages
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.bus.recordings.bus_log import LogStatus
from hornbill.bus.recordings.writer import LogFormat
from hornbill.domain.fields import Model, Params, Utc
from hornbill.domain.note import NoteCode

routes = Routes("logs")


class LogRequest(Model):
    """Options of a new log."""

    format: LogFormat = Field(default=LogFormat.CANDUMP, description="File format.")
    name: str | None = Field(default=None, description="File name without extension. Default: the start time.")
    limit_mb: Annotated[float, Field(gt=0, le=10_000)] = Field(
        default=100.0, description="Size at which logging ends, MB."
    )


class LogState(Model):
    """Current or last log."""

    state: Literal["idle", "running", "stopped", "full", "failed"] = Field(description="State of the log.")
    name: str | None = Field(description="File name. Null if there is no log.")
    format: LogFormat | None = Field(description="File format. Null if there is no log.")
    started_at: float | None = Field(description="Start, seconds since 1970 UTC. Null if there is no log.")
    frames: int = Field(description="Number of CAN frames.")
    dropped: int = Field(description="Frames that could not be written in time.")
    bytes: int = Field(description="Size, bytes.")
    limit_bytes: int = Field(description="Size at which logging ends, bytes.")
    reason: str | None = Field(description="Reason why it ended. Null if stopped manually.")
    reason_code: NoteCode | None = Field(description="Code of the reason. Null if stopped manually.")
    reason_params: Params


class LogFile(Model):
    """Log file in the data folder."""

    name: str = Field(description="File name.")
    bytes: int = Field(description="Size, bytes.")
    modified_at: Utc


_CHUNK = 1 << 18

LogName = Annotated[str, InPath(description="File name, as in `GET /bus/logs`.")]


@routes.post("/bus/log", Role.CONFIGURE, "busy", "invalid_value", "log_failed", status_code=201)
async def start_log(bus_log: TheBusLog, body: LogRequest) -> LogState:
    """Start logging all frames, received and sent, to a file in the data folder, until stopped or full.

    Logging continues after the bus is lost and reconnected. Frames that the disk cannot store in time are counted as
    dropped.
    """
    return _shown(await bus_log.start(body.format, body.name, round(body.limit_mb * 1e6)))


@routes.get("/bus/log", Role.VIEW)
async def get_log(bus_log: TheBusLog) -> LogState:
    """Get the state of the current or last log."""
    return _shown(bus_log.status)


@routes.delete("/bus/log", Role.CONFIGURE)
async def stop_log(bus_log: TheBusLog) -> LogState:
    """Stop logging. Responds when the file is complete. No effect if no log is running."""
    return _shown(await bus_log.stop())


@routes.get("/bus/logs", Role.VIEW)
async def list_logs(bus_log: TheBusLog, page: Annotated[Page, pages(1000, 1000)]) -> list[LogFile]:
    """List the logs in the data folder, newest first. To play a log back, `PUT /bus` with address `file:NAME`."""
    files = page.of(await asyncio.to_thread(bus_log.folder.all), lambda file: file.name)
    return [LogFile(name=file.name, bytes=file.size, modified_at=file.modified_at) for file in files]


@routes.get(
    "/bus/logs/{name}",
    Role.VIEW,
    "unknown_log",
    response_class=StreamingResponse,
    responses={200: {"content": {"application/octet-stream": {}}}},
)
async def download_log(bus_log: TheBusLog, name: LogName) -> StreamingResponse:
    """Download a log. For a running log, its current content."""
    path = bus_log.folder.path(name)
    size = path.stat().st_size
    headers = {"Content-Length": str(size), **attachment(path.name)}
    return StreamingResponse(_content(path, size), media_type="application/octet-stream", headers=headers)


@routes.delete("/bus/logs/{name}", Role.ADMIN, "unknown_log", "busy", "log_failed", status_code=204)
async def delete_log(bus_log: TheBusLog, name: LogName) -> None:
    """Delete a log from the data folder."""
    await bus_log.delete(name)


async def _content(path: Path, size: int) -> AsyncIterator[bytes]:
    """The first `size` bytes. A running log grows while it is sent, beyond the announced length."""
    loop = asyncio.get_running_loop()
    with path.open("rb") as file:
        while size > 0 and (chunk := await loop.run_in_executor(None, file.read, min(size, _CHUNK))):
            size -= len(chunk)
            yield chunk


def _shown(status: LogStatus) -> LogState:
    return LogState(
        state=status.phase.value,
        name=status.name,
        format=status.form,
        started_at=status.started_at,
        frames=status.frames,
        dropped=status.dropped,
        bytes=status.size,
        limit_bytes=status.limit,
        reason=None if status.reason is None else status.reason.text,
        reason_code=None if status.reason is None else status.reason.code,
        reason_params={} if status.reason is None else status.reason.params,
    )
