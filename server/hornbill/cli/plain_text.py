"""Text that crosses into files and pipes: another system's way of encoding breaks none of it.

On Linux and macOS all of it is UTF-8 anyway. A redirected output of Windows is of its code page, which has neither
an arrow nor a label in Japanese; its editors begin a file with a mark, and an older PowerShell's `>` writes UTF-16.
"""

import io
import os
import sys
from pathlib import Path

from hornbill.errors import InvalidValue


def speak() -> None:
    """Have nothing that is printed be an error for its letters, and a redirected output be UTF-8 unless told."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            told = sys.platform != "win32" or stream.isatty() or "PYTHONIOENCODING" in os.environ
            stream.reconfigure(encoding=stream.encoding if told else "utf-8", errors="replace")


def text_of(file: Path) -> str:
    """What a text file holds: UTF-8 with or without a mark, or UTF-16 with one. Raises InvalidValue for another."""
    data = file.read_bytes()
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        return data.decode(encoding).replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise InvalidValue(
            f"{file.name} is no text in UTF-8: byte {error.start} is {data[error.start]:#04x}. Save it as UTF-8.",
            cause=None,
        ) from None
