"""Routes of the recorder and its recordings."""

import asyncio
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

from fastapi import Path as InPath
from fastapi import Query, Request, Response
from pydantic import Field
from starlette.responses import FileResponse

from hornbill.api.dependencies import TheHost, TheRecordings
from hornbill.api.paging import Page, pages
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.bus.recordings.folder import StoredFile
from hornbill.bus.recordings.recording import (
    EVENTS,
    TELEMETRY,
    WRITES,
    RecordingReader,
    read_events,
    read_telemetry,
    read_writes,
)
from hornbill.domain.fields import Model, Param, Params
from hornbill.domain.recording import About, Columns, MarkReason
from hornbill.errors import InvalidValue, LogFailed

routes = Routes("recorder")


class RecordingMark(Model):
    """A trigger of a recording."""

    at: float = Field(description="Time of the trigger, seconds since 1970 UTC.")
    reason: MarkReason = Field(description="Type of trigger.")
    text: str = Field(description="One sentence for users.")
    uid: str | None = Field(
        default=None, description="Unique ID of the servo, 32 hex digits. Null if it concerns none."
    )
    params: Params = Field(default_factory=dict[str, Param])


class PendingRecording(Model):
    """A recording in progress."""

    reason: MarkReason = Field(description="Type of trigger.")
    text: str = Field(description="One sentence for users.")
    marks: list[RecordingMark] = Field(description="Triggers of the recording.")
    ready_in_s: float = Field(description="Time until it is written, s.")


class RecorderState(Model):
    """State of the recorder, which continuously buffers up to ten minutes."""

    recording: bool = Field(description="The recorder is running. false while a recording is played back.")
    reach_s: float = Field(description="Time span recorded, s. Less than 600 after a start or if memory is full.")
    frames: int = Field(description="Number of CAN frames.")
    bytes: int = Field(description="Memory in use, bytes.")
    before_s: float = Field(description="Time a recording covers before its first trigger, s.")
    pending: PendingRecording | None = Field(description="Recording that is not complete yet. Null if none.")


class RecordingRequest(Model):
    """Options of a new recording."""

    reason: Annotated[str, Field(max_length=200)] = Field(
        default="Manual.", description="Reason, shown to users and used in the file name."
    )
    before_s: float | None = Field(
        default=None, ge=1, le=600, description="Time to cover before now, s. Null for the configured time."
    )


class Recording(Model):
    """A recording in the data folder."""

    name: str = Field(description="File name.")
    at: float = Field(description="Time of its first trigger, seconds since 1970 UTC.")
    reason: MarkReason | None = Field(description="Type of trigger.")
    text: str = Field(description="One sentence for users.")
    bytes: int = Field(description="Size, bytes.")
    started_at: float | None = Field(description="Start, seconds since 1970 UTC. Null if the file cannot be read.")
    seconds: float | None = Field(description="Duration, s. Null if the file cannot be read.")
    marks: list[RecordingMark] = Field(description="Triggers of the recording.")
    problem: str | None = Field(default=None, description="Reason why the file cannot be read. Null if it can.")
    problem_params: Params = Field(default_factory=dict[str, Param])


class RecordingContent(Model):
    """Content of a recording except its frames. To play it back, `PUT /bus` with address `recording:NAME`."""

    about: About
    telemetry: list[Columns] = Field(description="Telemetry, at most 500,000 samples.")
    complete: bool = Field(description="All telemetry is included. false if it was truncated.")
    events: list[dict[str, Any]] = Field(description="Events during the recording.")
    writes: list[dict[str, str]] = Field(description="Writes during the recording.")


_ZIP = "application/zip"

RecordingName = Annotated[str, InPath(description="File name, as in `GET /recorder/recordings`.")]


@routes.get("/recorder", Role.VIEW)
async def get_recorder(host: TheHost) -> RecorderState:
    """Get the state of the recorder and its recording in progress."""
    recorder = host.recorder
    pending = recorder.pending
    return RecorderState(
        recording=recorder.recording,
        reach_s=round(recorder.reach_s, 1),
        frames=recorder.ring.frames,
        bytes=recorder.ring.size,
        before_s=recorder.before_s,
        pending=None
        if pending is None
        else PendingRecording(
            reason=pending.reason,
            text=pending.text,
            marks=[RecordingMark.model_validate(mark) for mark in pending.marks],
            ready_in_s=round(max(0.0, pending.until - host.base.now()), 1),
        ),
    )


@routes.post(
    "/recorder/recordings",
    Role.OPERATE,
    "busy",
    "invalid_value",
    "log_failed",
    status_code=202,
    response_model=RecorderState | Recording,
    responses={201: {"model": Recording, "description": "Recording, with `wait`."}},
)
async def create_recording(
    host: TheHost,
    recordings: TheRecordings,
    response: Response,
    body: RecordingRequest | None = None,
    wait: Annotated[bool, Query(description="Wait until the file is written.")] = False,
) -> RecorderState | Recording:
    """Create a recording of recent events and the next ten seconds.

    If a recording is in progress, this adds a mark to it. Without `wait` the response (202) is the state of the
    recorder; the recording is listed once it is written. With `wait` the response (201) is the recording.
    """
    wanted = body or RecordingRequest()
    done = host.recorder.trigger(wanted.reason, wanted.before_s)
    if not wait:
        return await get_recorder(host)
    name = await asyncio.shield(done)
    response.status_code = 201
    return await asyncio.to_thread(lambda: _shown(StoredFile.of(recordings.path(name))))


@routes.get("/recorder/recordings", Role.VIEW)
async def list_recordings(recordings: TheRecordings, page: Annotated[Page, pages(1000, 1000)]) -> list[Recording]:
    """List the recordings in the data folder, newest first."""
    return await asyncio.to_thread(lambda: [_shown(one) for one in page.of(recordings.all(), lambda file: file.name)])


@routes.get(
    "/recorder/recordings/{name}",
    Role.VIEW,
    "unknown_recording",
    response_class=FileResponse,
    responses={200: {"content": {_ZIP: {}}}},
)
async def download_recording(recordings: TheRecordings, name: RecordingName) -> FileResponse:
    """Download a recording: a ZIP file that contains the frames in `candump -l` format."""
    path = recordings.path(name)
    return FileResponse(path, media_type=_ZIP, filename=path.name)


@routes.get("/recorder/recordings/{name}/content", Role.VIEW, "unknown_recording", "log_failed")
async def get_recording(recordings: TheRecordings, name: RecordingName) -> RecordingContent:
    """Get the metadata, telemetry, events and writes of a recording."""
    return await asyncio.to_thread(_read, recordings.path(name))


@routes.put(
    "/recorder/recordings/{name}",
    Role.CONFIGURE,
    "invalid_value",
    "out_of_range",
    "log_failed",
    status_code=201,
    openapi_extra={
        "requestBody": {"required": True, "content": {_ZIP: {"schema": {"type": "string", "format": "binary"}}}}
    },
)
async def import_recording(recordings: TheRecordings, name: RecordingName, request: Request) -> Recording:
    """Import a recording, at most 100 MB. Any other file is rejected and not stored."""
    await recordings.adopt(name, request.stream(), _accept)
    return await asyncio.to_thread(lambda: _shown(StoredFile.of(recordings.path(name))))


@routes.delete("/recorder/recordings/{name}", Role.ADMIN, "unknown_recording", "log_failed", status_code=204)
async def delete_recording(recordings: TheRecordings, name: RecordingName) -> None:
    """Delete a recording from the data folder."""
    await asyncio.to_thread(recordings.delete, name)


def _accept(path: Path) -> None:
    """Check an imported file, in a thread. Raises InvalidValue."""
    try:
        with RecordingReader(path) as recording:
            recording.about()
            recording.check()
    except LogFailed as error:
        facts: dict[str, Any] = {"cause": None, **error.facts, "name": path.name.removesuffix(".part")}
        raise InvalidValue(error.detail.replace(".part", ""), **facts) from error


def _shown(file: StoredFile) -> Recording:
    try:
        return _read_summary(file)
    except LogFailed as error:
        return Recording(
            name=file.name, at=file.modified_at, reason=None, text="", bytes=file.size,
            started_at=None, seconds=None, marks=[], problem=error.detail, problem_params=error.note_params,
        )  # fmt: skip


@lru_cache(maxsize=64)
def _read_summary(file: StoredFile) -> Recording:
    """Summary of a recording, cached until the file changes. Raises LogFailed."""
    with RecordingReader(file.path) as recording:
        about = recording.about()
    return Recording(
        name=file.name, at=about.marks[0].at, reason=about.reason, text=about.text, bytes=file.size,
        started_at=about.started_at, seconds=round(about.ended_at - about.started_at, 1),
        marks=[RecordingMark.model_validate(mark) for mark in about.marks],
    )  # fmt: skip


def _read(path: Path) -> RecordingContent:
    with RecordingReader(path) as recording:
        telemetry, complete = read_telemetry(recording.member(TELEMETRY))
        return RecordingContent(
            about=recording.about(), telemetry=telemetry, complete=complete,
            events=read_events(recording.member(EVENTS)), writes=read_writes(recording.member(WRITES)),
        )  # fmt: skip
