"""No call that POSIX alone has is on the way of a user on Windows or macOS, as far as Linux can show it."""

import ast
import io
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from contract.source import nodes
from hornbill.bus.address import parse
from hornbill.cli.plain_text import configure_output, text_of
from hornbill.errors import InvalidValue

TESTS = Path(__file__).parents[1]
PACKAGE = TESTS.parent / "server" / "hornbill"


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
    reused = re.findall(r"^reuse (\d+)$", ran.stdout, re.MULTILINE)
    assert [one != "0" for one in reused] == [platform != "win32"], "on Windows it would share its port"
    answered = [line.split()[:2] for line in ran.stdout.splitlines() if line.startswith("200")]
    assert [path for _, path in answered[:4]] == ["api/v1/health", "api/v1/bus/adapters", "api/v1/bus/doctor", "viser/"]
    assert "Traceback" not in ran.stderr


@pytest.mark.parametrize("name", ["COM3", "COM12@115200", "/dev/cu.usbmodem14101", "/dev/tty.usbserial-A1"])
def test_the_names_of_serial_ports_elsewhere_are_channels(name: str) -> None:
    assert parse(f"slcan:{name}") == ("slcan", name)


@pytest.mark.parametrize(
    ("platform", "told", "written"),
    [("win32", False, "61-466861: 9,7° → Höhenruder 昇降舵"), ("win32", True, "61-466861: 9,7° ? Höhenruder ???"),
     ("linux", False, "61-466861: 9,7° ? Höhenruder ???")],
)  # fmt: skip
def test_what_is_printed_into_a_pipe_with_a_code_page_is_whole_on_windows_and_never_an_error(
    monkeypatch: pytest.MonkeyPatch, platform: str, told: bool, written: str
) -> None:
    pipe = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(pipe, "cp1252"))
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.delenv("PYTHONIOENCODING", raising=False)
    if told:
        monkeypatch.setenv("PYTHONIOENCODING", "cp1252")
    configure_output()
    print("61-466861: 9,7° → Höhenruder 昇降舵", end="", flush=True)
    assert pipe.getvalue().decode("utf-8" if platform == "win32" and not told else "cp1252") == written


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_file_is_read_as_editors_and_shells_of_windows_write_it(tmp_path: Path, encoding: str) -> None:
    file = tmp_path / "bench.toml"
    file.write_bytes('label = "昇降舵"\r\n[servo]\r\n'.encode(encoding))
    assert text_of(file) == 'label = "昇降舵"\n[servo]\n'


def test_a_file_in_a_code_page_is_refused_with_the_remedy(tmp_path: Path) -> None:
    file = tmp_path / "bench.toml"
    file.write_bytes('label = "Höhenruder"'.encode("cp1252"))
    with pytest.raises(InvalidValue, match=r"byte 10 is 0xf6\. Save the file as UTF-8"):
        text_of(file)


def test_no_text_file_is_opened_in_whatever_encoding_the_system_has() -> None:
    wrong: list[str] = []
    for file in PACKAGE.rglob("*.py"):
        for node in nodes(file):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                named = {one.arg for one in node.keywords}
                given = "encoding" in named or len(node.args) > (node.func.attr == "write_text")
                if node.func.attr in ("read_text", "write_text") and not given:
                    wrong.append(f"{file.relative_to(PACKAGE)}:{node.lineno}")
    assert wrong == []
