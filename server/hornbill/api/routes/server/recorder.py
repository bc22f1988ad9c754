"""Routes of the recorder: the last ten minutes, and the bundles written of them."""

import asyncio
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

from fastapi import Path as InPath
from fastapi import Query, Request, Response
from pydantic import Field
from starlette.responses import FileResponse

from hornbill.api.dependencies import TheBundles, TheHost
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.bus.recordings.bundle import (
    EVENTS,
    TELEMETRY,
    WRITES,
    BundleReader,
    read_events,
    read_telemetry,
    read_writes,
)
from hornbill.bus.recordings.folder import StoredFile
from hornbill.domain.fields import Model, Param, Params
from hornbill.domain.recording import About, Columns, MarkReason
from hornbill.errors import InvalidValue, LogFailed

routes = Routes("recorder")


class BundleMark(Model):
    """A moment for which a bundle was, or will be, written."""

    at: float = Field(description="Time of the trigger, seconds since 1970 UTC.")
    reason: MarkReason = Field(description="Type of trigger.")
    text: str = Field(description="One sentence for users.")
    uid: str | None = Field(
        default=None, description="Unique ID of the servo, 32 hex digits. Null if it concerns none."
    )
    params: Params = Field(default_factory=dict[str, Param])


class PendingBundle(Model):
    """A bundle that still takes in what happens."""

    reason: MarkReason = Field(description="Type of trigger.")
    text: str = Field(description="One sentence for users.")
    marks: list[BundleMark] = Field(description="Triggers of the recording.")
    ready_in_s: float = Field(description="Time until it is written, s.")


class RecorderState(Model):
    """The recorder of the last ten minutes; it needs no starting."""

    recording: bool = Field(description="false while a recording is played.")
    reach_s: float = Field(description="Time span recorded, s. Less than 600 after a start or if memory is full.")
    frames: int = Field(description="Number of CAN frames.")
    bytes: int = Field(description="Memory in use, bytes.")
    before_s: float = Field(description="Time a recording covers before its first trigger, s.")
    pending: PendingBundle | None = Field(description="Recording that is not complete yet. Null if none.")


class BundleRequest(Model):
    """What to write a bundle for."""

    reason: Annotated[str, Field(max_length=200)] = Field(
        default="By hand.", description="Reason, shown to users and used in the file name."
    )
    before_s: float | None = Field(
        default=None, ge=1, le=600, description="Time to cover before now, s. Null for the configured time."
    )


class Bundle(Model):
    """A bundle in the data folder. `problem` says why one cannot be read; then little else is known of it."""

    name: str = Field(description="File name.")
    at: float = Field(description="Time of its first trigger, seconds since 1970 UTC.")
    reason: MarkReason | None = Field(description="Type of trigger.")
    text: str = Field(description="One sentence for users.")
    bytes: int = Field(description="Size, bytes.")
    started_at: float | None = Field(description="Start, seconds since 1970 UTC. Null if the file cannot be read.")
    seconds: float | None = Field(description="Duration, s. Null if the file cannot be read.")
    marks: list[BundleMark] = Field(description="Triggers of the recording.")
    problem: str | None = Field(default=None, description="Reason why the file cannot be read. Null if it can.")
    problem_params: Params = Field(default_factory=dict[str, Param])


class BundleContent(Model):
    """What a page shows of a bundle. Its frames are played: `PUT /bus` with address `bundle:NAME`."""

    about: About
    telemetry: list[Columns] = Field(description="Telemetry, at most 500,000 samples.")
    complete: bool = Field(description="false if there is more telemetry than that.")
    events: list[dict[str, Any]] = Field(description="Events during the recording.")
    writes: list[dict[str, str]] = Field(description="Writes during the recording.")


_ZIP = "application/zip"

BundleName = Annotated[str, InPath(description="File name, as in `GET /recorder/bundles`.")]


@routes.get("/recorder", Role.VIEW)
async def get_recorder(host: TheHost) -> RecorderState:
    """How far the recorder reaches back, and the bundle it is about to write."""
    box = host.recorder
    pending = box.pending
    return RecorderState(
        recording=box.recording,
        reach_s=round(box.reach_s, 1),
        frames=box.ring.frames,
        bytes=box.ring.size,
        before_s=box.before_s,
        pending=None
        if pending is None
        else PendingBundle(
            reason=pending.reason,
            text=pending.text,
            marks=[BundleMark.model_validate(mark) for mark in pending.marks],
            ready_in_s=round(max(0.0, pending.until - host.base.now()), 1),
        ),
    )


@routes.post(
    "/recorder/bundles",
    Role.OPERATE,
    "busy",
    "invalid_value",
    "log_failed",
    status_code=202,
    response_model=RecorderState | Bundle,
    responses={201: {"model": Bundle, "description": "wait"}},
)
async def write_bundle(
    host: TheHost,
    bundles: TheBundles,
    response: Response,
    body: BundleRequest | None = None,
    wait: Annotated[bool, Query(description="Wait until the file is written.")] = False,
) -> RecorderState | Bundle:
    """Write a bundle of what happened lately, and of the ten seconds from now on.

    One that is pending already takes this in as a mark. Without `wait` the answer (202) is the recorder's state, and
    the bundle is in the list once it is written; with it (201) the bundle.
    """
    asked = body or BundleRequest()
    done = host.recorder.by_hand(asked.reason, asked.before_s)
    if not wait:
        return await get_recorder(host)
    name = await asyncio.shield(done)
    response.status_code = 201
    return await asyncio.to_thread(lambda: _shown(StoredFile.of(bundles.path(name))))


@routes.get("/recorder/bundles", Role.VIEW)
async def list_bundles(bundles: TheBundles) -> list[Bundle]:
    """The bundles in the data folder, the newest first. One is played with `PUT /bus`, address `bundle:NAME`."""
    return await asyncio.to_thread(lambda: [_shown(one) for one in bundles.all()])


@routes.get(
    "/recorder/bundles/{name}",
    Role.VIEW,
    "unknown_bundle",
    response_class=FileResponse,
    responses={200: {"content": {_ZIP: {}}}},
)
async def download_bundle(bundles: TheBundles, name: BundleName) -> FileResponse:
    """The file: a .zip that any machine opens, with frames in the form of `candump -l`."""
    path = bundles.path(name)
    return FileResponse(path, media_type=_ZIP, filename=path.name)


@routes.get("/recorder/bundles/{name}/content", Role.VIEW, "unknown_bundle", "log_failed")
async def get_bundle(bundles: TheBundles, name: BundleName) -> BundleContent:
    """What a page shows of it: what it is of, telemetry in columns, events and writes."""
    return await asyncio.to_thread(_read, bundles.path(name))


@routes.put(
    "/recorder/bundles/{name}",
    Role.CONFIGURE,
    "invalid_value",
    "out_of_range",
    "log_failed",
    status_code=201,
    openapi_extra={
        "requestBody": {"required": True, "content": {_ZIP: {"schema": {"type": "string", "format": "binary"}}}}
    },
)
async def add_bundle(bundles: TheBundles, name: BundleName, request: Request) -> Bundle:
    """Bring a bundle of somebody else, at most 100 MB; a file that is none is refused, and nothing is kept of it."""
    await bundles.adopt(name, request.stream(), _accept)
    return await asyncio.to_thread(lambda: _shown(StoredFile.of(bundles.path(name))))


@routes.delete("/recorder/bundles/{name}", Role.ADMIN, "unknown_bundle", "log_failed", status_code=204)
async def delete_bundle(bundles: TheBundles, name: BundleName) -> None:
    """Remove a bundle from the data folder."""
    await asyncio.to_thread(bundles.delete, name)


def _accept(path: Path) -> None:
    """In a thread. Raises InvalidValue."""
    try:
        with BundleReader(path) as bundle:
            bundle.about()
            bundle.check()
    except LogFailed as error:
        facts: dict[str, Any] = {"cause": None, **error.facts, "name": path.name.removesuffix(".part")}
        raise InvalidValue(error.detail.replace(".part", ""), **facts) from error


def _shown(kept: StoredFile) -> Bundle:
    try:
        return _read_summary(kept)
    except LogFailed as error:
        return Bundle(
            name=kept.name, at=kept.modified_at, reason=None, text="", bytes=kept.size,
            started_at=None, seconds=None, marks=[], problem=error.detail, problem_params=error.told,
        )  # fmt: skip


@lru_cache(maxsize=64)
def _read_summary(kept: StoredFile) -> Bundle:
    """Read from the disk once while the file stays as it is. Raises LogFailed."""
    with BundleReader(kept.path) as bundle:
        about = bundle.about()
    return Bundle(
        name=kept.name, at=about.marks[0].at, reason=about.reason, text=about.text, bytes=kept.size,
        started_at=about.started_at, seconds=round(about.ended_at - about.started_at, 1),
        marks=[BundleMark.model_validate(mark) for mark in about.marks],
    )  # fmt: skip


def _read(path: Path) -> BundleContent:
    with BundleReader(path) as bundle:
        telemetry, complete = read_telemetry(bundle.member(TELEMETRY))
        return BundleContent(
            about=bundle.about(), telemetry=telemetry, complete=complete,
            events=read_events(bundle.member(EVENTS)), writes=read_writes(bundle.member(WRITES)),
        )  # fmt: skip
