"""Why a database cannot be opened or used, in a sentence with a remedy."""

import sqlite3
from dataclasses import dataclass
from typing import Final

from hornbill.errors import StoreFailed


@dataclass(frozen=True, slots=True)
class _Reason:
    """A kind of failure. `retry`: whether the same may succeed later without a correction."""

    code: str
    remedy: str
    retry: bool = False


_DAMAGED: Final = _Reason("damaged", "The file is damaged. Restore a backup, or move it out of the data folder.")
_BY_SQLITE_ERROR: Final = {
    sqlite3.SQLITE_NOTADB: _DAMAGED,
    sqlite3.SQLITE_CORRUPT: _DAMAGED,
    sqlite3.SQLITE_BUSY: _Reason("locked", "Another process is using it. End that process, or try again later.", True),
    sqlite3.SQLITE_FULL: _Reason("full", "Free disk space."),
}
_FILE: Final = _Reason(
    "unusable", "Check that the data folder is writable, has free space and is not damaged, or choose another."
)
_SERVER: Final = _Reason(
    "unreachable", "Check that the database server runs and permits access, or specify a folder.", True
)
_BY_SQLSTATE: Final = {
    "28": _Reason("denied", "Correct the user and password of the database address."),
    "3D": _Reason("denied", "Create the database, or correct its name in the address."),
    "42": _Reason("denied", "Check that the database belongs to hornbill and its user may create tables."),
}
"""By the class of PostgreSQL's error code: authorization, name of the database, privileges and names."""


def failed(address: str, error: Exception, *, is_file: bool) -> StoreFailed:
    """The failure of a database at `address` (without its password) as StoreFailed."""
    origin = getattr(error, "orig", None) or error
    if is_file:
        # the low byte is the primary result code
        number = getattr(origin, "sqlite_errorcode", -1)
        reason = _BY_SQLITE_ERROR.get(number & 0xFF if number >= 0 else -1, _FILE)
    else:
        reason = _BY_SQLSTATE.get((getattr(origin, "sqlstate", None) or "")[:2], _SERVER)
    return StoreFailed(
        f"{address} cannot be used: {_sentence(str(origin))} {reason.remedy}",
        cause="store_unusable", reason=reason.code, retry=reason.retry,
    )  # fmt: skip


def driver_missing(address: str, package: str) -> StoreFailed:
    """The Python package of a database is not installed."""
    return StoreFailed(
        f"{address} cannot be used: the Python package {package} is not installed. Install it, or specify a folder.",
        cause="store_unusable", reason="driver", retry=False,
    )  # fmt: skip


def newer(address: str, revision: str) -> StoreFailed:
    """The tables are of a newer hornbill."""
    return StoreFailed(
        f"{address} was written by a newer hornbill (tables {revision}). Install that version, or choose another data "
        "folder.", cause="store_newer", reason="newer", retry=False,
    )  # fmt: skip


def damaged(address: str, why: str) -> StoreFailed:
    """A file whose content is inconsistent."""
    text = f"{address} cannot be used: {_sentence(why)} {_DAMAGED.remedy}"
    return StoreFailed(text, cause="store_unusable", reason=_DAMAGED.code, retry=False)


def _sentence(text: str) -> str:
    """The text of a driver in one line, with a full stop or question mark."""
    line = " ".join(text.split())
    return line if line.endswith((".", "?")) else f"{line}."
