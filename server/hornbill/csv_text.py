"""CSV text: the one form of every table that the server sends or packs."""

import csv
import io
from collections.abc import Iterable
from typing import Final

_FORMULA: Final = ("=", "+", "-", "@")


class Formatted(str):
    """A number or an instant with a format of its own; passes as it is."""

    __slots__ = ()


def csv_text(rows: Iterable[Iterable[object]], *, end: str = "\r\n") -> str:
    """Rows as lines of CSV (RFC 4180), quoted where needed. The first row of a table is its header.

    `end` is the line end: telemetry and recordings have a plain line feed.
    """
    text = io.StringIO()
    csv.writer(text, lineterminator=end).writerows(map(cell, row) for row in rows)
    return text.getvalue()


def cell(value: object) -> str | int | float:
    """A value as a cell. A text that a spreadsheet would take for a formula has a ' before it: its first character
    after white space is one of = + - @, or it starts with a tab or a carriage return.
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
