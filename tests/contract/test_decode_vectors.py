"""`hornbill decode` on all conformance vectors: in every log format, from a file and from a live pipe."""

import io
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from contract.test_vectors import VECTORS, Vector, frames_of
from hornbill.app.decode import decode_log
from hornbill.bus.recordings.writer import ENDINGS, LogFormat, LogWriter
from hornbill.cli import app
from hornbill.wire.frame import LoggedFrame

KEYS = [
    "timestamp", "type", "kind", "data_type_id", "source", "destination", "priority", "transfer_id", "fields",
    "payload",
]  # fmt: skip

START = 1_436_509_052.249_713
FRAMES = [frame for vector in VECTORS for frame in frames_of(vector)]


def stamped() -> list[tuple[float, int, bytes]]:
    return [(START + n / 1000, frame.id, frame.data) for n, frame in enumerate(FRAMES)]


CANDUMP = "".join(f"({at:.6f}) can0 {can_id:08X}#{data.hex().upper()}\n" for at, can_id, data in stamped())


def decoded(log: str, standard_input: bytes = b"", *, as_json: bool = True) -> tuple[list[str], list[str]]:
    """Lines on standard output and on standard error."""
    out, errors = io.BytesIO(), list[str]()
    raw: Any = io.BytesIO(standard_input)
    decode_log(log, as_json, io.BufferedReader(raw), out, errors.append)
    return out.getvalue().decode().splitlines(), errors


def expected(vector: Vector) -> dict[str, Any]:
    return {key: vector[key] for key in KEYS if key != "timestamp"}


def check(lines: list[str]) -> None:
    found = [json.loads(line) for line in lines]
    assert len(found) == len(VECTORS) == 400
    last = 0
    for one, vector in zip(found, VECTORS, strict=True):
        assert list(one) == KEYS
        last += len(vector["frames"])
        assert one.pop("timestamp") == pytest.approx(START + (last - 1) / 1000, abs=2e-6)
        assert one == expected(vector)


@pytest.mark.parametrize("form", LogFormat)
def test_every_vector_of_each_log_format(form: LogFormat, tmp_path: Path) -> None:
    path = tmp_path / f"can0{ENDINGS[form]}"
    file = LogWriter(path, form, 10**9)
    file.write(
        LoggedFrame(frame._replace(at=at), "can0", False) for (at, *_), frame in zip(stamped(), FRAMES, strict=True)
    )
    file.close()
    check(decoded(str(path))[0])


def test_every_vector_from_standard_input() -> None:
    """With what a JSON reader may lose silently: 64 bits, float32, and the minus of zero."""
    lines, counts = decoded("-", CANDUMP.encode())
    check(lines)
    assert counts == [f"{len(FRAMES)} frames, 400 transfers"]
    text = "\n".join(lines)
    crc = next(v["fields"]["software_version"]["image_crc"] for v in VECTORS if "software_version" in v["fields"])
    assert crc > 1 << 53
    assert f'"image_crc":{crc}' in text
    assert '"command_value":-0.0' in text
    assert '"NaN"' in text
    assert "Infinity" not in text


def test_two_buses_in_one_recording_are_decoded_separately() -> None:
    """`candump any` mixes them; the same node sends the same on both."""
    both = "".join(f"{line}\n{line.replace(' can0 ', ' can1 ')}\n" for line in CANDUMP.splitlines())
    lines, counts = decoded("-", both.encode())
    assert len(lines) == 800
    assert counts == [f"{2 * len(FRAMES)} frames, 800 transfers"]
    assert lines[::2] == lines[1::2]


def test_bad_frames_are_counted_by_reason() -> None:
    bad = (
        "(1.0) can0 1003F301#0102030405060720\n"  # a continuation of nothing
        "(1.0) can0 10015501#\n"  # no tail byte
        "(1.0) can0 100B8080#0011\n"  # a service of node 0
        "(1.0) can0 1E4E2301#01020304050607A0\n"  # a first frame with toggle
        "(1.0) can0 1E4E2301#0102030405060780\n"  # a longer transfer of an unknown type
        "(1.0) can0 1003F303#0102030405060780\n"  # one that never ends
        "(1.0) can0 10015501#00C0\n"  # a NodeStatus of one byte
        "(1.0) can0 1E4E2301#01C0\n"  # a short one of an unknown type
        "(1.0) can0 123#00\n(1.0) can0 20000004#0000000000000000\nnonsense\n"
    )
    cut_off = f"({START + 2:.6f}) can0 1003F303#0102030405060780\n"
    lines, counts = decoded("-", (bad + CANDUMP + cut_off).encode())
    check(lines[2:])
    misfit, unknown = (json.loads(line) for line in lines[:2])
    assert (misfit["type"], misfit["fields"], misfit["payload"]) == ("uavcan.protocol.NodeStatus", None, "00")
    assert (unknown["type"], unknown["fields"], unknown["data_type_id"]) == (None, None, 0x4E23)
    reasons = dict(line.split(" (")[0].split(": ") for line in counts[1:])
    assert {name: int(count) for name, count in reasons.items()} == {
        "bad_identifier": 1, "bad_tail": 1, "bad_toggle": 1, "unexpected": 1, "unknown_type": 1, "timed_out": 1,
        "unfinished": 1, "bad_payload": 1, "unreadable": 1, "ignored": 1, "error_frames": 1,
    }  # fmt: skip


def test_without_json_each_transfer_is_a_line() -> None:
    lines, _ = decoded("-", CANDUMP.encode(), as_json=False)
    assert len(lines) == 400
    assert all(line.isprintable() for line in lines)
    assert lines[0].split(maxsplit=4)[:4] == ["06:17:32.249713", "–", "→", "all"]
    assert "GetSet request write 0x20 torque_mode = 0, On" in "\n".join(lines)


@pytest.mark.parametrize(
    ("name", "error"), [("nowhere.log", "cannot be read: No such file"), ("notes.txt", "is not a supported log")]
)
def test_an_unreadable_file_is_an_error(name: str, error: str, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("Buy milk.\n")
    done = CliRunner().invoke(app, ["decode", str(tmp_path / name)])
    assert (done.exit_code, done.stdout) == (1, "")
    assert error in done.stderr


def test_a_live_pipe_is_decoded_line_by_line() -> None:
    """Transfers are printed to standard output, counts to standard error."""
    command = [sys.executable, "-m", "hornbill", "decode", "-", "--json"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        assert running.stdin is not None
        assert running.stdout is not None
        for line, vector in zip(CANDUMP.splitlines()[:2], VECTORS[:2], strict=True):
            running.stdin.write(line.encode() + b"\n")
            running.stdin.flush()
            one = json.loads(running.stdout.readline())  # blocks if output is buffered
            assert one["fields"] == vector["fields"]
        _, errors = running.communicate(timeout=30)
    assert running.returncode == 0
    assert errors.strip() == b"2 frames, 2 transfers"


def test_a_closed_reader_is_no_error(tmp_path: Path) -> None:
    path = tmp_path / "long.log"
    path.write_text(CANDUMP * 10)
    done = subprocess.run(
        f"{sys.executable} -m hornbill decode {path} | head -n 1",
        shell=True,
        capture_output=True,
        check=False,
        timeout=60,
    )
    assert done.stdout.count(b"\n") == 1
    assert b"Traceback" not in done.stderr
    assert b"BrokenPipe" not in done.stderr
