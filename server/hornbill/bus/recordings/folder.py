"""FileFolder: a folder of logs or recordings, with naming, retention limits and uploads."""

import asyncio
import errno
import logging
import re
from collections.abc import AsyncIterable, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final, TypeVar

from hornbill.bus.recordings.writer import ENDINGS
from hornbill.bus.threads import OwnThread
from hornbill.errors import InvalidValue, LogFailed, OutOfRange, Unknown

log = logging.getLogger(__name__)

_STEM: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*", re.ASCII)
_PART: Final = ".part"

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class FileKind:
    """A kind of file: its name, file extensions and limits."""

    word: str
    endings: tuple[str, ...]
    longest_name: int
    """Maximum number of characters before the extension."""
    name_hint: str
    unknown: str
    """Error code for an unknown name."""
    most: int | None = None
    """Maximum number of files retained. None for no limit."""
    most_bytes: int | None = None
    """Maximum total size of files retained, bytes. None for no limit."""
    largest: int = 100_000_000
    """Maximum size of an uploaded file, bytes."""


LOGS: Final = FileKind(
    "log", tuple(ENDINGS.values()), 80,
    "Use 1 to 80 letters, digits, dots, dashes and underscores, starting with a letter or digit.",
    "unknown_log",
)  # fmt: skip
RECORDINGS: Final = FileKind(
    "recording", (".zip",), 100,
    "Use up to 100 letters, digits, dots, dashes and underscores, starting with a letter or digit, then .zip.",
    "unknown_recording", most=50, most_bytes=500_000_000,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class StoredFile:
    """A stored file: its size in bytes, and the time of its last change in seconds since 1970 UTC."""

    path: Path
    size: int
    modified_at: float

    @property
    def name(self) -> str:
        """File name without the folder."""
        return self.path.name

    @classmethod
    def of(cls, path: Path) -> "StoredFile":
        """Current state of a file. Raises OSError."""
        status = path.stat()
        return cls(path, status.st_size, status.st_mtime)


class FileFolder:
    """Files of one kind in one data folder, which need not exist.

    Plain methods access the disk briefly; longer operations are awaited and run in a thread.
    """

    def __init__(self, folder: Path, kind: FileKind) -> None:
        self.folder = folder
        self.kind = kind
        self._thread = OwnThread(kind.word)

    def all(self) -> list[StoredFile]:
        """All files, newest first."""
        try:
            files = [file for file in self.folder.iterdir() if file.suffix in self.kind.endings and file.is_file()]
            found = [StoredFile.of(file) for file in files]
        except OSError:
            return []
        return sorted(found, key=lambda one: (one.modified_at, one.name), reverse=True)

    def path(self, name: str) -> Path:
        """Path of a file. Raises Unknown with the code of the kind."""
        path = self.folder / name
        if not self._is_name(name) or not path.is_file():
            kind = self.kind
            raise Unknown(
                kind.unknown,
                f"{kind.word.capitalize()} {name[:90]!r} not found.",
                cause="file_not_found",
                name=name[:90],
            )
        return path

    def new(self, name: str) -> Path:
        """Path of a new file. Raises InvalidValue for an invalid or existing name."""
        word, path = self.kind.word, self.folder / name
        if not self._is_name(name):
            raise InvalidValue(
                f"{name[:90]!r} is not a valid {word} name. {self.kind.name_hint}",
                requested=name[:200],
                cause="file_name_invalid",
                name=name[:90],
            )
        if _taken(path):
            raise InvalidValue(
                f"A {word} {name} exists already. Use another name, or delete it.",
                requested=name,
                cause="name_in_use",
                name=name,
            )
        return path

    def delete(self, name: str) -> None:
        """Delete a file. Raises Unknown as `path` does, and LogFailed."""
        path = self.path(name)
        try:
            path.unlink()
        except OSError as error:
            raise LogFailed(
                f"{path} cannot be deleted: {error.strerror}.", cause="delete_failed", name=str(path)
            ) from error

    def tidy(self) -> None:
        """Delete incomplete files of a killed process. Call it once, before writing."""
        for ending in self.kind.endings:
            for part in self.folder.glob(f"*{ending}{_PART}"):
                part.unlink(missing_ok=True)

    def prune(self) -> list[str]:
        """Delete the oldest files beyond the limits, but never the newest. Returns their names."""
        most, most_bytes = self.kind.most, self.kind.most_bytes
        dropped: list[str] = []
        total = 0
        for place, one in enumerate(self.all()):
            total += one.size
            too_many = most is not None and place >= most
            too_much = most_bytes is not None and total > most_bytes
            if place and (too_many or too_much):
                try:
                    one.path.unlink()
                except OSError as error:
                    log.warning("%s cannot be deleted: %s", one.name, error)
                    continue
                dropped.append(one.name)
                total -= one.size
        return dropped

    async def begin(self, name: str) -> "PartFile":
        """Create a file `name`, with a number appended if it exists. Raises LogFailed."""
        return await self.run(lambda: PartFile(self._free(name), self))

    async def adopt(self, name: str, content: AsyncIterable[bytes], accept: Callable[[Path], object]) -> list[str]:
        """Store an uploaded file. Returns the names of files deleted to stay within the limits.

        `accept` runs in a thread and raises for an invalid file. Raises InvalidValue as `new` does, OutOfRange for a
        file above the size limit, and LogFailed; then nothing is stored.
        """
        path = self.new(name)
        file = await self.run(lambda: PartFile(path, self))
        try:
            size, largest = 0, self.kind.largest
            async for piece in content:
                size += len(piece)
                if size > largest:
                    raise OutOfRange(
                        f"The file is larger than {largest // 1_000_000} MB. "
                        f"Import a shorter {self.kind.word}.",
                        maximum=largest, unit="B", requested=size,
                        cause="upload_too_large", limit_mb=largest // 1000000,
                    )  # fmt: skip
                await self.run(lambda piece=piece: file.content.write(piece))

            def end() -> list[str]:
                file.content.close()
                accept(file.part)
                return file.finish()[1]

            return await self.run(end)
        except BaseException:
            file.discard()
            raise

    async def run(self, work: Callable[[], T]) -> T:
        """Run in a thread. Raises LogFailed with a remedy instead of OSError."""
        try:
            return await asyncio.get_running_loop().run_in_executor(self._thread, work)
        except OSError as error:
            remedy = " Free space on the disk of the data folder." if error.errno == errno.ENOSPC else ""
            why = error.strerror or str(error)
            raise LogFailed(
                f"The {self.kind.word} cannot be written: {why}.{remedy}", cause="file_not_written", error=why
            ) from error

    def _is_name(self, name: str) -> bool:
        """Whether a file name is valid: no folders or special characters."""
        stem = next((name.removesuffix(ending) for ending in self.kind.endings if name.endswith(ending)), "")
        return len(stem) <= self.kind.longest_name and _STEM.fullmatch(stem) is not None

    def _free(self, name: str) -> Path:
        stem, dot, ending = name.rpartition(".")
        numbers = ("", *(f"-{number}" for number in range(2, 1000)))
        paths = (self.folder / f"{stem}{number}{dot}{ending}" for number in numbers)
        return next(path for path in paths if not _taken(path))


class PartFile:
    """A new file, written under a temporary name until complete. Blocks: use it in a thread."""

    def __init__(self, path: Path, folder: FileFolder) -> None:
        """Raises OSError."""
        self.path = path
        self.part = _part_of(path)
        self._folder = folder
        self.part.parent.mkdir(parents=True, exist_ok=True)
        self.content: IO[bytes] = self.part.open("xb")

    def finish(self) -> tuple[int, list[str]]:
        """Complete the file. Returns its size and the names of files deleted for it. Raises OSError."""
        self.content.close()
        self.part.rename(self.path)
        return self.path.stat().st_size, self._folder.prune()

    def discard(self) -> None:
        """Delete the incomplete file. Never raises."""
        try:
            self.content.close()
        except OSError as error:  # the disk may be what failed
            log.debug("%s did not close: %s", self.part, error)
        try:
            self.part.unlink(missing_ok=True)
        except OSError as error:
            log.warning("%s cannot be deleted: %s", self.part, error)


def _part_of(path: Path) -> Path:
    return path.with_name(f"{path.name}{_PART}")


def _taken(path: Path) -> bool:
    return path.exists() or _part_of(path).exists()
