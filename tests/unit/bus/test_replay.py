"""Replay of a recording: original spacing or scaled, read-only, and robust against damaged files."""

import asyncio
import os
import threading
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from itertools import pairwise
from pathlib import Path

import pytest

from hornbill.bus.recordings import replay
from hornbill.bus.recordings.reader import LogReader
from hornbill.bus.recordings.replay import ReplayPort, open_replay, parse
from hornbill.bus.recordings.writer import LogFormat, LogWriter
from hornbill.errors import BusDisconnected, BusReadOnly, PortOpenFailed
from hornbill.wire.bittime import frame_bits
from hornbill.wire.frame import Frame, LoggedFrame
from hornbill.wire.port import PortState, PortStatistics

UTC = 1_700_000_000.0


def frame(at: float, n: int = 0) -> Frame:
    return Frame(0x1003_F30B, n.to_bytes(4, "big"), UTC + at)


def recording(folder: Path, *frames: Frame, form: LogFormat = LogFormat.CANDUMP) -> Path:
    path = folder / "recording"
    file = LogWriter(path, form, 10**9)
    file.write(LoggedFrame(one, "can0", False) for one in frames)
    file.close()
    return path


@asynccontextmanager
async def replaying(
    address: object, folder: Path | None = None, *, idle_s: float = 0.0
) -> AsyncGenerator[tuple[ReplayPort, list[Frame]]]:
    """An open replay of `address`, and the frames received from it."""
    received: list[Frame] = []
    port = await open_replay(f"file:{address}", folder=folder)
    await asyncio.sleep(idle_s)
    port.listen(received.extend)
    try:
        yield port, received
    finally:
        await port.close()


@pytest.mark.parametrize("form", LogFormat)
@pytest.mark.parametrize("speed", [1.0, 2.0, 0.5])
async def test_frames_keep_their_spacing_divided_by_the_speed(form: LogFormat, speed: float, tmp_path: Path) -> None:
    path = recording(tmp_path, frame(0.25), frame(0.2504), frame(1.25), frame(61.25), form=form)
    loop = asyncio.get_running_loop()
    arrivals: list[float] = []
    async with replaying(f"{path}?speed={speed:g}") as (port, received):
        began = loop.time()
        port.listen(lambda frames: arrivals.extend(loop.time() for _ in frames) or received.extend(frames))
        await asyncio.sleep(70 / speed)
    after = [0.0, 0.0004 / speed, 1.0 / speed, 61.0 / speed]
    assert [one.at - began for one in received] == pytest.approx(after, abs=3e-6)
    assert [at - began for at in arrivals] == pytest.approx(after, abs=0.0011), "resolution of a loop's timers"


async def test_replay_begins_with_the_first_listener_and_stays_active_and_read_only_at_its_end(tmp_path: Path) -> None:
    path = recording(tmp_path, frame(0), frame(1))
    async with replaying(path, idle_s=10) as (port, received):
        assert (port.state, port.trouble, port.retry_in_s, port.sample_point) == (PortState.ACTIVE, None, None, None)
        with pytest.raises(BusReadOnly, match="is a recording and read-only"):
            port.send([frame(0), frame(1)])
        with pytest.raises(ValueError, match="29 bits"):
            port.send([Frame(1 << 29, b"")])
        assert (port.refused, port.statistics) == (2, PortStatistics())
        await asyncio.sleep(0.5)
        assert (len(received), port.ended) == (1, False)
        await asyncio.sleep(3600)
        assert (len(received), port.ended, port.state) == (2, True, PortState.ACTIVE)
        assert "has ended" in str(port.trouble)
        assert port.statistics.rx_frames == 2
        assert port.statistics.busy_s == pytest.approx(2 * frame_bits(received[0]) / 1e6, rel=0.1)


async def test_closing_ends_it_at_once_and_is_idempotent(tmp_path: Path) -> None:
    path = recording(tmp_path, *(frame(n / 10, n) for n in range(2000)))
    async with replaying(path) as (port, received):
        await asyncio.sleep(1.05)
        await port.close()
        await port.close()
        assert port.state is PortState.DISCONNECTED
        with pytest.raises(BusDisconnected, match="has stopped"):
            port.send([frame(0)])
        await asyncio.sleep(300)
        assert len(received) == 11


async def test_a_long_recording_is_read_as_it_is_played(tmp_path: Path) -> None:
    path = recording(tmp_path, *(frame(n / 1000, n) for n in range(5000)))
    async with replaying(path) as (port, received):
        await asyncio.sleep(1.0)
        assert port._recording.counters.frames <= 2 * 512 + 512  # pyright: ignore[reportPrivateUsage]
        await asyncio.sleep(5)
    assert [int.from_bytes(one.data, "big") for one in received] == list(range(5000))
    gaps = [after.at - before.at for before, after in pairwise(received)]
    assert max(abs(gap - 0.001) for gap in gaps) < 5e-6


async def test_a_recording_that_steps_back_in_time_or_has_other_lines_continues_without_a_pause(tmp_path: Path) -> None:
    path = recording(tmp_path, frame(10), frame(10.1), frame(10.2))
    lines = "garbage", f"({UTC + 3:.6f}) can0 1003F30B#AA", "(1.0) can0 123#00", "(1.0) can0 20000004#0000000000000000"
    path.write_text("\n".join((path.read_text(), *lines, f"({UTC + 10.3:.6f}) can0 1003F30B#BB")))
    async with replaying(path) as (port, received):
        await asyncio.sleep(0.35)
        assert len(received) == 5
        seen = port.statistics
        assert (seen.rx_frames, seen.ignored, seen.error_frames, seen.errors) == (5, 1, 1, 2)
        assert [one.at for one in received] == sorted(one.at for one in received)


async def test_a_damaged_file_is_lost_with_the_reason(tmp_path: Path) -> None:
    path = recording(tmp_path, *(frame(n / 100, n) for n in range(6000)), form=LogFormat.BLF)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2] + b"\xff" * 4000)
    async with replaying(path) as (port, received):
        await asyncio.sleep(120)
        assert 500 < len(received) < 6000
        assert port.state is PortState.LOST
        assert "damaged" in str(port.trouble)


async def test_a_bare_name_may_be_one_of_the_logs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    logs, here = tmp_path / "logs", tmp_path / "here"
    logs.mkdir()
    here.mkdir()
    monkeypatch.chdir(here)
    for folder, number in ((logs, 1), (here, 2)):  # the working folder takes precedence
        recording(folder, frame(0, number))
        async with replaying("recording", folder=logs) as (_, received):
            await asyncio.sleep(1)
        assert received[0].data[-1] == number


@pytest.mark.parametrize(
    ("address", "path", "speed"),
    [
        ("file:a.log", "a.log", 1.0),
        ("file:/x/a b.log?speed=2", "/x/a b.log", 2.0),
        ("file:a?b.log", "a?b.log", 1.0),
        ("file: a.log ?speed=0.01", "a.log", 0.01),
        ("file:C:/a.log?speed=1000", "C:/a.log", 1000.0),
    ],
)
def test_an_address_is_a_file_and_an_optional_speed(address: str, path: str, speed: float) -> None:
    assert parse(address) == (Path(path), speed)


@pytest.mark.parametrize(
    ("address", "detail"),
    [
        ("file:", "has no file name"),
        ("file:?speed=2", "has no file name"),
        ("file:a.log?speed=0", "not a valid speed"),
        ("file:a.log?speed=fast", "not a valid speed"),
        ("file:a.log?speed=nan", "not a valid speed"),
        ("file:a.log?speed=1e9", "not a valid speed"),
        ("file:/nowhere/a.log", "cannot be read: No such file"),
        ("file:/", "Is a directory"),
        ("file:a.log", "0 bit/s is not a valid bit rate"),
    ],
)
async def test_an_invalid_address_or_bit_rate_is_refused_with_the_reason(address: str, detail: str) -> None:
    with pytest.raises(PortOpenFailed, match=detail) as caught:
        await open_replay(address, bitrate=0 if "bit rate" in detail else 1_000_000)
    assert caught.value.facts["address"] == address


async def test_a_failing_listener_is_logged_and_ends_the_replay(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = recording(tmp_path, frame(0), frame(1))

    def fail(_frames: list[Frame]) -> None:
        raise RuntimeError("odd")

    async with replaying(path) as (port, _):
        port.listen(fail)
        await asyncio.sleep(5)
        assert port.state is PortState.LOST
        assert port.trouble is not None
        assert "odd" in caplog.text


@pytest.mark.parametrize("name", ["pipe", "no\0name", "x" * 5000, "/dev/zero", "standard.log"])
async def test_a_path_that_is_not_a_recording_is_refused_at_once(name: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "standard.log").write_text("(1.0) can0 123#00\n")
    expected = "no CAN frames with 29-bit identifiers" if name == "standard.log" else "file"
    with pytest.raises(PortOpenFailed, match=expected):
        await asyncio.wait_for(open_replay(f"file:{name}", folder=tmp_path), 5)


@pytest.mark.real_time
async def test_opening_times_out_and_a_late_file_is_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, go, closed = recording(tmp_path, frame(1)), threading.Event(), threading.Event()
    begin, close = LogReader.open, LogReader.close

    def slowly(path: Path) -> LogReader:
        go.wait(5)
        return begin(path)

    def close_and_signal(one: LogReader) -> None:
        close(one)
        closed.set()

    monkeypatch.setattr(replay, "OPEN_S", 0.05)
    monkeypatch.setattr(LogReader, "open", slowly)
    monkeypatch.setattr(LogReader, "close", close_and_signal)
    with pytest.raises(PortOpenFailed, match=r"within 0.05 s"):
        await open_replay(f"file:{path}")
    assert not closed.is_set()
    go.set()
    async with asyncio.timeout(5):
        while not closed.is_set():
            await asyncio.sleep(0.01)
