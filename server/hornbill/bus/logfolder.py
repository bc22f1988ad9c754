"""Owns LogFolder: the folder of logs: which names they may have, and listing, finding and deleting them."""

import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from hornbill.bus.logfile import ENDINGS, LogFormat
from hornbill.errors import InvalidValue, LogFailed, Unknown

_STEM: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,79}", re.ASCII)


@dataclass(frozen=True, slots=True)
class KeptLog:
    """A file of the folder: bytes, and when it was last written in seconds since 1970 UTC."""

    name: str
    size: int
    modified_at: float


class LogFolder:
    """The logs of one data folder. Its methods touch the disk, if only for a moment; the folder need not exist."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def new(self, form: LogFormat, name: str | None) -> Path:
        """Where a new log goes; `name` is without ending, the time of now (UTC) unless given.

        Raises InvalidValue for what cannot be a name, and for one that is taken.
        """
        ending = ENDINGS[form]
        stem = f"{datetime.now(UTC):%Y-%m-%dT%H-%M-%SZ}" if name is None else name.strip().removesuffix(ending)
        if not _STEM.fullmatch(stem):
            raise InvalidValue(
                f"{stem[:90]!r} cannot be the name of a log. Give 1 to 80 letters, digits, dots, dashes and "
                "underscores, a letter or digit first.",
                requested=name,
            )
        path = self.folder / f"{stem}{ending}"
        if path.exists():
            raise InvalidValue(f"There is a log {path.name} already. Give another name, or delete it.", requested=name)
        return path

    def path(self, name: str) -> Path:
        """Where a log is. Raises Unknown(unknown_log)."""
        path = self.folder / name
        if not _STEM.fullmatch(path.stem) or path.name != name or path.suffix not in ENDINGS.values():
            raise _unknown(name)
        if not path.is_file():
            raise _unknown(name)
        return path

    def all(self) -> list[KeptLog]:
        """Every log, the newest first."""
        try:
            files = [file for file in self.folder.iterdir() if file.suffix in ENDINGS.values() and file.is_file()]
            found = [KeptLog(file.name, file.stat().st_size, file.stat().st_mtime) for file in files]
        except OSError:
            return []
        return sorted(found, key=lambda one: (one.modified_at, one.name), reverse=True)

    def delete(self, name: str) -> None:
        """Remove a log. Raises Unknown(unknown_log), LogFailed."""
        path = self.path(name)
        try:
            path.unlink()
        except OSError as error:
            raise LogFailed(f"{path} cannot be deleted: {error.strerror}.") from error


def _unknown(name: str) -> Unknown:
    return Unknown("unknown_log", f"There is no log {name[:90]!r}. GET /api/v1/bus/logs lists them.")
