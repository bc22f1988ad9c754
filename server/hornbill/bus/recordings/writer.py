"""LogWriter: writes a log in candump, ASC, BLF or CSV format with python-can's writers."""

import io
from collections.abc import Iterable
from datetime import datetime
from enum import StrEnum
from functools import lru_cache
from pathlib import Path
from typing import Final

import can

from hornbill.errors import LogFailed
from hornbill.wire.frame import LoggedFrame


class LogFormat(StrEnum):
    """Formats of a log."""

    CANDUMP = "candump"
    ASC = "asc"
    BLF = "blf"
    CSV = "csv"


ENDINGS: Final = {LogFormat.CANDUMP: ".log", LogFormat.ASC: ".asc", LogFormat.BLF: ".blf", LogFormat.CSV: ".csv"}

_LONGEST: Final = 160
"""Maximum number of bytes for another frame and closing the file, in any format."""


_CANDUMP: Final = "(%f) %s %08X#%s %s\n"


class LogWriter:
    """A new log file, until full or closed. Blocks on the disk, so do not use it on the event loop.

    `size` is in bytes and never exceeds the limit; data not yet compressed by BLF counts uncompressed. Times are UTC,
    except that ASC has its start in local time. CSV does not distinguish sent from received frames.
    """

    def __init__(self, path: Path, form: LogFormat, limit: int) -> None:
        """Raises LogFailed if the file exists or cannot be created. `limit` is in bytes."""
        self.frames = 0
        self._path = path
        self._limit = limit
        self._closed_size: int | None = None
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            file = path.open("xb")
        except OSError as error:
            raise LogFailed(
                f"{path} cannot be written: {error.strerror}.", cause="log_not_written", name=str(path)
            ) from error
        self._text = None if form is LogFormat.BLF else _CountedText(file)
        self._writer = _writer(form, file, self._text)

    @property
    def size(self) -> int:
        """Bytes written so far. For a closed file, its size on disk."""
        if self._closed_size is not None:
            return self._closed_size
        return self._writer.file_size() if self._text is None else self._text.size

    def write(self, batch: Iterable[LoggedFrame]) -> bool:
        """Write and flush frames. False as soon as one exceeds the limit. Raises OSError."""
        for logged in batch:
            if self.size + _LONGEST > self._limit:
                return False
            if not self.frames and isinstance(self._writer, can.ASCWriter):
                _begin_asc(self._writer, logged.frame.at)
            self._writer.on_message_received(_message(logged))
            self.frames += 1
        if self._text is not None:
            self._text.flush()
        return True

    def close(self) -> None:
        """Complete and close the file. Raises OSError, but closes it anyway."""
        before = self.size
        try:
            self._writer.stop()
        finally:
            self._closed_size = before
            self._writer.file.close()
        self._closed_size = self._path.stat().st_size


def candump(frames: Iterable[LoggedFrame]) -> str:
    """Frames as lines of `candump -l`, ending with T for sent frames. Times in seconds since 1970 UTC.

    Same output as python-can's writer, which takes three times as long and would block the event loop.
    """
    words = [
        word
        for (can_id, data, at), channel, sent in frames
        for word in (at, _interface(channel), can_id, data.hex().upper(), "T" if sent else "R")
    ]
    return _CANDUMP * (len(words) // 5) % tuple(words)


@lru_cache(maxsize=16)
def _interface(channel: str) -> str:
    return f"can{channel}" if channel.isdigit() else channel


class _CountedText(io.TextIOWrapper):
    """A text file that counts the bytes written, because querying the disk each time would be slow."""

    def __init__(self, file: io.BufferedWriter) -> None:
        super().__init__(file, encoding="ascii", errors="replace", newline="\n")
        self.size = 0

    def write(self, s: str, /) -> int:
        self.size += len(s)
        return super().write(s)


def _message(logged: LoggedFrame) -> can.Message:
    frame, channel, sent = logged
    return can.Message(
        timestamp=frame.at,
        arbitration_id=frame.id,
        is_extended_id=True,
        data=frame.data,
        channel=channel,
        is_rx=not sent,
    )


def _writer(
    form: LogFormat, file: io.BufferedWriter, text: io.TextIOWrapper | None
) -> can.CanutilsLogWriter | can.ASCWriter | can.CSVWriter | can.BLFWriter:
    if text is None:
        return can.BLFWriter(file)
    match form:
        case LogFormat.ASC:
            return can.ASCWriter(text)
        case LogFormat.CSV:
            return can.CSVWriter(text)
        case _:
            return can.CanutilsLogWriter(text)


def _begin_asc(writer: can.ASCWriter, first: float) -> None:
    """Write the start time: a whole second before the first frame.

    python-can would write 7 ms as `.7`, which readers, including its own, interpret as 700 ms.
    """
    writer.started = writer.last_timestamp = float(int(first) - 1)
    begin = datetime.fromtimestamp(writer.started)  # noqa: DTZ006 - local time, as ASC has it
    writer.file.write(f"Begin Triggerblock {begin:%a %b %d %H:%M:%S.000 %Y}\n")
    writer.header_written = True
    writer.log_event("Start of measurement", writer.started)
