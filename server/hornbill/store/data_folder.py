"""The data folder: created for its user alone, and checked before anything in it is opened."""

import os
import stat
from pathlib import Path
from typing import Final

from hornbill.errors import StoreFailed

FILE_NAME: Final = "hornbill.sqlite3"
"""The database in the data folder. Copies of it and SQLite's own files have names that start like it."""
LOGS_FOLDER: Final = "logs"
"""Subfolder of bus logs."""
RECORDINGS_FOLDER: Final = "recordings"
"""Subfolder of recordings."""
FOLDERS: Final = (LOGS_FOLDER, RECORDINGS_FOLDER)
FIRST_TOKEN: Final = "first-token"
"""File with the token that a container creates at its first start."""


def prepare(folder: Path) -> None:
    """Create the data folder, mode 0700. In an existing one, our files get mode 0600, our subfolders 0700.

    The mode of an existing folder is changed only if nothing else is in it. Raises StoreFailed.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        content = [*folder.iterdir()]
        ours = [one for one in content if one.name.startswith(FILE_NAME) or one.name in (*FOLDERS, FIRST_TOKEN)]
        for path in (*ours, *([folder] if len(ours) == len(content) else [])):
            _make_private(path)
    except FileExistsError:
        raise _unusable(folder, "is a file") from None
    except OSError as error:
        raise _unusable(folder, f"cannot be created or read: {error.strerror}") from error
    if not os.access(folder, os.W_OK | os.X_OK):
        raise _unusable(folder, "is not writable for this user")


def create_private(file: Path) -> None:
    """Create an empty file, mode 0600, unless it exists: SQLite gives its other files the same mode. Raises OSError."""
    os.close(os.open(file, os.O_CREAT | os.O_WRONLY, 0o600))


def _make_private(path: Path) -> None:
    """Remove the access of other users. Files of another user, and of file systems without modes, stay as they are."""
    mode = path.stat().st_mode
    wanted = 0o700 if stat.S_ISDIR(mode) else 0o600
    if stat.S_IMODE(mode) & ~wanted:
        try:
            path.chmod(wanted)
        except OSError:
            pass


def _unusable(folder: Path, why: str) -> StoreFailed:
    return StoreFailed(
        f"The data folder {folder} {why}. Choose another data folder, or correct its permissions.",
        cause="store_unusable", reason="data_folder", retry=False,
    )  # fmt: skip
