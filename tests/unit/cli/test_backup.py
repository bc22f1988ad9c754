"""`hornbill backup` and `restore`, also beside a process that writes; and the unit for systemd."""

import os
import re
import shutil
import stat
import subprocess
import zipfile
from pathlib import Path

import pytest
from typer.testing import CliRunner

from hornbill.cli import app
from hornbill.cli.failing import Exit
from hornbill.store.data_folder import FILE_NAME
from hornbill.store.store import Store
from hornbill.units import Uid

UID = Uid("a0" * 16)


def run(*words: str | Path, code: int = 0) -> str:
    done = CliRunner().invoke(app, [str(one) for one in words])
    assert done.exit_code == code, (done.output, done.exception)
    return done.output


def labels(folder: Path) -> list[str]:
    with Store(folder) as store:
        return [one.label for one in store.servos.all()]


def test_a_backup_of_an_open_database_is_complete_and_restores(tmp_path: Path) -> None:
    folder, file = tmp_path / "data", tmp_path / "bench.zip"
    with Store(folder) as store:
        store.servos.set_label(UID, "Rudder")
        (folder / "logs").mkdir()
        (folder / "logs" / "run.log").write_text("frames")
        assert "1 files" in run("backup", file, "--data-dir", folder)
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
        assert "exists" in run("backup", file, "--data-dir", folder, code=Exit.FAILED)
        store.servos.set_label(UID, "changed later")
        assert "Stop the server" in run(
            "restore", file, "--data-dir", folder, "--yes", code=Exit.CANNOT_START_NOW
        )  # fmt: skip
    assert labels(folder) == ["changed later"]
    run("restore", file, "--data-dir", folder, code=Exit.USAGE)  # without --yes
    (folder / "logs" / "run.log").unlink()
    assert "previous database is in" in run("restore", file, "--data-dir", folder, "--yes")
    assert labels(folder) == ["Rudder"]
    assert (folder / "logs" / "run.log").read_text() == "frames"
    (previous,) = folder.glob("*.before-restore.*")
    shutil.copy(previous, tmp_path / FILE_NAME)
    assert labels(tmp_path) == ["changed later"]
    assert sorted(one.name for one in folder.iterdir()) == sorted((FILE_NAME, previous.name, "logs"))


def test_a_backup_replaces_a_damaged_database(tmp_path: Path) -> None:
    folder, file = tmp_path / "data", tmp_path / "bench.zip"
    with Store(folder) as store:
        store.servos.set_label(UID, "Rudder")
    run("backup", file, "--data-dir", folder)
    (folder / FILE_NAME).write_bytes(b"noise" * 2000)
    run("restore", file, "--data-dir", folder, "--yes")
    assert labels(folder) == ["Rudder"]
    run("restore", file, "--data-dir", tmp_path / "other", "--yes")
    assert labels(tmp_path / "other") == ["Rudder"]


@pytest.mark.parametrize("kind", ["no zip", "other zip", "outside", "damaged", "newer"])
def test_a_file_that_is_no_backup_changes_nothing(tmp_path: Path, kind: str) -> None:
    folder, file = tmp_path / "data", tmp_path / "bench.zip"
    with Store(folder) as store:
        store.servos.set_label(UID, "Rudder")
    run("backup", file, "--data-dir", folder)
    if kind == "no zip":
        file.write_text("x")
    elif kind == "other zip":
        with zipfile.ZipFile(file, "w") as archive:
            archive.writestr("thesis.txt", "x")
    elif kind == "damaged":
        content = bytearray(file.read_bytes())
        content[len(content) // 2] ^= 0xFF
        file.write_bytes(content)
    else:
        with zipfile.ZipFile(file, "a") as archive:
            if kind == "outside":
                archive.writestr("logs/../../x", "x")
        if kind == "newer":
            with zipfile.ZipFile(file, "w") as archive:
                archive.writestr("backup.json", '{"format": 99, "version": "9.0"}')
                archive.writestr(FILE_NAME, b"")
    run("restore", file, "--data-dir", folder, "--yes", code=Exit.FAILED)
    assert labels(folder) == ["Rudder"]
    assert [one.name for one in folder.iterdir()] == [FILE_NAME]
    assert not (tmp_path / "x").exists()


def test_postgresql_and_an_empty_folder_are_not_backed_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "no database" in run("backup", tmp_path / "x.zip", "--data-dir", tmp_path, code=Exit.CANNOT_START)
    monkeypatch.setenv("HORNBILL_DATABASE", "postgresql://bench@db/bench7")
    assert "pg_dump" in run("backup", tmp_path / "x.zip", code=Exit.FAILED)
    assert list(tmp_path.iterdir()) == []


def test_systemd_does_not_restart_what_a_restart_cannot_mend(tmp_path: Path) -> None:
    unit = run("systemd-unit")
    prevented = re.search(r"^RestartPreventExitStatus=(.*)$", unit, re.MULTILINE)
    assert prevented is not None
    assert {int(one) for one in prevented[1].split()} == {Exit.USAGE, Exit.CANNOT_START}
    assert "/opt/hornbill" not in unit
    analyze = shutil.which("systemd-analyze")
    if analyze is None or not Path(re.findall(r"^ExecStart=(\S+)", unit, re.MULTILINE)[0]).exists():
        pytest.skip("no systemd-analyze, or hornbill is not installed")
    file = tmp_path / "hornbill.service"
    file.write_text(unit)
    done = subprocess.run(
        [analyze, "verify", str(file)], capture_output=True, text=True, check=False, timeout=60,
        env={**os.environ, "SYSTEMD_LOG_LEVEL": "warning"},
    )  # fmt: skip
    assert "hornbill.service:" not in done.stderr, done.stderr
