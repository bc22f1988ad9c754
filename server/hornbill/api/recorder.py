"""Owns the routes of the recorder: the last ten minutes, and the bundles written of them."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from fastapi import Path as InPath
from starlette.responses import StreamingResponse

from hornbill.api import PREFIX
from hornbill.api import recorder_models as models
from hornbill.api.dependencies import TheBundles, TheHost
from hornbill.api.problems import declared
from hornbill.bus import bundles as files
from hornbill.bus.bundles import BundleFolder, KeptBundle
from hornbill.errors import InvalidValue, LogFailed
from hornbill.servo import bundle as form

router = APIRouter(prefix=PREFIX, tags=["recorder"])

_CHUNK = 1 << 18
_ZIP = "application/zip"

BundleName = Annotated[str, InPath(description="file name, as in GET /recorder/bundles")]


@router.get("/recorder", operation_id="get_recorder")
async def get_recorder(host: TheHost) -> models.RecorderState:
    """How far the recorder reaches back, and the bundle it is about to write."""
    box = host.blackbox
    pending = box.pending
    return models.RecorderState(
        recording=box.recording,
        reach_s=round(box.reach_s, 1),
        frames=box.ring.frames,
        bytes=box.ring.size,
        before_s=box.before_s,
        pending=None
        if pending is None
        else models.PendingBundle(
            reason=pending.reason,
            text=pending.text,
            marks=[models.BundleMark.model_validate(mark) for mark in pending.marks],
            ready_in_s=round(max(0.0, pending.until - host.base.now()), 1),
        ),
    )


@router.post(
    "/recorder/bundles",
    operation_id="write_bundle",
    status_code=202,
    response_model=models.RecorderState | models.Bundle,
    responses=declared("busy", "invalid_value", "log_failed") | {201: {"model": models.Bundle, "description": "wait"}},
)
async def write_bundle(
    host: TheHost,
    bundles: TheBundles,
    response: Response,
    body: models.BundleRequest | None = None,
    wait: Annotated[bool, Query(description="answer once it is written")] = False,
) -> models.RecorderState | models.Bundle:
    """Write a bundle of what happened lately, and of the ten seconds from now on.

    One that is pending already takes this in as a mark. Without `wait` the answer (202) is the recorder's state, and
    the bundle is in the list once it is written; with it (201) the bundle.
    """
    asked = body or models.BundleRequest()
    done = host.blackbox.by_hand(asked.reason, asked.before_s)
    if not wait:
        return await get_recorder(host)
    name = await asyncio.shield(done)
    response.status_code = 201
    return await asyncio.to_thread(_listed, bundles, name)


@router.get("/recorder/bundles", operation_id="list_bundles")
async def list_bundles(bundles: TheBundles) -> list[models.Bundle]:
    """The bundles in the data folder, the newest first. One is played with `PUT /bus`, address `bundle:NAME`."""
    return await asyncio.to_thread(lambda: [_shown(bundles, one) for one in bundles.all()])


@router.get("/recorder/bundles/{name}", operation_id="download_bundle", response_class=StreamingResponse,
            responses=declared("unknown_bundle") | {200: {"content": {_ZIP: {}}}})  # fmt: skip
async def download_bundle(bundles: TheBundles, name: BundleName) -> StreamingResponse:
    """The file: a .zip that any machine opens, with frames in the form of `candump -l`."""
    path = bundles.path(name)
    size = path.stat().st_size
    headers = {"Content-Length": str(size), "Content-Disposition": f'attachment; filename="{path.name}"'}
    return StreamingResponse(_content(path), media_type=_ZIP, headers=headers)


@router.get("/recorder/bundles/{name}/content", operation_id="get_bundle",
            responses=declared("unknown_bundle", "log_failed"))  # fmt: skip
async def get_bundle(bundles: TheBundles, name: BundleName) -> models.BundleContent:
    """What a page shows of it: what it is of, telemetry in columns, events and writes."""
    return await asyncio.to_thread(_read, bundles.path(name))


@router.put(
    "/recorder/bundles/{name}",
    operation_id="add_bundle",
    status_code=201,
    responses=declared("invalid_value", "out_of_range", "log_failed"),
    openapi_extra={
        "requestBody": {"required": True, "content": {_ZIP: {"schema": {"type": "string", "format": "binary"}}}}
    },
)
async def add_bundle(bundles: TheBundles, name: BundleName, request: Request) -> models.Bundle:
    """Bring a bundle of somebody else, at most 100 MB; a file that is none is refused, and nothing is kept of it."""
    await bundles.adopt(name, request.stream(), _accept)
    return await asyncio.to_thread(_listed, bundles, name)


@router.delete("/recorder/bundles/{name}", operation_id="delete_bundle", status_code=204,
               responses=declared("unknown_bundle", "log_failed"))  # fmt: skip
async def delete_bundle(bundles: TheBundles, name: BundleName) -> None:
    """Remove a bundle from the data folder."""
    await asyncio.to_thread(bundles.delete, name)


def _accept(path: Path) -> None:
    """In a thread. Raises InvalidValue."""
    try:
        form.read_about(files.member(path, files.ABOUT), path.name)
        files.check(path)
    except LogFailed as error:
        raise InvalidValue(error.detail.replace(".part", "")) from error


def _listed(bundles: BundleFolder, name: str) -> models.Bundle:
    path = bundles.path(name)
    return _shown(bundles, KeptBundle(name, path.stat().st_size, path.stat().st_mtime))


def _shown(bundles: BundleFolder, kept: KeptBundle) -> models.Bundle:
    try:
        about = form.read_about(bundles.about(kept), kept.name)
    except LogFailed as error:
        return models.Bundle(
            name=kept.name, at=kept.modified_at, reason=None, text="", bytes=kept.size, seconds=None, marks=[],
            problem=error.detail,
        )  # fmt: skip
    return models.Bundle(
        name=kept.name, at=about.marks[0].at, reason=about.reason, text=about.text, bytes=kept.size,
        seconds=round(about.ended_at - about.started_at, 1),
        marks=[models.BundleMark.model_validate(mark) for mark in about.marks],
    )  # fmt: skip


def _read(path: Path) -> models.BundleContent:
    about = form.read_about(files.member(path, files.ABOUT), path.name)
    telemetry, complete = form.columns(files.member(path, "telemetry.csv"))
    return models.BundleContent(
        about=about, telemetry=telemetry, complete=complete,
        events=form.events(files.member(path, "events.jsonl")), writes=form.writes(files.member(path, "writes.csv")),
    )  # fmt: skip


async def _content(path: Path) -> AsyncIterator[bytes]:
    loop = asyncio.get_running_loop()
    with path.open("rb") as file:
        while chunk := await loop.run_in_executor(None, file.read, _CHUNK):
            yield chunk
