"""Recording: the frames of a candump, ASC, BLF or CSV file, read one at a time, from a file or a live pipe.

candump's form is read without python-can's reader: that one takes most error frames for data, and ends at the first
line that was cut short.
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

_BEGINNINGS: Final = {
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
    """What was read so far. `ignored` are standard, remote and FD frames, `unreadable` lines that are no frame."""

    frames: int = 0
    ignored: int = 0
    error_frames: int = 0
    unreadable: int = 0


class LogReader:
    """An iterable of LoggedFrame in the order of the file; only what is being looked at is in memory.

    Which of the four forms it has is seen from its first bytes, so that the name does not matter.
    """

    def __init__(self, file: io.BufferedReader, name: str) -> None:
        """`file` is this object's from now on, `name` is what to call it. Raises LogFailed when it is no log."""
        self.name = name
        self.counters = LogCounters()
        self.about: About | None = None
        """What it is of; None for a plain log."""
        self._file = file
        try:
            beginning = file.peek(16).removeprefix(b"\xef\xbb\xbf").lstrip().lower()
        except OSError as error:
            file.close()
            raise LogFailed(f"{name} cannot be read: {error.strerror}.", cause="file_unreadable", name=name) from error
        form = next((form for start, form in _BEGINNINGS.items() if beginning.startswith(start.lower())), None)
        if form is None and beginning:
            file.close()
            raise LogFailed(
                f"{name} is no log of frames that is known here. Give what candump -l or candump -L wrote, an ASC or a "
                "BLF file, or a CSV file of hornbill or python-can.",
                cause="log_format_unknown",
                name=name,
            )
        self.form = form or LogFormat.CANDUMP  # of an empty file or a pipe that ended, all are the same
        self._text = io.TextIOWrapper(file, "utf-8-sig", errors="replace")  # nothing is read before it is asked to

    @classmethod
    def open(cls, path: Path) -> "LogReader":
        """The recording in a file. Raises LogFailed with the reason and the remedy."""
        try:
            file = path.open("rb")
        except OSError as error:
            raise LogFailed(
                f"{path} cannot be read: {error.strerror}. Check its name and your permission.",
                cause="file_unreadable",
                name=str(path),
            ) from error
        except ValueError as error:
            raise LogFailed(
                f"{str(path)!r} is no name of a file: {error}.", cause="file_name_invalid", name=str(path)[:90]
            ) from error
        return cls(file, str(path))

    def __iter__(self) -> Iterator[LoggedFrame]:
        """To be walked through once. Raises LogFailed when the disk fails, or a BLF file is damaged."""
        found = self._candump() if self.form is LogFormat.CANDUMP else self._through_python_can()
        try:
            yield from found
        except OSError as error:
            raise LogFailed(
                f"{self.name} cannot be read on: {error.strerror or error}.", cause="file_unreadable", name=self.name
            ) from error
        except Exception as error:
            read = self.counters.frames
            raise LogFailed(
                f"{self.name} is damaged: nothing can be read after {read} frames.",
                cause="log_damaged",
                name=self.name,
                frames=read,
            ) from error

    def close(self) -> None:
        """Close the file. Twice is harmless."""
        self._text.close()

    def _candump(self) -> Iterator[LoggedFrame]:
        """Lines such as `(1436509052.249713) can0 1003F30B#0102 R`; the last word is optional."""
        counters, line_of = self.counters, _CANDUMP_LINE.fullmatch
        for line in self._text:
            found = line_of(line)
            if found is None:
                counters.unreadable += bool(line.strip())
                continue
            stamp, channel, can_id, hexadecimal, way = found.groups()
            number = int(can_id, 16)
            if len(can_id) == 8 and number & _ERROR_FLAG:
                counters.error_frames += 1
            elif len(can_id) == 3 or hexadecimal[:1] in ("#", "R", "r"):
                counters.ignored += 1
            elif (data := _bytes(hexadecimal)) is None or number > _LAST_IDENTIFIER:
                counters.unreadable += 1
            else:
                counters.frames += 1
                yield LoggedFrame(Frame(number, data, float(stamp)), channel, way in ("T", "t"))

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
        """What python-can's reader finds; in a text, a line it chokes on is counted and the next one is read."""
        if self.form is LogFormat.BLF:
            yield from can.BLFReader(self._file)
            return
        lines = _Lines(self._text)
        text = cast(Any, lines)  # all the readers do is iterate and close
        reader = can.CSVReader(text) if self.form is LogFormat.CSV else can.ASCReader(text, relative_timestamp=False)
        while not lines.ended:
            try:
                yield from reader
            except OSError:
                raise
            except Exception:  # whatever its parsing met
                if isinstance(reader, can.ASCReader) and not reader.relative_timestamp and not self.counters.frames:
                    reader.relative_timestamp = True  # a date it cannot read: times count from the start
                    continue
                self.counters.unreadable += 1
                # a reader begins with the header, which is past
                lines.next = "timestamp\n" if self.form is LogFormat.CSV else "no internal events logged\n"


class _Lines:
    """The lines of a text, one of which may be put in front of what is still to come."""

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
    """Up to eight bytes; None for what is not."""
    try:
        data = bytes.fromhex(hexadecimal)
    except ValueError:
        return None
    return data if len(data) <= 8 else None
