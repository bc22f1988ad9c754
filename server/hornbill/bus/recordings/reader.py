"""LogReader: reads frames of a candump, ASC, BLF or CSV log one at a time, from a file or a live pipe.

The candump format is read without python-can's reader, which treats most error frames as data and ends at the first
truncated line.
"""

import io
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, cast

import can

from hornbill.bus.recordings.writer import LogFormat
from hornbill.domain.recording import About
from hornbill.errors import LogFailed
from hornbill.wire.frame import Frame, LoggedFrame

_SIGNATURES: Final = {
    b"(": LogFormat.CANDUMP,
    b"LOGG": LogFormat.BLF,
    b"date": LogFormat.ASC,
    b"base": LogFormat.ASC,
    b"//": LogFormat.ASC,
    b"timestamp,": LogFormat.CSV,
}
_CANDUMP_LINE: Final = re.compile(
    r"\s*\((\d{1,12}(?:\.\d{1,9})?)\)\s+(\S+)\s+([0-9A-F]{3}|[0-9A-F]{8})#(\S*?)(?:_[0-9A-F])?(?:\s+([RT]))?\s*",
    re.ASCII | re.IGNORECASE,
)
_ERROR_FLAG: Final = 0x2000_0000
_LAST_IDENTIFIER: Final = 0x1FFF_FFFF


@dataclass(slots=True)
class LogCounters:
    """Counters of a log. `ignored` are standard, remote and FD frames, `unreadable` lines that contain no frame."""

    frames: int = 0
    ignored: int = 0
    error_frames: int = 0
    unreadable: int = 0


class LogReader:
    """An iterable of LoggedFrame in file order, with only the current one in memory.

    The format is detected from the first bytes, so the file name does not matter.
    """

    def __init__(self, file: io.BufferedReader, name: str) -> None:
        """Takes ownership of `file`. `name` is for messages. Raises LogFailed if it is not a log."""
        self.name = name
        self.counters = LogCounters()
        self.about: About | None = None
        """Contents of a recording. None for a plain log."""
        self._file = file
        try:
            beginning = file.peek(16).removeprefix(b"\xef\xbb\xbf").lstrip().lower()
        except OSError as error:
            file.close()
            raise LogFailed(f"{name} cannot be read: {error.strerror}.", cause="file_unreadable", name=name) from error
        form = next((form for start, form in _SIGNATURES.items() if beginning.startswith(start.lower())), None)
        if form is None and beginning:
            file.close()
            raise LogFailed(
                f"{name} is not a supported log. Use a file of candump -l or candump -L, an ASC or BLF file, or a CSV "
                "file of hornbill or python-can.",
                cause="log_format_unknown",
                name=name,
            )
        self.form = form or LogFormat.CANDUMP  # for an empty file or closed pipe the format does not matter
        self._text = io.TextIOWrapper(file, "utf-8-sig", errors="replace")  # does not read anything yet

    @classmethod
    def open(cls, path: Path) -> "LogReader":
        """Open a log file. Raises LogFailed with the cause and the remedy."""
        try:
            file = path.open("rb")
        except OSError as error:
            raise LogFailed(
                f"{path} cannot be read: {error.strerror}. Check its name and permissions.",
                cause="file_unreadable",
                name=str(path),
            ) from error
        except ValueError as error:
            raise LogFailed(
                f"{str(path)!r} is not a valid file name: {error}.", cause="file_name_invalid", name=str(path)[:90]
            ) from error
        return cls(file, str(path))

    def __iter__(self) -> Iterator[LoggedFrame]:
        """Iterate once. Raises LogFailed if the disk fails or a BLF file is damaged."""
        found = self._candump() if self.form is LogFormat.CANDUMP else self._through_python_can()
        try:
            yield from found
        except OSError as error:
            raise LogFailed(
                f"Reading {self.name} failed: {error.strerror or error}.", cause="file_unreadable", name=self.name
            ) from error
        except Exception as error:
            read = self.counters.frames
            raise LogFailed(
                f"{self.name} is damaged and cannot be read beyond {read} frames.",
                cause="log_damaged",
                name=self.name,
                frames=read,
            ) from error

    def close(self) -> None:
        """Close the file. Idempotent."""
        self._text.close()

    def _candump(self) -> Iterator[LoggedFrame]:
        """Lines such as `(1436509052.249713) can0 1003F30B#0102 R`; the last word is optional."""
        counters, line_of = self.counters, _CANDUMP_LINE.fullmatch
        for line in self._text:
            found = line_of(line)
            if found is None:
                counters.unreadable += bool(line.strip())
                continue
            stamp, channel, can_id, hexadecimal, direction = found.groups()
            number = int(can_id, 16)
            if len(can_id) == 8 and number & _ERROR_FLAG:
                counters.error_frames += 1
            elif len(can_id) == 3 or hexadecimal[:1] in ("#", "R", "r"):
                counters.ignored += 1
            elif (data := _bytes(hexadecimal)) is None or number > _LAST_IDENTIFIER:
                counters.unreadable += 1
            else:
                counters.frames += 1
                yield LoggedFrame(Frame(number, data, float(stamp)), channel, direction in ("T", "t"))

    def _through_python_can(self) -> Iterator[LoggedFrame]:
        counters = self.counters
        for message in self._messages():
            if message.is_error_frame:
                counters.error_frames += 1
            elif not message.is_extended_id or message.is_remote_frame or message.is_fd:
                counters.ignored += 1
            elif (
                len(message.data) > 8
                or not math.isfinite(message.timestamp)
                or not 0 <= message.arbitration_id <= _LAST_IDENTIFIER
            ):
                counters.unreadable += 1
            else:
                counters.frames += 1
                frame = Frame(message.arbitration_id, bytes(message.data), message.timestamp)
                yield LoggedFrame(frame, str(message.channel), not message.is_rx)

    def _messages(self) -> Iterator[can.Message]:
        """Messages from python-can's reader. In text formats, lines it fails to parse are counted and skipped."""
        if self.form is LogFormat.BLF:
            yield from can.BLFReader(self._file)
            return
        lines = _Lines(self._text)
        text = cast(Any, lines)  # the readers only iterate and close
        reader = can.CSVReader(text) if self.form is LogFormat.CSV else can.ASCReader(text, relative_timestamp=False)
        while not lines.ended:
            try:
                yield from reader
            except OSError:
                raise
            except Exception:  # any parsing error
                if isinstance(reader, can.ASCReader) and not reader.relative_timestamp and not self.counters.frames:
                    reader.relative_timestamp = True  # unreadable date: times are relative to the start
                    continue
                self.counters.unreadable += 1
                # a reader expects the header, which was read already
                lines.next = "timestamp\n" if self.form is LogFormat.CSV else "no internal events logged\n"


class _Lines:
    """The lines of a text, with one line that can be inserted next."""

    def __init__(self, text: io.TextIOWrapper) -> None:
        self.ended = False
        self.next: str | None = None
        self._text = text

    def __iter__(self) -> "_Lines":
        return self

    def __next__(self) -> str:
        line, self.next = self.next, None
        if line is not None:
            return line
        for line in self._text:
            return line
        self.ended = True
        raise StopIteration

    def close(self) -> None:
        self._text.close()


def _bytes(hexadecimal: str) -> bytes | None:
    """Parse up to eight bytes. None if invalid."""
    try:
        data = bytes.fromhex(hexadecimal)
    except ValueError:
        return None
    return data if len(data) <= 8 else None
