"""Owns the routes of the log of the bus, and of the logs written before."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter
from fastapi import Path as InPath
from starlette.responses import StreamingResponse

from hornbill.api import PREFIX, bus_models
from hornbill.api.dependencies import TheRecorder
from hornbill.api.problems import declared
from hornbill.bus.logfile import LogFormat
from hornbill.bus.recorder import LogStatus

router = APIRouter(prefix=PREFIX, tags=["logs"])

_CHUNK = 1 << 18

LogName = Annotated[str, InPath(description="file name, as in GET /bus/logs")]


@router.post("/bus/log", operation_id="start_log", status_code=201,
             responses=declared("busy", "invalid_value", "log_failed"))  # fmt: skip
async def start_log(recorder: TheRecorder, body: bus_models.LogRequest) -> bus_models.LogState:
    """Write every frame to a file in the data folder, sent ones included, until it is stopped or full.

    The log goes on when the bus is lost and found again. A slow disk never slows the bus: what it cannot take is
    counted as dropped.
    """
    return _shown(await recorder.start(LogFormat(body.format), body.name, round(body.limit_mb * 1e6)))


@router.get("/bus/log", operation_id="get_log")
async def get_log(recorder: TheRecorder) -> bus_models.LogState:
    """The log that is written, or the last one."""
    return _shown(recorder.status)


@router.delete("/bus/log", operation_id="stop_log")
async def stop_log(recorder: TheRecorder) -> bus_models.LogState:
    """End the log; it answers when the file is complete. Without one nothing happens."""
    return _shown(await recorder.stop())


@router.get("/bus/logs", operation_id="list_logs")
async def list_logs(recorder: TheRecorder) -> list[bus_models.LogFile]:
    """The logs in the data folder, the newest first. One can be played: `PUT /bus` with address `file:NAME`."""
    kept = await asyncio.to_thread(recorder.folder.all)
    return [bus_models.LogFile(name=one.name, bytes=one.size, modified_at=one.modified_at) for one in kept]


@router.get("/bus/logs/{name}", operation_id="download_log", response_class=StreamingResponse,
            responses=declared("unknown_log") | {200: {"content": {"application/octet-stream": {}}}})  # fmt: skip
async def download_log(recorder: TheRecorder, name: LogName) -> StreamingResponse:
    """The file; of the log being written, what is in it now."""
    path = recorder.folder.path(name)
    size = path.stat().st_size
    headers = {"Content-Length": str(size), "Content-Disposition": f'attachment; filename="{path.name}"'}
    return StreamingResponse(_content(path, size), media_type="application/octet-stream", headers=headers)


@router.delete("/bus/logs/{name}", operation_id="delete_log", status_code=204,
               responses=declared("unknown_log", "busy", "log_failed"))  # fmt: skip
async def delete_log(recorder: TheRecorder, name: LogName) -> None:
    """Remove a log from the data folder."""
    await recorder.delete(name)


async def _content(path: Path, size: int) -> AsyncIterator[bytes]:
    """The first `size` bytes: a file that grows meanwhile must not be longer than was announced."""
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
