"""Log files: round trip in every format, and invalid content."""

import io
import os
import struct
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import can
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hornbill.bus.recordings.reader import LogCounters, LogReader
from hornbill.bus.recordings.writer import ENDINGS, LogFormat, LogWriter, candump
from hornbill.errors import LogFailed
from hornbill.wire.frame import Frame, LoggedFrame

every_form = pytest.mark.parametrize("form", LogFormat)

START = 1_700_000_000.007_123
"""Seven milliseconds past a second: what a header without leading zeros takes for 700."""

FRAMES = [Frame(0x1003_F30B, bytes(range(n % 9)), START + n * 0.000_137) for n in range(300)]


def write(path: Path, form: LogFormat, frames: list[Frame], limit: int = 10**9) -> LogWriter:
    file = LogWriter(path, form, limit)
    file.write(LoggedFrame(frame, "can0", n % 2 == 0) for n, frame in enumerate(frames))
    file.close()
    return file


def read_file(path: Path) -> list[LoggedFrame]:
    recording = LogReader.open(path)
    found = list(recording)
    recording.close()
    return found


def read(text: str | bytes) -> tuple[list[LoggedFrame], LogCounters]:
    raw: Any = io.BytesIO(text.encode("utf-8", "surrogateescape") if isinstance(text, str) else text)
    recording = LogReader(io.BufferedReader(raw), "the test")
    found = list(recording)
    recording.close()
    return found, recording.counters


@every_form
@pytest.mark.parametrize("zone", ["UTC", "America/New_York", "Asia/Tokyo"])
def test_a_log_is_read_back_to_the_microsecond(
    form: LogFormat, zone: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TZ", zone)
    time.tzset()
    try:
        path = tmp_path / f"log{ENDINGS[form]}"
        file = write(path, form, FRAMES)
        recording = LogReader.open(path)
        found = list(recording)
        recording.close()
    finally:
        monkeypatch.undo()
        time.tzset()
    assert recording.form is form
    assert [one.frame[:2] for one in found] == [frame[:2] for frame in FRAMES]
    assert max(abs(one.frame.at - frame.at) for one, frame in zip(found, FRAMES, strict=True)) < 2e-6
    assert file.frames == len(FRAMES)
    assert file.size == path.stat().st_size
    assert recording.counters == LogCounters(frames=len(FRAMES))
    marked = [form is not LogFormat.CSV and n % 2 == 0 for n in range(len(FRAMES))]
    assert [one.sent for one in found] == marked, "CSV does not support it"


def test_candump_lines_are_those_of_can_utils_and_of_python_can(tmp_path: Path) -> None:
    logged = [LoggedFrame(frame, ("can0", "ttyACM0", "0")[n % 3], n % 2 == 0) for n, frame in enumerate(FRAMES)]
    path = tmp_path / "log"
    file = LogWriter(path, LogFormat.CANDUMP, 10**9)
    file.write(logged)
    file.close()
    assert path.read_text().splitlines()[6] == "(1700000000.007945) can0 1003F30B#000102030405 T"
    assert path.read_text() == candump(logged)
    assert [one.channel for one in read_file(path)] == ["can0", "ttyACM0", "can0"] * 100, "a number is an interface"


@every_form
def test_a_log_ends_before_its_size_limit(form: LogFormat, tmp_path: Path) -> None:
    path = tmp_path / "log"
    file = LogWriter(path, form, 5_000)
    room = True
    for n in range(100_000):
        room = file.write([LoggedFrame(FRAMES[n % 300]._replace(at=START + n), "can0", False)])
        if not room:
            break
    file.close()
    assert not room
    assert path.stat().st_size <= 5_000
    assert len(read_file(path)) == file.frames > 10


def test_a_log_needs_a_new_file_and_a_folder_that_can_be_created(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b" / "log"
    write(path, LogFormat.CANDUMP, FRAMES[:1])
    content = path.read_text()
    for taken in (path, path / "c"):
        with pytest.raises(LogFailed, match="cannot be written"):
            LogWriter(taken, LogFormat.CANDUMP, 1000)
    assert path.read_text() == content, "an existing log is never overwritten"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
@pytest.mark.parametrize("form", [LogFormat.CANDUMP, LogFormat.ASC, LogFormat.CSV])
def test_a_full_disk_raises_os_error_and_closing_releases_the_file(
    form: LogFormat, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = Path.open

    def full(_path: Path, mode: str) -> Any:
        return opened(Path("/dev/full"), mode.replace("x", "w"))

    monkeypatch.setattr(Path, "open", full)
    file = LogWriter(tmp_path / "log", form, 10**6)
    with pytest.raises(OSError, match="No space"):
        file.write([LoggedFrame(FRAMES[0], "can0", False)])
    with pytest.raises(OSError, match="No space"):
        file.close()


def test_candump_lines_of_every_kind() -> None:
    found, counters = read(
        "(1436509052.249713) vcan0 1003F30B#0102030405060708\n"
        "(1436509052.449847) vcan0 1003f30b#01 R\n"
        " (1436509052.5)   can1   1003F30B#   T\n"
        "\n"
        "(1436509052.6) can1 1003F30B#1122334455667788_E\n"
        "(1436509052.650004) vcan0 123#8d00100100820100\n"
        "(1436509052.7) vcan0 1003F30B##3010203\n"
        "(1436509052.8) vcan0 1003F30B#R8\n"
        "(1436509052.9) vcan0 20000004#0004000000000000\n"
        "(1436509053.0) vcan0 20000080#0000000000000000\n"
    )
    assert [(one.frame.at, one.channel, one.sent, len(one.frame.data)) for one in found] == [
        (1436509052.249713, "vcan0", False, 8),
        (1436509052.449847, "vcan0", False, 1),
        (1436509052.5, "can1", True, 0),
        (1436509052.6, "can1", False, 8),
    ]
    assert counters == LogCounters(frames=4, ignored=3, error_frames=2)


@pytest.mark.parametrize(
    "line",
    [
        "(1436509052.2) can0",
        "(1436509052.2) can0 1003F30B",
        "(1436509052.2) can0 1003F30B#012",
        "(1436509052.2) can0 1003F30B#010203040506070809",
        "(1436509052.2) can0 1003F30B#xy",
        "(1436509052.2) can0 FFFFFFFF#",
        "(nan) can0 1003F30B#00",
        "(1e9) can0 1003F30B#00",
        " can0  1003F30B   [3]  01 02 03",
        "(14365090",
        "\udcff\udcfe",
    ],
)
def test_an_invalid_line_is_counted_and_the_next_is_read(line: str) -> None:
    good = "(1436509052.249713) vcan0 1003F30B#01\n"
    found, counters = read(good + line + "\n" + good)
    assert len(found) == 2
    assert counters.unreadable + counters.error_frames == 1


def test_the_output_of_log2asc_is_read() -> None:
    found, counters = read(
        "date Fri Jul 10 06:17:32 2015\n"
        "base hex  timestamps absolute\n"
        "no internal events logged\n"
        "   0.000000 1  A6ED00x         Rx   d 8 01 1A 6F E9 F6 60 CE C0\n"
        "   0.250000 1  1800017Fx       Tx   d 3 00 C9 FB\n"
        "   0.300000 1  123             Rx   d 1 00\n"
        "   0.400000 1  ErrorFrame\n"
        "   0.500000 1  1800017Fx       Rx   d x zz\n"
        "   0.600000 1  1800017Fx       Rx   d 1 0A\n"
        "   0.700000 1  Statistic: D 0\n"
    )
    assert [(one.frame.id, one.frame.data.hex(), one.sent) for one in found] == [
        (0xA6ED00, "011a6fe9f660cec0", False),
        (0x1800017F, "00c9fb", True),
        (0x1800017F, "0a", False),
    ]
    assert [one.frame.at - found[0].frame.at for one in found] == pytest.approx([0.0, 0.25, 0.6])
    assert counters == LogCounters(frames=3, ignored=1, error_frames=1, unreadable=1)


def test_an_asc_file_with_a_date_in_an_unknown_language_counts_from_its_start() -> None:
    found, counters = read(
        "date vr jul. 10 06:17:32 2015\nbase hex  timestamps absolute\nno internal events logged\n"
        "   0.125000 1  A6ED00x         Rx   d 1 01\n   0.250000 1  A6ED00x         Rx   d 1 02\n"
    )
    assert ([one.frame.at for one in found], counters) == ([0.125, 0.25], LogCounters(frames=2))


def test_an_invalid_csv_line_is_counted() -> None:
    head = "timestamp,arbitration_id,extended,remote,error,dlc,data\n"
    good = "1483389946.197,0x1003f30b,1,0,0,1,Ag==\n"
    found, counters = read(head + good + "1483389946.2,0x10\n" + good + "1483389946.3,0x123,0,0,0,1,Ag==\n")
    assert [one.frame.data for one in found] == [b"\x02", b"\x02"]
    assert counters == LogCounters(frames=2, ignored=1, unreadable=1)


@every_form
def test_a_truncated_file_yields_its_complete_frames_or_is_reported_as_damaged(form: LogFormat, tmp_path: Path) -> None:
    path = tmp_path / "log"
    write(path, form, FRAMES)
    whole = path.read_bytes()
    for end in range(len(whole) - 1, 150, -97):
        try:
            found, _ = read(whole[:end])
        except LogFailed:
            assert form is LogFormat.BLF
            continue
        assert [one.frame[:2] for one in found[:-1]] == [frame[:2] for frame in FRAMES[: max(0, len(found) - 1)]]


def test_a_blf_file_that_was_never_closed_is_read(tmp_path: Path) -> None:
    """As left by a killed process: the header is the initial one."""
    path = tmp_path / "log.blf"
    with path.open("wb") as file:
        writer = can.BLFWriter(file)
        for frame in FRAMES * 20:
            writer.on_message_received(can.Message(frame.at, frame.id, data=frame.data))
        file.flush()
        found, _ = read(path.read_bytes())
        writer.stop()
    assert len(found) > 1000


@pytest.mark.parametrize("text", ["hello\n", "\x7fELF\x02\x01", "{}\n", "  can0  123 [1] 00\n"])
def test_another_file_is_refused_with_the_supported_formats(text: str) -> None:
    with pytest.raises(LogFailed, match=r"the test is not a supported log.* candump -l"):
        read(text)


def test_an_empty_file_is_an_empty_recording_and_a_missing_one_or_a_folder_is_refused(tmp_path: Path) -> None:
    for text in ("", "\n\n"):
        assert read(text) == ([], LogCounters())
    for path, why in ((tmp_path / "nothing.log", "No such file"), (tmp_path, "Is a directory")):
        with pytest.raises(LogFailed, match=f"{path.name} cannot be read: {why}"):
            LogReader.open(path)


def test_a_pipe_yields_each_frame_as_it_arrives() -> None:
    reading, writing = os.pipe()
    with os.fdopen(reading, "rb") as source, os.fdopen(writing, "w") as sink:
        sink.write("(1.5) can0 1003F30B#01\n")
        sink.flush()
        recording = LogReader(source, "a pipe")
        frames = iter(recording)
        assert next(frames).frame.data == b"\x01"  # while the pipe is still open: frames are read on demand
        assert recording.counters.frames == 1
        sink.write("(1.6) can0 1003F30B#02\n")
        sink.flush()
        assert next(frames).frame.data == b"\x02"
        sink.close()
        assert list(frames) == []
        recording.close()


@given(st.binary(max_size=300))
@settings(max_examples=300, deadline=None)
def test_any_bytes_are_read_or_refused(content: bytes) -> None:
    for start in (b"", b"(1.0) ", b"date Fri Jul 10 06:17:32 2015\n", b"timestamp,\n", b"LOGG" + bytes(140)):
        try:
            found, _ = read(start + content)
        except LogFailed:
            continue
        assert all(0 <= one.frame.id < 1 << 29 and len(one.frame.data) <= 8 for one in found)


@settings(deadline=None)
@given(st.lists(st.sampled_from([struct.pack("<4sHHLL", b"LOBJ", 16, 1, 0, 10), b"LOBJ", bytes(16), b"\xff" * 9])))
def test_reading_a_damaged_blf_file_ends(parts: list[bytes]) -> None:
    header = struct.pack("<4sLBBBBBBBBQQLL8H8H", b"LOGG", 144, 5, 0, 0, 0, 2, 6, 8, 1, 0, 0, 0, 0, *[0] * 16)
    with suppress(LogFailed):
        assert read(header.ljust(144, b"\0") + b"".join(parts))[0] == []
