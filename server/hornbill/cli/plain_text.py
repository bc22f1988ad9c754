"""Text encoding of files and pipes, independent of the system.

On Linux and macOS text is UTF-8. On Windows, redirected output uses a code page that lacks arrows and Japanese
labels, editors write a byte order mark, and `>` of older PowerShell versions writes UTF-16.
"""

import io
import os
import sys
from pathlib import Path

from hornbill.errors import InvalidValue


def configure_output() -> None:
    """Write redirected output as UTF-8 unless configured otherwise, and replace characters that cannot be encoded."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            keep = sys.platform != "win32" or stream.isatty() or "PYTHONIOENCODING" in os.environ
            stream.reconfigure(encoding=stream.encoding if keep else "utf-8", errors="replace")


def text_of(file: Path) -> str:
    """Content of a text file: UTF-8, or UTF-16 with a byte order mark. Raises InvalidValue for other encodings."""
    data = file.read_bytes()
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        return data.decode(encoding).replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise InvalidValue(
            f"{file.name} is not UTF-8: byte {error.start} is {data[error.start]:#04x}. Save the file as UTF-8.",
            cause=None,
        ) from None
