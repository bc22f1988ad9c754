"""LogWriter: a log of frames being written, as candump, ASC, BLF or CSV, through python-can's writers."""

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
    """The four forms of a recording."""

    CANDUMP = "candump"
    ASC = "asc"
    BLF = "blf"
    CSV = "csv"


ENDINGS: Final = {LogFormat.CANDUMP: ".log", LogFormat.ASC: ".asc", LogFormat.BLF: ".blf", LogFormat.CSV: ".csv"}

_LONGEST: Final = 160
"""Bytes that one more frame, and closing the file, take at most in any form."""


_CANDUMP: Final = "(%f) %s %08X#%s %s\n"


class LogWriter:
    """A new file that takes frames until it is full or closed. It blocks on the disk: not for the event loop.

    `size` is in bytes and never grows above the limit; what BLF has not packed yet counts as it is. Times are
    UTC, but ASC says when it begins in local time, as the form has it. CSV cannot tell sent from received.
    """

    def __init__(self, path: Path, form: LogFormat, limit: int) -> None:
        """Raises LogFailed when the file exists already or cannot be made. `limit` is in bytes."""
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
        """Bytes so far; of a closed file, what it takes on the disk."""
        if self._closed_size is not None:
            return self._closed_size
        return self._writer.file_size() if self._text is None else self._text.size

    def write(self, batch: Iterable[LoggedFrame]) -> bool:
        """Write frames, and let the disk have them; false as soon as one has no room. Raises OSError."""
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
        """Finish the file. Raises OSError; the file is closed all the same."""
        before = self.size
        try:
            self._writer.stop()
        finally:
            self._closed_size = before
            self._writer.file.close()
        self._closed_size = self._path.stat().st_size


def candump(frames: Iterable[LoggedFrame]) -> str:
    """Frames as lines of `candump -l`, the last word T for those we sent; times in seconds since 1970 UTC.

    The lines are those of python-can's writer, which takes three times as long, while the event loop waits.
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
    """A text file that knows how many bytes were written to it; asking the disk each time would be slow."""

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
    """The line that says when the recording begins: a whole second before the first frame.

    python-can would write 7 ms as `.7`, which readers, its own included, take for 700.
    """
    writer.started = writer.last_timestamp = float(int(first) - 1)
    begin = datetime.fromtimestamp(writer.started)  # noqa: DTZ006 - local time, as ASC has it
    writer.file.write(f"Begin Triggerblock {begin:%a %b %d %H:%M:%S.000 %Y}\n")
    writer.header_written = True
    writer.log_event("Start of measurement", writer.started)
