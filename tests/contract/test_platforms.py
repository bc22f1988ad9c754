"""No call that POSIX alone has is on the way of a user on Windows or macOS, as far as Linux can show it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from hornbill.bus.address import parse

TESTS = Path(__file__).parents[1]


@pytest.mark.parametrize(
    ("platform", "folder"),
    [("win32", "AppData/Local/hornbill/hornbill"), ("darwin", "Library/Application Support/hornbill")],
)
def test_the_demo_starts_answers_and_ends_without_what_that_system_has_not(
    platform: str, folder: str, tmp_path: Path
) -> None:
    command = [sys.executable, "-m", "contract.elsewhere", platform]
    home = {"HOME": str(tmp_path), "USERPROFILE": str(tmp_path), "LOCALAPPDATA": str(tmp_path / "AppData" / "Local")}
    others = {name: value for name, value in os.environ.items() if not name.startswith(("HORNBILL_", "XDG_"))}
    ran = subprocess.run(
        command, cwd=TESTS, capture_output=True, text=True, timeout=120, check=False, env=others | home
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr[-3000:]
    told = [line.removeprefix("data ") for line in ran.stdout.splitlines() if line.startswith("data ")]
    assert told == [str(tmp_path / folder)]
    assert "open http://127.0.0.1:" in ran.stdout
    answered = [line.split()[:2] for line in ran.stdout.splitlines() if line.startswith("200")]
    assert [path for _, path in answered[:4]] == ["api/v1/health", "api/v1/bus/adapters", "api/v1/bus/doctor", "viser/"]
    assert "Traceback" not in ran.stderr


@pytest.mark.parametrize("name", ["COM3", "COM12@115200", "/dev/cu.usbmodem14101", "/dev/tty.usbserial-A1"])
def test_the_names_of_serial_ports_elsewhere_are_channels(name: str) -> None:
    assert parse(f"slcan:{name}") == ("slcan", name)
