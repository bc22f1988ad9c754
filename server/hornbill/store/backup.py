"""Backup of a data folder in one zip file: the SQLite database, logs and recordings; and its restoration."""

import json
import shutil
import sqlite3
import tempfile
import time
import zipfile
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from hornbill import __version__
from hornbill.errors import Conflict, InvalidValue, StoreFailed
from hornbill.store.copies import beside, copy_file
from hornbill.store.data_folder import FILE_NAME, FOLDERS, create_private, prepare
from hornbill.store.inspection import inspect

MANIFEST: Final = "backup.json"
FORMAT: Final = 1
"""Format of the file. A newer one is refused."""
_UNUSED_TIMEOUT_S: Final = 0.2


@dataclass(frozen=True, slots=True)
class Backup:
    """Content of a backup."""

    version: str
    """Version of hornbill that made it."""
    created_at: float
    """Seconds since 1970 UTC."""
    files: int
    """Number of logs and recordings."""
    size: int
    """Size before compression, bytes."""
    previous: Path | None = None
    """After restoring: where the previous database is. None if there was none."""


def back_up(folder: Path, file: Path) -> Backup:
    """Write a backup of the data folder to the new `file`, mode 0600; also while a server runs.

    Raises StoreFailed, and Conflict if the file exists.
    """
    found = inspect(folder)
    if found.revision is None:
        raise StoreFailed(
            f"{folder} has no database. Specify the data folder of the server.", cause=None, reason="data_folder",
            retry=False,
        )  # fmt: skip
    if file.exists():
        raise Conflict(f"{file} exists. Choose another name, or remove it first.", cause=None)
    files = [one for name in FOLDERS for one in sorted((folder / name).glob("*")) if one.is_file()]
    unfinished = file.with_name(file.name + ".part")
    try:
        with tempfile.TemporaryDirectory(dir=file.parent, prefix=".hornbill-backup-") as place:
            copy = Path(place) / FILE_NAME
            copy_file(folder / FILE_NAME, copy)
            size = sum(one.stat().st_size for one in (copy, *files))
            made = Backup(__version__, time.time(), len(files), size)
            create_private(unfinished)
            with zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED) as archive:
                about = {"format": FORMAT, "version": made.version, "created_at": made.created_at, "size": size}
                archive.writestr(MANIFEST, json.dumps(about))
                archive.write(copy, FILE_NAME)
                for one in files:
                    archive.write(one, one.relative_to(folder).as_posix())
        unfinished.rename(file)
    except (OSError, sqlite3.Error) as error:
        unfinished.unlink(missing_ok=True)
        raise StoreFailed(
            f"The backup {file} cannot be written: {error}. Check the folder and its free space.", cause=None,
            reason="backup", retry=False,
        ) from error  # fmt: skip
    return made


def restore(file: Path, folder: Path) -> Backup:
    """Restore a backup into a data folder that no server uses. Files that are not in the backup stay.

    The previous database is renamed. Everything is checked before anything changes. Raises InvalidValue for a file that
    is not a backup, and StoreFailed.
    """
    prepare(folder)
    try:
        with (
            zipfile.ZipFile(file) as archive,
            tempfile.TemporaryDirectory(dir=folder, prefix=f"{FILE_NAME}.restoring-") as place,
        ):
            found = _manifest(file, archive)
            archive.extractall(place)
            inspect(Path(place))
            previous = _move_away(folder)
            (Path(place) / FILE_NAME).replace(folder / FILE_NAME)
            for name in FOLDERS:
                for one in sorted((Path(place) / name).glob("*")):
                    (folder / name).mkdir(mode=0o700, exist_ok=True)
                    shutil.move(one, folder / name / one.name)
    except (OSError, zipfile.BadZipFile, EOFError) as error:
        raise InvalidValue(
            f"{file} cannot be restored: {error}. Choose a file of 'hornbill backup'.", cause=None
        ) from None
    prepare(folder)
    return Backup(found["version"], found["created_at"], len(archive.namelist()) - 2, found["size"], previous)


def _manifest(file: Path, archive: zipfile.ZipFile) -> dict[str, Any]:
    """Manifest of a backup. Raises InvalidValue if it is not one, is damaged, or is of a newer hornbill."""
    names = archive.namelist()
    known = all(one in (MANIFEST, FILE_NAME) or _is_plain(one) for one in names)
    if not known or MANIFEST not in names or FILE_NAME not in names:
        raise InvalidValue(f"{file} is not a backup of hornbill. Choose a file of 'hornbill backup'.", cause=None)
    damaged = archive.testzip()
    if damaged is not None:
        raise InvalidValue(f"{file} is damaged at {damaged}. Choose another backup.", cause=None)
    found = json.loads(archive.read(MANIFEST))
    if found["format"] > FORMAT:
        raise InvalidValue(f"{file} was made by hornbill {found['version']}. Install that version.", cause=None)
    return found


def _is_plain(name: str) -> bool:
    """Whether a member is a file directly in a subfolder of the data folder."""
    folder, _, rest = name.partition("/")
    return folder in FOLDERS and rest not in ("", ".", "..") and not set(rest) & set("/\\:")


def _move_away(folder: Path) -> Path | None:
    """Rename the previous database. Raises StoreFailed if a process has it open."""
    database = folder / FILE_NAME
    if not database.exists():
        return None
    with closing(sqlite3.connect(database, timeout=_UNUSED_TIMEOUT_S, isolation_level=None)) as connection:
        try:
            connection.execute("PRAGMA locking_mode = EXCLUSIVE").close()
            # in WAL mode, every open connection prevents this
            connection.execute("PRAGMA journal_mode = DELETE").close()
            connection.execute("BEGIN EXCLUSIVE").close()
            connection.execute("ROLLBACK").close()
        except sqlite3.DatabaseError as error:
            if error.sqlite_errorcode in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
                raise StoreFailed(
                    f"{database} is in use. Stop the server first.", cause=None, reason="locked", retry=True
                ) from None
            # damaged: this is what backups are for
    previous = beside(database, "before-restore")
    for suffix in ("", "-wal", "-shm"):
        if (one := Path(f"{database}{suffix}")).exists():
            one.rename(f"{previous}{suffix}")
    return previous
