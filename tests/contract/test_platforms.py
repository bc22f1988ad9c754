"""hornbill uses no POSIX-only call on Windows, as far as can be tested on Linux."""

import ast
import io
import os
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


def test_the_demo_runs_without_posix_calls(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "contract.platform_emulation"]
    home = {"HOME": str(tmp_path), "USERPROFILE": str(tmp_path), "LOCALAPPDATA": str(tmp_path / "AppData" / "Local")}
    others = {name: value for name, value in os.environ.items() if not name.startswith(("HORNBILL_", "XDG_"))}
    ran = subprocess.run(
        command, cwd=TESTS, capture_output=True, text=True, timeout=120, check=False, env=others | home
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr[-3000:]
    lines = ran.stdout.splitlines()
    assert f"data {tmp_path / 'AppData/Local/hornbill/hornbill'}" in lines
    assert "open http://127.0.0.1:" in ran.stdout
    assert "reuse 0" in lines, "on Windows another program could share the port"
    paths = [line.split()[1] for line in lines if line.startswith("200")]
    assert paths[:4] == ["api/v1/health", "api/v1/bus/adapters", "api/v1/bus/doctor", "viser/"]
    assert "Traceback" not in ran.stderr


@pytest.mark.parametrize("name", ["COM3", "COM12@115200", "/dev/cu.usbmodem14101", "/dev/tty.usbserial-A1"])
def test_serial_ports_of_other_systems_are_channels(name: str) -> None:
    assert parse(f"slcan:{name}") == ("slcan", name)


@pytest.mark.parametrize(
    ("platform", "encoding_set", "written"),
    [("win32", False, "61-466861: 9,7° → Höhenruder 昇降舵"), ("win32", True, "61-466861: 9,7° ? Höhenruder ???"),
     ("linux", False, "61-466861: 9,7° ? Höhenruder ???")],
)  # fmt: skip
def test_output_to_a_pipe_with_a_code_page_never_fails(
    monkeypatch: pytest.MonkeyPatch, platform: str, encoding_set: bool, written: str
) -> None:
    pipe = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(pipe, "cp1252"))
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.delenv("PYTHONIOENCODING", raising=False)
    if encoding_set:
        monkeypatch.setenv("PYTHONIOENCODING", "cp1252")
    configure_output()
    print("61-466861: 9,7° → Höhenruder 昇降舵", end="", flush=True)
    assert pipe.getvalue().decode("utf-8" if platform == "win32" and not encoding_set else "cp1252") == written


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_encodings_of_windows_editors_are_read(tmp_path: Path, encoding: str) -> None:
    file = tmp_path / "bench.toml"
    file.write_bytes('label = "昇降舵"\r\n[servo]\r\n'.encode(encoding))
    assert text_of(file) == 'label = "昇降舵"\n[servo]\n'


def test_a_file_in_a_code_page_is_rejected(tmp_path: Path) -> None:
    file = tmp_path / "bench.toml"
    file.write_bytes('label = "Höhenruder"'.encode("cp1252"))
    with pytest.raises(InvalidValue, match=r"byte 10 is 0xf6\. Save the file as UTF-8"):
        text_of(file)


def test_every_text_file_is_opened_with_an_encoding() -> None:
    wrong: list[str] = []
    for file in PACKAGE.rglob("*.py"):
        for node in nodes(file):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                named = {one.arg for one in node.keywords}
                given = "encoding" in named or len(node.args) > (node.func.attr == "write_text")
                if node.func.attr in ("read_text", "write_text") and not given:
                    wrong.append(f"{file.relative_to(PACKAGE)}:{node.lineno}")
    assert wrong == []
