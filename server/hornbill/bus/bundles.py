"""Owns BundleFolder: the bundles on the disk: written aside and then named, listed, checked, opened, kept few."""

import asyncio
import errno
import logging
import re
import zipfile
import zlib
from collections.abc import AsyncIterable, Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final, TypeVar

from hornbill.bus.recording import Recording
from hornbill.bus.threads import OwnThread
from hornbill.errors import InvalidValue, LogFailed, OutOfRange, Unknown

log = logging.getLogger(__name__)

MOST_BUNDLES: Final = 50
MOST_BYTES: Final = 500_000_000
UPLOAD_BYTES: Final = 100_000_000

FRAMES: Final = "frames.log"
ABOUT: Final = "about.json"
MEMBERS: Final = {
    "README.txt": 1 << 16, ABOUT: 16 << 20, FRAMES: 320 << 20, "telemetry.csv": 64 << 20, "events.jsonl": 16 << 20,
    "writes.csv": 32 << 20,
}  # fmt: skip
"""What a bundle holds, and how many bytes each may unpack to; nothing else may be in one."""

LONGEST_LINE: Final = 4096
"""Bytes of a line of frames: so that nobody's file makes us hold all of it as one."""

_STEM: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}", re.ASCII)
_ENDING: Final = ".zip"
_PART: Final = ".part"
_PIECE: Final = 1 << 18

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class KeptBundle:
    """A file of the folder: bytes, and when it was last written in seconds since 1970 UTC."""

    name: str
    size: int
    modified_at: float


class BundleFolder:
    """The bundles of one data folder. What touches the disk for longer than a moment runs in a thread."""

    def __init__(self, folder: Path, *, most: int = MOST_BUNDLES, most_bytes: int = MOST_BYTES) -> None:
        """At most `most` bundles of together `most_bytes` are kept; the newest always is."""
        self.folder = folder
        self._most = most
        self._most_bytes = most_bytes
        self._abouts: dict[KeptBundle, bytes] = {}

    async def begin(self, name: str) -> "BundleFile":
        """A new bundle called `name`, with a number behind it when that is taken. Raises LogFailed."""
        thread = OwnThread("bundle")
        return await _in(thread, lambda: BundleFile(self._free(name), thread, self.prune))

    def all(self) -> list[KeptBundle]:
        """Every bundle, the newest first."""
        try:
            files = [file for file in self.folder.iterdir() if file.suffix == _ENDING and file.is_file()]
            found = [KeptBundle(file.name, file.stat().st_size, file.stat().st_mtime) for file in files]
        except OSError:
            return []
        return sorted(found, key=lambda one: (one.modified_at, one.name), reverse=True)

    def about(self, kept: KeptBundle) -> bytes:
        """Its about.json, read from the disk once while the file stays as it is. Raises LogFailed."""
        found = self._abouts.get(kept)
        if found is None:
            found = self._abouts[kept] = member(self.folder / kept.name, ABOUT)
            while len(self._abouts) > self._most:
                self._abouts.pop(next(iter(self._abouts)))
        return found

    def tidy(self) -> None:
        """Delete what a process that was killed did not finish; call it once, before anything is written."""
        for part in self.folder.glob(f"*{_ENDING}{_PART}"):
            part.unlink(missing_ok=True)

    def path(self, name: str) -> Path:
        """Where a bundle is. Raises Unknown(unknown_bundle)."""
        path = self.folder / name
        if not is_name(name) or not path.is_file():
            raise Unknown(
                "unknown_bundle", f"There is no bundle {name[:90]!r}. GET /api/v1/recorder/bundles lists them."
            )
        return path

    def delete(self, name: str) -> None:
        """Remove a bundle. Raises Unknown(unknown_bundle), LogFailed."""
        path = self.path(name)
        try:
            path.unlink()
        except OSError as error:
            raise LogFailed(f"{path} cannot be deleted: {error.strerror}.") from error

    def prune(self) -> list[str]:
        """Delete the oldest bundles beyond the limits; their names."""
        dropped: list[str] = []
        total = 0
        for place, one in enumerate(self.all()):
            total += one.size
            if place and (place >= self._most or total > self._most_bytes):
                try:
                    (self.folder / one.name).unlink()
                except OSError as error:
                    log.warning("%s cannot be deleted: %s", one.name, error)
                    continue
                dropped.append(one.name)
                total -= one.size
        return dropped

    async def adopt(self, name: str, content: AsyncIterable[bytes], accept: Callable[[Path], object]) -> list[str]:
        """Keep a bundle that somebody sends; names of those dropped for it.

        `accept` raises LogFailed, in a thread, for a file that is none. Raises InvalidValue for what cannot be a
        name or is taken, OutOfRange beyond 100 MB, and LogFailed; then nothing is kept.
        """
        if not is_name(name):
            raise InvalidValue(
                f"{name[:90]!r} cannot be the name of a bundle. Give up to 100 letters, digits, dots, dashes and "
                "underscores, a letter or digit first, and .zip at the end.",
                requested=name[:200],
            )
        path, part = self.folder / name, self.folder / f"{name}{_PART}"
        thread = OwnThread("bundle")
        if path.exists() or part.exists():
            raise InvalidValue(f"There is a bundle {name} already. Give another name, or delete it.", requested=name)
        file = await _in(thread, lambda: _create(part))
        try:
            size = 0
            async for piece in content:
                size += len(piece)
                if size > UPLOAD_BYTES:
                    raise OutOfRange(
                        f"The file is larger than {UPLOAD_BYTES // 1_000_000} MB. Give a bundle of a shorter time.",
                        maximum=UPLOAD_BYTES, unit="B", requested=size,
                    )  # fmt: skip
                await _in(thread, lambda piece=piece: file.write(piece))

            def end() -> list[str]:
                file.close()
                accept(part)
                part.rename(path)
                return self.prune()

            return await _in(thread, end)
        except BaseException:
            file.close()
            part.unlink(missing_ok=True)
            raise

    def _free(self, name: str) -> Path:
        stem = name.removesuffix(_ENDING)
        names = (self.folder / f"{stem}{f'-{number}' if number else ''}{_ENDING}" for number in (0, *range(2, 1000)))
        return next(path for path in names if not path.exists() and not path.with_name(f"{path.name}{_PART}").exists())


class BundleFile:
    """A bundle being written, piece by piece; it has its name once it is complete. Packing is done in a thread."""

    def __init__(self, path: Path, thread: Executor, prune: Callable[[], list[str]]) -> None:
        """In the thread. Raises LogFailed."""
        self.name = path.name
        self._path = path
        self._part = path.with_name(f"{path.name}{_PART}")
        self._thread = thread
        self._prune = prune
        self._file = _create(self._part)
        self._zip = zipfile.ZipFile(self._file, "w", zipfile.ZIP_DEFLATED, compresslevel=4)
        self._member: IO[bytes] | None = None
        self._of = ""
        self._room = 0
        self.cut: list[str] = []
        """Members that reached the most bytes they may have, and are not complete."""

    async def put(self, member: str, data: bytes) -> bool:
        """More of a member, one after the other; false when it has no room for this. Raises LogFailed."""
        if member != self._of:
            self._room = MEMBERS[member]
        self._room -= len(data)
        if self._room < 0:
            if member not in self.cut:
                self.cut.append(member)
            self._room = 0
            return False
        await _in(self._thread, lambda: self._put(member, data))
        return True

    async def finish(self) -> tuple[int, list[str]]:
        """Give it its name. The bytes it takes, and the names of the bundles dropped for it. Raises LogFailed."""
        return await _in(self._thread, self._finish)

    async def discard(self) -> None:
        """Leave nothing behind. Never raises."""
        await _in(self._thread, self._discard)

    def _put(self, member: str, data: bytes) -> None:
        if member != self._of:
            self._end_member()
            self._of = member
            self._member = self._zip.open(member, "w", force_zip64=True)
        assert self._member is not None
        self._member.write(data)

    def _end_member(self) -> None:
        member, self._member = self._member, None
        if member is not None:
            member.close()

    def _finish(self) -> tuple[int, list[str]]:
        self._end_member()
        self._zip.close()
        self._file.close()
        self._part.rename(self._path)
        return self._path.stat().st_size, self._prune()

    def _discard(self) -> None:
        for close in (self._end_member, self._zip.close, self._file.close):
            try:
                close()
            except Exception as error:  # the disk may be what failed
                log.debug("a bundle that failed did not close either: %s", error)
        try:
            self._part.unlink(missing_ok=True)
        except OSError as error:
            log.warning("%s cannot be deleted: %s", self._part, error)


def is_name(name: str) -> bool:
    """Whether a bundle may be called so: no folder, no odd sign."""
    return name.endswith(_ENDING) and _STEM.fullmatch(name.removesuffix(_ENDING)) is not None


def check(path: Path) -> None:
    """Unpack all of a bundle once without keeping it, in a thread: what it says of itself may be wrong.

    Raises LogFailed for a file that is none, is damaged, or unpacks to more than a bundle may.
    """
    with _opened(path) as bundle:
        for member in bundle.namelist():
            try:
                _walk(bundle, member, path.name)
            except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError, OSError) as error:
                raise LogFailed(f"{path.name} is damaged: {member} cannot be unpacked ({error}).") from error


def member(path: Path, name: str) -> bytes:
    """A member as it was written; empty when there is none. Reads the disk. Raises LogFailed."""
    with _opened(path) as bundle:
        if name not in bundle.namelist():
            return b""
        try:
            with bundle.open(name) as file:
                return file.read(MEMBERS[name] + 1)
        except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError, OSError) as error:
            raise LogFailed(f"{path.name} is damaged: {name} cannot be unpacked ({error}).") from error


def recording(path: Path) -> Recording:
    """The frames of a bundle, to be played. Reads all of it, in a thread. Raises LogFailed."""
    check(path)
    with _opened(path) as bundle:
        file = bundle.open(FRAMES)  # it stays open on its own
    return Recording(file, path.name)  # pyright: ignore[reportArgumentType] - peek and read are all that is used


def _walk(bundle: zipfile.ZipFile, member: str, name: str) -> None:
    line = 0
    with bundle.open(member) as file:
        while piece := file.read(_PIECE):
            if member != FRAMES:
                continue
            parts = piece.split(b"\n")
            line += len(parts[0])
            if max(line, *map(len, parts)) > LONGEST_LINE:
                raise LogFailed(f"{name} is no bundle of hornbill: its {FRAMES} is not made of lines.")
            line = len(parts[-1]) if len(parts) > 1 else line


def _opened(path: Path) -> zipfile.ZipFile:
    """The archive, with nothing in it but what a bundle holds, once each, and not too much. Raises LogFailed."""
    try:
        bundle = zipfile.ZipFile(path)
    except OSError as error:
        raise LogFailed(f"{path} cannot be read: {error.strerror}. Check its name and your permission.") from error
    except (zipfile.BadZipFile, ValueError, NotImplementedError, EOFError) as error:
        raise LogFailed(f"{path.name} is no bundle of hornbill: {error}. Give a .zip that hornbill wrote.") from error
    names = [info.filename for info in bundle.infolist()]
    why = None
    if len(set(names)) < len(names) or not set(names) <= MEMBERS.keys():
        why = "it holds other files than a bundle does"
    elif not {ABOUT, FRAMES} <= set(names):
        why = f"it holds no {ABOUT} or no {FRAMES}"
    else:
        big = next((info.filename for info in bundle.infolist() if info.file_size > MEMBERS[info.filename]), None)
        if big is not None:
            why = f"its {big} unpacks to more than {MEMBERS[big] >> 20} MiB"
    if why is not None:
        bundle.close()
        raise LogFailed(f"{path.name} is no bundle of hornbill: {why}. Give a .zip that hornbill wrote.")
    return bundle


def _create(path: Path) -> IO[bytes]:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path.open("xb")


async def _in(thread: Executor, work: Callable[[], T]) -> T:
    """Run in the thread. Raises LogFailed in place of OSError, with the remedy."""
    try:
        return await asyncio.get_running_loop().run_in_executor(thread, work)
    except OSError as error:
        remedy = " Make room on the disk of the data folder." if error.errno == errno.ENOSPC else ""
        raise LogFailed(f"The bundle cannot be written: {error.strerror or error}.{remedy}") from error
