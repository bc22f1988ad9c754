"""A recording: a recording of the recorder as a .zip with its log, telemetry, events and what it is of.

Nothing that is read in one is trusted: what it holds, its sizes and every line are bounded.
"""

import csv
import io
import logging
import math
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, Any, Final, Self

import orjson
from pydantic import ValidationError

from hornbill.bus.recordings.folder import FileFolder, PartFile
from hornbill.bus.recordings.reader import LogReader
from hornbill.bus.recordings.writer import candump
from hornbill.csv_text import Formatted, csv_text
from hornbill.domain.recording import About, Columns, RecordedWrite
from hornbill.errors import LogFailed
from hornbill.wire.frame import LoggedFrame

log = logging.getLogger(__name__)

README: Final = "README.txt"
ABOUT: Final = "about.json"
FRAMES: Final = "frames.log"
TELEMETRY: Final = "telemetry.csv"
EVENTS: Final = "events.jsonl"
WRITES: Final = "writes.csv"
MEMBERS: Final = {
    README: 1 << 16, ABOUT: 16 << 20, FRAMES: 320 << 20, TELEMETRY: 64 << 20, EVENTS: 16 << 20, WRITES: 32 << 20,
}  # fmt: skip
"""What a recording holds, and how many bytes each may unpack to; nothing else may be in one."""

LONGEST_LINE: Final = 4096
"""Bytes of a line of frames: so that nobody's file makes us hold all of it as one."""

SAMPLES_MOST: Final = 500_000
LINES_MOST: Final = 100_000
"""What is read of a recording at most: samples of telemetry, and lines of events or of writes."""

_HEADS: Final = {
    README: (
        "This is a flight recording of hornbill, which configures and drives BLA15 and BLA21 servos over DroneCAN: "
        "what was on the bus, and what was known, around the moment that about.json names.\n"
        "Open it in hornbill (Recorder, Import recording) or run `hornbill serve --bus recording:FILE.zip`. "
        "No adapter is needed, and nothing can be sent.\n"
        "frames.log is in the form of `candump -l`; telemetry.csv, events.jsonl and writes.csv count time in seconds "
        "since 1970 UTC, as it does.\n"
    ),
    FRAMES: "",
    TELEMETRY: csv_text([("time", "uid", "channel", "value")], end="\n"),
    EVENTS: "",
    WRITES: csv_text([RecordedWrite._fields], end="\n"),
}  # fmt: skip
"""How each member begins, in the order in which they are written."""

_PIECE: Final = 1 << 17
"""Bytes given to the disk in one go."""

_UNPACKED: Final = 1 << 18
_DAMAGE: Final = (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError, OSError)


class RecordingWriter:
    """A new recording, which takes one member after the other; it has its name once it is finished.

    Lines are made on the event loop, so callers add a few at a time; a thread packs them. Every coroutine raises
    LogFailed.
    """

    def __init__(self, file: PartFile, folder: FileFolder) -> None:
        self.name = file.path.name
        self.cut: list[str] = []
        """Members that reached the most bytes they may have, and are not complete."""
        self._file = file
        self._folder = folder
        self._zip = zipfile.ZipFile(file.content, "w", zipfile.ZIP_DEFLATED, compresslevel=4)
        self._open: IO[bytes] | None = None
        self._packing = ""
        self._member = ""
        self._begun: set[str] = set()
        self._room = 0
        self._waiting = bytearray()

    @classmethod
    async def begin(cls, folder: FileFolder, name: str) -> Self:
        """A new recording called `name`, with a number behind it when that is taken. Raises LogFailed."""
        return cls(await folder.begin(name), folder)

    async def add_frames(self, frames: Sequence[LoggedFrame]) -> None:
        """Frames with their times in seconds since 1970 UTC."""
        await self._add(FRAMES, candump(frames).encode())

    async def add_samples(self, uid: str, channel: str, times: Sequence[float], values: Sequence[float | None]) -> None:
        """Samples of one channel; times in seconds since 1970 UTC, None for a gap."""
        lines = ((_time(at), uid, channel, value) for at, value in zip(times, values, strict=True))
        await self._add(TELEMETRY, csv_text(lines, end="\n").encode())

    async def add_events(self, events: Sequence[bytes]) -> None:
        """Events, each a JSON object."""
        await self._add(EVENTS, b"".join(event + b"\n" for event in events))

    async def add_writes(self, writes: Sequence[RecordedWrite]) -> None:
        """What could change a servo; times in seconds since 1970 UTC."""
        await self._add(WRITES, csv_text(map(_write_line, writes), end="\n").encode())

    async def finish(self, about: About) -> tuple[int, list[str]]:
        """Add what it is of, and give it its name. Its bytes, and the names of the recordings dropped for it."""
        for member in _HEADS.keys() - self._begun:
            await self._add(member, b"")
        await self._add(ABOUT, orjson.dumps(about.model_dump(), option=orjson.OPT_INDENT_2))
        await self._flush()
        return await self._folder.run(self._finish)

    async def discard(self) -> None:
        """Leave nothing behind. Never raises."""
        await self._folder.run(self._discard)

    async def _add(self, member: str, data: bytes) -> None:
        if member != self._member:
            await self._flush()
            assert member not in self._begun, "a member is written in one go"
            self._begun.add(member)
            self._member, self._room = member, MEMBERS[member]
            data = _HEADS.get(member, "").encode() + data
        self._room -= len(data)
        if self._room < 0:
            self._room = 0
            if member not in self.cut:
                self.cut.append(member)
            return
        self._waiting += data
        if len(self._waiting) >= _PIECE:
            await self._flush()

    async def _flush(self) -> None:
        member, data = self._member, bytes(self._waiting)
        self._waiting.clear()
        if member:
            await self._folder.run(lambda: self._pack(member, data))

    def _pack(self, member: str, data: bytes) -> None:
        if self._open is None or self._packing != member:
            self._end_member()
            self._open = self._zip.open(member, "w", force_zip64=True)
            self._packing = member
        self._open.write(data)

    def _end_member(self) -> None:
        member, self._open = self._open, None
        if member is not None:
            member.close()

    def _finish(self) -> tuple[int, list[str]]:
        self._end_member()
        self._zip.close()
        return self._file.finish()

    def _discard(self) -> None:
        for close in (self._end_member, self._zip.close):
            try:
                close()
            except Exception as error:  # the disk may be what failed
                log.debug("a recording that failed did not close either: %s", error)
        self._file.discard()


class RecordingReader:
    """An open recording. It reads the disk: for a thread."""

    def __init__(self, path: Path) -> None:
        """Raises LogFailed for a file that holds anything but what a recording does, once each, or too much of it."""
        self.name = path.name
        try:
            self._zip = zipfile.ZipFile(path)
        except OSError as error:
            raise LogFailed(
                f"{path} cannot be read: {error.strerror}. Check its name and your permission.",
                cause="file_unreadable",
                name=str(path),
            ) from error
        except (zipfile.BadZipFile, ValueError, NotImplementedError, EOFError) as error:
            raise self._refusal(str(error)) from error
        why = _why_none(self._zip)
        if why is not None:
            self._zip.close()
            raise self._refusal(why)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file. Idempotent."""
        self._zip.close()

    def member(self, name: str) -> bytes:
        """A member as it was written; empty when there is none. Raises LogFailed."""
        if name not in self._zip.namelist():
            return b""
        try:
            with self._zip.open(name) as file:
                return file.read(MEMBERS[name] + 1)
        except _DAMAGE as error:
            raise self._damaged(name, error) from error

    def about(self) -> About:
        """What it is of. Raises LogFailed."""
        return read_about(self.member(ABOUT), self.name)

    def check(self) -> None:
        """Unpack all of it once without keeping it: what it says of itself may be wrong.

        Raises LogFailed for one that is damaged, or unpacks to more than a recording may.
        """
        for member in self._zip.namelist():
            try:
                self._walk(member)
            except _DAMAGE as error:
                raise self._damaged(member, error) from error

    def frames(self) -> LogReader:
        """The frames, with what they are of. It stays open when this is closed. Raises LogFailed."""
        self.check()
        file = self._zip.open(FRAMES)
        recording = LogReader(file, self.name)  # pyright: ignore[reportArgumentType] - peek and read are all it uses
        recording.about = self.about()
        return recording

    def _walk(self, member: str) -> None:
        line = 0
        with self._zip.open(member) as file:
            while piece := file.read(_UNPACKED):
                if member != FRAMES:
                    continue
                parts = piece.split(b"\n")
                line += len(parts[0])
                if max(line, *map(len, parts)) > LONGEST_LINE:
                    raise self._refusal(f"its {FRAMES} is not made of lines", "")
                line = len(parts[-1]) if len(parts) > 1 else line

    def _refusal(self, why: str, remedy: str = " Give a .zip that hornbill wrote.") -> LogFailed:
        return LogFailed(
            f"{self.name} is no recording of hornbill: {why}.{remedy}", cause="not_a_recording", name=self.name
        )

    def _damaged(self, member: str, error: Exception) -> LogFailed:
        return LogFailed(
            f"{self.name} is damaged: {member} cannot be unpacked ({error}).", cause="recording_damaged", name=self.name
        )


def read_about(data: bytes, name: str) -> About:
    """What about.json of the recording `name` says. Raises LogFailed."""
    try:
        return About.model_validate(orjson.loads(data))
    except (orjson.JSONDecodeError, RecursionError) as error:
        raise LogFailed(
            f"{name} is no recording of hornbill: its about.json is no JSON.", cause="not_a_recording", name=name
        ) from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "about.json"
        raise LogFailed(
            f"{name} is no recording that this hornbill can read: {where[:120]}: {first['msg']}.",
            cause="recording_unreadable",
            name=name,
        ) from error


def read_telemetry(data: bytes) -> tuple[list[Columns], bool]:
    """Telemetry by servo and channel, in the order of first sight, and whether that is all of it. Never raises."""
    found: dict[tuple[str, str], Columns] = {}
    for place, row in enumerate(_rows(data)):
        if place >= SAMPLES_MOST:
            return list(found.values()), False
        if len(row) != 4 or (at := _number(row[0])) is None:
            continue
        uid, channel = row[1][:32], row[2][:120]
        column = found.get((uid, channel))
        if column is None:
            column = found[uid, channel] = Columns(uid=uid, channel=channel, t=[], v=[])
        column.t.append(at)
        column.v.append(_number(row[3]))
    return list(found.values()), True


def read_writes(data: bytes) -> list[dict[str, str]]:
    """The lines of writes.csv by the names of its head. Never raises."""
    head = RecordedWrite._fields
    rows = (row for place, row in enumerate(_rows(data)) if place < LINES_MOST)
    return [dict(zip(head, row, strict=True)) for row in rows if len(row) == len(head)]


def read_events(data: bytes) -> list[dict[str, Any]]:
    """The lines of events.jsonl that are JSON objects. Never raises."""
    found: list[dict[str, Any]] = []
    for line in data.split(b"\n", LINES_MOST)[:LINES_MOST]:
        try:
            one = orjson.loads(line) if line else None
        except (orjson.JSONDecodeError, RecursionError):
            continue
        if isinstance(one, dict):
            found.append(one)  # pyright: ignore[reportUnknownArgumentType] - JSON objects have text for keys
    return found


def _why_none(recording: zipfile.ZipFile) -> str | None:
    names = recording.namelist()
    if len(set(names)) < len(names) or not set(names) <= MEMBERS.keys():
        return "it holds other files than a recording does"
    if not {ABOUT, FRAMES} <= set(names):
        return f"it holds no {ABOUT} or no {FRAMES}"
    big = next((info.filename for info in recording.infolist() if info.file_size > MEMBERS[info.filename]), None)
    return None if big is None else f"its {big} unpacks to more than {MEMBERS[big] >> 20} MiB"


def _write_line(write: RecordedWrite) -> tuple[object, ...]:
    value = Formatted(f"{write.value:.6g}") if write.kind == "array_command" else write.value
    return (_time(write.time), *write[1:-1], value)


def _time(at: float) -> Formatted:
    return Formatted(f"{at:.6f}")


def _rows(data: bytes) -> Iterator[list[str]]:
    """The lines below the head; where the form breaks, it ends."""
    reader = csv.reader(io.StringIO(data.decode("utf-8", "replace")))
    try:
        next(reader, None)
        yield from reader
    except csv.Error:
        return


def _number(text: str) -> float | None:
    try:
        found = float(text)
    except ValueError:
        return None
    return found if math.isfinite(found) else None
