"""Recordings: validation of files, bounded reading, and the folder they are stored in."""

import os
import zipfile
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import orjson
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hornbill.bus.recordings import recording as recordings
from hornbill.bus.recordings.bus_log import log_name
from hornbill.bus.recordings.folder import LOGS, RECORDINGS, FileFolder, FileKind
from hornbill.bus.recordings.recording import RecordingReader, RecordingWriter, read_about
from hornbill.bus.recordings.writer import LogFormat
from hornbill.domain.recording import About, RecordedWrite
from hornbill.errors import InvalidValue, LogFailed, OutOfRange, Unknown
from hornbill.wire.frame import Frame, LoggedFrame

UID = "0" * 31 + "a"
ABOUT: dict[str, Any] = {
    "format": 1, "version": "1", "reason": "stop", "text": "Stop.", "started_at": 1.0, "ended_at": 2.0,
    "utc_offset": 0.5, "bus": None, "servos": [], "schema_revision": "x", "frames": 0,
    "marks": [{"at": 1.5, "reason": "stop", "text": "Stop."}],
}  # fmt: skip
LINE = b"(1.000000) can0 1003F30B#0102 R\n"


FRAME = LoggedFrame(Frame(0x1003F30B, b"\x01\x02", 1.0), "can0", False)


def check(path: Path) -> None:
    with RecordingReader(path) as recording:
        recording.check()


def make(path: Path, members: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return path


def test_frames_are_read_from_the_archive(tmp_path: Path) -> None:
    path = make(tmp_path / "a.zip", {"about.json": orjson.dumps(ABOUT), "frames.log": LINE * 3})
    with RecordingReader(path) as recording:
        log = recording.frames()
        assert recording.member("writes.csv") == b""
    assert [one.frame.data for one in log] == [b"\x01\x02"] * 3
    log.close()
    assert log.about == About.model_validate(ABOUT)


@pytest.mark.parametrize(
    ("members", "why"),
    [
        ({}, "no about.json"),
        ({"about.json": b""}, "or no frames.log"),
        ({"about.json": b"", "frames.log": b"", "../../evil": b""}, "other files"),
        ({"about.json": b"", "frames.log": b"", "/etc/passwd": b""}, "other files"),
        ({"about.json": b" " * (17 << 20), "frames.log": b""}, "unpacks to more than 16 MiB"),
        ({"about.json": b"", "frames.log": b"0" * (1 << 20)}, "not made of lines"),
        ({"about.json": b"", "frames.log": LINE * 50_000 + b"0" * 5000}, "not made of lines"),
    ],
)
def test_an_archive_that_is_not_a_recording_is_refused_with_the_reason(
    tmp_path: Path, members: dict[str, bytes], why: str
) -> None:
    path = make(tmp_path / "a.zip", members)
    with pytest.raises(LogFailed, match=why):
        check(path)


@pytest.mark.parametrize("at", [0.2, 0.5, None], ids=["name", "content", "size in the directory"])
def test_a_damaged_archive_is_refused(tmp_path: Path, at: float | None) -> None:
    """A false size in the directory is detected before the excess is unpacked."""
    path = make(tmp_path / "a.zip", {"about.json": bytes(range(256)) * 9, "frames.log": LINE * 50})
    whole = bytearray(path.read_bytes())
    if at is None:
        whole = whole.replace((len(LINE) * 50).to_bytes(4, "little"), (10).to_bytes(4, "little"))
    else:
        whole[int(len(whole) * at)] ^= 0xFF
    path.write_bytes(whole)
    with pytest.raises(LogFailed, match="damaged" if at is None else r"damaged|no recording"):
        check(path)


async def content(chunks: int) -> AsyncIterator[bytes]:
    for _ in range(chunks):
        yield bytes(100)


@pytest.mark.parametrize(
    "stem", ["", " ", "..", ".hidden", "../a", "/etc/a", "a/b", "a\\b", "-a", "a b", "a\n", "a\0b", "ä", "x" * 101]
)
@pytest.mark.parametrize(("kind", "ending"), [(RECORDINGS, ".zip"), (LOGS, ".log")], ids=["recording", "log"])
async def test_an_invalid_name_is_refused_and_nothing_stored(
    tmp_path: Path, kind: FileKind, ending: str, stem: str
) -> None:
    folder = FileFolder(tmp_path, kind)
    for name in (stem, stem + ending, f"{stem}{ending}/../x{ending}"):
        with pytest.raises(Unknown, match="not found"):
            folder.path(name)
        with pytest.raises(InvalidValue, match=f"is not a valid {kind.word} name"):
            await folder.adopt(name, content(1), lambda _path: None)
    assert os.listdir(tmp_path) == []  # noqa: PTH208


def test_a_folder_lists_and_deletes_only_its_kind_of_file(tmp_path: Path) -> None:
    folder = FileFolder(tmp_path / "logs", LOGS)
    assert folder.all() == []
    (tmp_path / "logs").mkdir()
    (tmp_path / "secret.log").write_text("not in the folder")
    for name in ("one.log", "two.blf", "notes.txt"):
        (tmp_path / "logs" / name).write_text(name)
    (tmp_path / "logs" / "folder.log").mkdir()
    assert {(one.name, one.size) for one in folder.all()} == {("one.log", 7), ("two.blf", 7)}
    for name in ("notes.txt", "folder.log", "../secret.log", "three.log"):
        with pytest.raises(Unknown, match="not found"):
            folder.delete(name)
    folder.delete("one.log")
    assert [one.name for one in folder.all()] == ["two.blf"]
    with pytest.raises(InvalidValue, match=r"A log two\.blf exists already"):
        folder.new(log_name(LogFormat.BLF, "two"))
    assert folder.new(log_name(LogFormat.BLF, "three.blf")).name == "three.blf", "a given extension is not repeated"


async def test_a_file_above_the_size_limit_is_refused_and_nothing_stored(tmp_path: Path) -> None:
    with pytest.raises(OutOfRange):
        await FileFolder(tmp_path, replace(RECORDINGS, largest=1000)).adopt("a.zip", content(11), lambda _path: None)
    assert os.listdir(tmp_path) == []  # noqa: PTH208


async def test_a_recording_is_listed_only_when_complete_and_a_second_gets_another_name(tmp_path: Path) -> None:
    folder = FileFolder(tmp_path, RECORDINGS)
    first, second = await RecordingWriter.begin(folder, "a.zip"), await RecordingWriter.begin(folder, "a.zip")
    assert (first.name, second.name) == ("a.zip", "a-2.zip")
    await first.add_frames([FRAME])
    assert folder.all() == []
    await first.finish(About.model_validate(ABOUT))
    await second.discard()
    assert [one.name for one in folder.all()] == os.listdir(tmp_path) == ["a.zip"]  # noqa: PTH208
    check(tmp_path / "a.zip")


async def test_a_member_is_cut_at_its_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(recordings.MEMBERS, "events.jsonl", 10)
    file = await RecordingWriter.begin(FileFolder(tmp_path, RECORDINGS), "a.zip")
    await file.add_events([b"1234567"])
    assert file.cut == []
    await file.add_events([b"123"])
    assert file.cut == ["events.jsonl"]
    await file.finish(About.model_validate(ABOUT))
    with RecordingReader(tmp_path / "a.zip") as recording:
        assert recording.member("events.jsonl") == b"1234567\n"


def test_the_oldest_are_removed_by_number_and_by_size_but_never_the_newest(tmp_path: Path) -> None:
    for n in range(5):
        path = make(tmp_path / f"{n}.zip", {"about.json": b"{}", "frames.log": LINE})
        os.utime(path, (n, n))
    size = (tmp_path / "0.zip").stat().st_size
    assert sorted(FileFolder(tmp_path, replace(RECORDINGS, most=4)).prune()) == ["0.zip"]
    assert sorted(FileFolder(tmp_path, replace(RECORDINGS, most_bytes=2 * size)).prune()) == ["1.zip", "2.zip"]
    assert FileFolder(tmp_path, replace(RECORDINGS, most_bytes=1)).prune() == ["3.zip"]
    assert [path.name for path in tmp_path.iterdir()] == ["4.zip"]


def test_leftovers_of_a_killed_process_are_removed(tmp_path: Path) -> None:
    (tmp_path / "a.zip.part").write_bytes(b"half")
    FileFolder(tmp_path, RECORDINGS).tidy()
    assert list(tmp_path.iterdir()) == []


def test_fields_of_a_newer_version_are_ignored() -> None:
    assert read_about(orjson.dumps({**ABOUT, "new": 1}), "a.zip").frames == 0


WRONG: list[dict[str, Any]] = [
    {"format": 2}, {"marks": []}, {"marks": [{}]}, {"frames": -1}, {"reason": "boredom"}, {"servos": [{"uid": "x"}]},
    {"text": "x" * 2001}, {"started_at": "soon"}, {"bus": {"address": "a", "bitrate": 0, "node_id": 1}},
]  # fmt: skip


@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: next(iter(wrong)))
def test_an_invalid_about_is_refused_with_the_field(wrong: dict[str, Any]) -> None:
    with pytest.raises(LogFailed, match=f"^a.zip is no recording that this hornbill can read: {next(iter(wrong))}"):
        read_about(orjson.dumps({**ABOUT, **wrong}), "a.zip")


@given(st.binary(max_size=200))
@example(b"[" * 100_000)
def test_arbitrary_bytes_raise_nothing_but_log_failed(data: bytes) -> None:
    with pytest.raises(LogFailed):
        read_about(data, "a.zip")
    recordings.read_telemetry(data)
    recordings.read_events(data)
    recordings.read_writes(data)


async def test_samples_events_and_writes_are_read_back(tmp_path: Path) -> None:
    writes = [
        RecordedWrite(1001.0, 11, UID, "parameter", "angle_limit_cw", "0x38", 610, 61.0),
        RecordedWrite(1001.0, 11, UID, "parameter", "", "=1+1", -3, "-a"),
        RecordedWrite(1001.0, 11, UID, "opcode", "", 0, 0),
        RecordedWrite(1001.0, 11, UID, "restart"),
        RecordedWrite(1001.0, None, "", "array_command", "unitless", "actuator 7", "", 0.5),
        RecordedWrite(1001.0, None, "", "array_command", "speed", "actuator 8", "", -1.0),
    ]
    file = await RecordingWriter.begin(FileFolder(tmp_path, RECORDINGS), "a.zip")
    await file.add_samples(UID, "current_angle", [101.0, 102.0], [-0.1, None])
    await file.add_events([b'{"a":1}', b'{"a":2}'])
    await file.add_writes(writes)
    await file.finish(About.model_validate(ABOUT))
    with RecordingReader(tmp_path / "a.zip") as recording:
        assert recording.member("telemetry.csv").decode() == (
            f"time,uid,channel,value\n101.000000,{UID},current_angle,-0.1\n102.000000,{UID},current_angle,\n"
        )
        assert recording.member("writes.csv").decode().splitlines() == [
            "time,node_id,uid,kind,key,name,raw,value",
            f"1001.000000,11,{UID},parameter,angle_limit_cw,0x38,610,61.0",
            f"1001.000000,11,{UID},parameter,,'=1+1,-3,'-a",
            f"1001.000000,11,{UID},opcode,,0,0,",
            f"1001.000000,11,{UID},restart,,,,",
            "1001.000000,,,array_command,unitless,actuator 7,,0.5",
            "1001.000000,,,array_command,speed,actuator 8,,-1",
        ]
        (column,), complete = recordings.read_telemetry(recording.member("telemetry.csv"))
        assert recordings.read_events(recording.member("events.jsonl")) == [{"a": 1}, {"a": 2}]
        assert recordings.read_writes(recording.member("writes.csv"))[-1]["name"] == "actuator 8"
        assert recording.about() == About.model_validate(ABOUT)
    assert complete
    assert (column.uid, column.channel, column.t, column.v) == (UID, "current_angle", [101.0, 102.0], [-0.1, None])


def test_telemetry_is_cut_at_its_limit_and_marked_incomplete(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recordings, "SAMPLES_MOST", 10)
    (column,), complete = recordings.read_telemetry(b"time,uid,channel,value\n" + f"1.0,{UID},a,1.0\n".encode() * 20)
    assert (len(column.t), complete) == (10, False)
