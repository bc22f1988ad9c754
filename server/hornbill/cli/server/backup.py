"""`hornbill backup`, `hornbill restore` and the unit for systemd: commands for the administrator of the machine."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from hornbill.cli.confirm import Yes, require_confirmation
from hornbill.cli.failing import failures
from hornbill.cli.server.server_settings import DataDir, settings_of
from hornbill.cli.showing import instant
from hornbill.errors import NotAvailable

if TYPE_CHECKING:
    from hornbill.store.backup import Backup

IN_UNIT: Final = "/opt/hornbill/bin/hornbill"
"""Program in the packaged unit; the printed one names this environment's."""


def backup(
    file: Annotated[Path, typer.Argument(help="New file, for example bench.zip.")], data_dir: DataDir = None
) -> None:
    """Back up database, logs and recordings to a zip file, also while the server runs. For PostgreSQL, use pg_dump."""
    with failures():
        from hornbill.store.backup import back_up

        print(f"{file}: {_summary(back_up(_folder(data_dir), file))}")


def restore(
    file: Annotated[Path, typer.Argument(help="File of 'hornbill backup'.", exists=True, dir_okay=False)],
    data_dir: DataDir = None,
    yes: Yes = False,
) -> None:
    """Restore a backup into the data folder while no server uses it. The previous database is kept there."""
    with failures():
        folder = _folder(data_dir)
        require_confirmation(f"Replace the database in {folder} by {file}?", yes)
        from hornbill.store.backup import restore as restore_backup

        done = restore_backup(file, folder)
    print(f"{folder}: {_summary(done)}")
    if done.previous is not None:
        print(f"The previous database is in {done.previous}.")


def systemd_unit() -> None:
    """Print a hardened unit for systemd, to be stored as /etc/systemd/system/hornbill.service."""
    from importlib.resources import files

    unit = files("hornbill.app").joinpath("hornbill.service").read_text(encoding="utf-8")
    print(unit.replace(IN_UNIT, str(Path(sys.executable).with_name("hornbill"))), end="")


def _folder(data_dir: Path | None) -> Path:
    """The data folder. Raises NotAvailable if the database is not in it, and CannotStart."""
    settings = settings_of(data_dir=data_dir)
    if settings.database is not None:
        raise NotAvailable(
            "HORNBILL_DATABASE names a database server, which has its own backups. Use pg_dump and pg_restore, and "
            f"copy {settings.data_dir} for logs and recordings.", cause=None,
        )  # fmt: skip
    return settings.data_dir


def _summary(one: "Backup") -> str:
    return f"hornbill {one.version}, {instant(one.created_at)}, {one.files} files, {one.size / 1e6:.1f} MB"
