"""CSV text of all tables that the server sends or stores."""

import csv
import io
from collections.abc import Iterable
from typing import Final

_FORMULA: Final = ("=", "+", "-", "@")


class Formatted(str):
    """A number or time that is already formatted; used unchanged."""

    __slots__ = ()


def csv_text(rows: Iterable[Iterable[object]], *, end: str = "\r\n") -> str:
    """Rows as CSV lines (RFC 4180), quoted if necessary. The first row of a table is its header.

    `end`: line end; telemetry and recordings use a line feed.
    """
    text = io.StringIO()
    csv.writer(text, lineterminator=end).writerows(map(cell, row) for row in rows)
    return text.getvalue()


def cell(value: object) -> str | int | float:
    """Value as a cell. Text that a spreadsheet would interpret as a formula is prefixed with ': its first character
    after white space is one of = + - @, or it starts with a tab or carriage return.
    """
    if isinstance(value, float | Formatted):
        return value
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return value
    text = str(value).encode(errors="replace").decode().replace("\0", "")
    starts = text.lstrip()[:1] in _FORMULA or text[:1] in ("\t", "\r")
    return f"'{text}" if text and starts else text
