"""A recording as a bus: its own time, faithfully or faster; and nothing that is sent on it goes anywhere."""

import asyncio
import os
import threading
from collections.abc import Awaitable, Callable
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
from hornbill.wire.port import PortState
from jumping_clock import run

UTC = 1_700_000_000.0


def frame(at: float, n: int = 0) -> Frame:
    return Frame(0x1003_F30B, n.to_bytes(4, "big"), UTC + at)


def recording(folder: Path, *frames: Frame, form: LogFormat = LogFormat.CANDUMP) -> Path:
    path = folder / "recording"
    file = LogWriter(path, form, 10**9)
    file.write(LoggedFrame(one, "can0", False) for one in frames)
    file.close()
    return path


def play(
    address: str, scene: Callable[[ReplayPort, list[Frame]], Awaitable[None]], folder: Path | None = None
) -> list[Frame]:
    """Let `scene` listen to a recording on a clock that jumps; the frames heard."""
    heard: list[Frame] = []

    async def all_of_it() -> None:
        port = await open_replay(address, folder=folder)
        port.listen(heard.extend)
        try:
            await scene(port, heard)
        finally:
            await port.close()

    run(all_of_it())
    return heard


@pytest.mark.parametrize("form", LogFormat)
@pytest.mark.parametrize("speed", [1.0, 2.0, 0.5])
def test_frames_come_with_the_spacing_they_had(form: LogFormat, speed: float, tmp_path: Path) -> None:
    path = recording(tmp_path, frame(0.25), frame(0.2504), frame(1.25), frame(61.25), form=form)
    began: list[float] = []
    came: list[float] = []

    async def scene(port: ReplayPort, heard: list[Frame]) -> None:
        loop = asyncio.get_running_loop()
        began.append(loop.time())
        port.listen(lambda frames: came.extend(loop.time() for _ in frames) or heard.extend(frames))
        await asyncio.sleep(70 / speed)

    heard = play(f"file:{path}?speed={speed:g}", scene)
    after = [0.0, 0.0004 / speed, 1.0 / speed, 61.0 / speed]
    assert [one.at - began[0] for one in heard] == pytest.approx(after, abs=3e-6)
    assert [at - began[0] for at in came] == pytest.approx(after, abs=0.0011), "a loop's timers are no finer"


def test_it_begins_when_somebody_listens_and_tells_its_end_without_being_lost(tmp_path: Path) -> None:
    path = recording(tmp_path, frame(0), frame(1))

    async def scene(port: ReplayPort, heard: list[Frame]) -> None:
        assert (port.state, port.trouble, port.retry_in_s, port.sample_point) == (PortState.ACTIVE, None, None, None)
        await asyncio.sleep(0.5)
        assert len(heard) == 1
        assert not port.ended
        await asyncio.sleep(3600)
        assert len(heard) == 2
        assert port.ended
        assert port.state is PortState.ACTIVE
        assert port.trouble is not None
        assert "has ended" in str(port.trouble)
        assert port.statistics.rx_frames == 2
        assert port.statistics.busy_s == pytest.approx(2 * frame_bits(heard[0]) / 1e6, rel=0.1)

    play(f"file:{path}", scene)


def test_nothing_is_played_before_anybody_listens(tmp_path: Path) -> None:
    path = recording(tmp_path, frame(0), frame(1))

    async def scene() -> None:
        port = await open_replay(f"file:{path}")
        await asyncio.sleep(10)
        heard: list[Frame] = []
        port.listen(heard.extend)
        await asyncio.sleep(2)
        await port.close()
        assert len(heard) == 2

    run(scene())


def test_nothing_can_be_sent_and_that_is_said(tmp_path: Path) -> None:
    path = recording(tmp_path, frame(0), frame(1))

    async def scene(port: ReplayPort, heard: list[Frame]) -> None:
        with pytest.raises(BusReadOnly, match="is a recording and read-only"):
            port.send([frame(0), frame(1)])
        with pytest.raises(ValueError, match="29 bits"):
            port.send([Frame(1 << 29, b"")])
        assert (port.refused, port.statistics.tx_frames, port.statistics.errors) == (2, 0, 0)
        await asyncio.sleep(5)
        assert len(heard) == 2
        await port.close()
        assert port.state is PortState.DISCONNECTED
        with pytest.raises(BusDisconnected, match="has stopped"):
            port.send([frame(0)])

    play(f"file:{path}", scene)


def test_closing_ends_it_at_once_and_twice_is_harmless(tmp_path: Path) -> None:
    path = recording(tmp_path, *(frame(n / 10, n) for n in range(2000)))

    async def scene(port: ReplayPort, heard: list[Frame]) -> None:
        await asyncio.sleep(1.05)
        await port.close()
        await port.close()
        assert len(heard) == 11
        await asyncio.sleep(300)
        assert len(heard) == 11

    play(f"file:{path}", scene)


def test_a_long_recording_is_read_as_it_is_played(tmp_path: Path) -> None:
    path = recording(tmp_path, *(frame(n / 1000, n) for n in range(5000)))

    async def scene(port: ReplayPort, heard: list[Frame]) -> None:
        await asyncio.sleep(1.0)
        assert port._recording.counters.frames <= 2 * 512 + 512  # pyright: ignore[reportPrivateUsage]
        await asyncio.sleep(5)

    heard = play(f"file:{path}", scene)
    assert [int.from_bytes(one.data, "big") for one in heard] == list(range(5000))
    gaps = [after.at - before.at for before, after in pairwise(heard)]
    assert max(abs(gap - 0.001) for gap in gaps) < 5e-6


def test_a_recording_that_steps_back_in_time_goes_on_without_a_pause(tmp_path: Path) -> None:
    path = recording(tmp_path, frame(10), frame(10.1), frame(10.2))
    path.write_text(path.read_text() + f"({UTC + 3:.6f}) can0 1003F30B#AA\n({UTC + 10.3:.6f}) can0 1003F30B#BB\n")

    async def scene(_port: ReplayPort, heard: list[Frame]) -> None:
        await asyncio.sleep(0.35)
        assert len(heard) == 5
        assert [one.at for one in heard] == sorted(one.at for one in heard)

    play(f"file:{path}", scene)


def test_what_is_no_frame_is_counted(tmp_path: Path) -> None:
    path = recording(tmp_path, frame(0), frame(1))
    path.write_text(
        path.read_text() + "garbage\n(1700000001.1) can0 123#00\n(1700000001.1) can0 20000004#0000000000000000\n"
    )

    async def scene(port: ReplayPort, _heard: list[Frame]) -> None:
        await asyncio.sleep(5)
        seen = port.statistics
        assert (seen.rx_frames, seen.ignored, seen.error_frames, seen.errors) == (2, 1, 1, 2)

    play(f"file:{path}", scene)


def test_a_file_that_turns_out_damaged_is_lost_with_the_reason(tmp_path: Path) -> None:
    path = recording(tmp_path, *(frame(n / 100, n) for n in range(6000)), form=LogFormat.BLF)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2] + b"\xff" * 4000)

    async def scene(port: ReplayPort, heard: list[Frame]) -> None:
        await asyncio.sleep(120)
        assert 500 < len(heard) < 6000
        assert port.state is PortState.LOST
        assert port.trouble is not None
        assert "damaged" in str(port.trouble)

    play(f"file:{path}", scene)


def test_a_bare_name_may_be_one_of_the_logs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    logs, here = tmp_path / "logs", tmp_path / "here"
    logs.mkdir()
    here.mkdir()
    monkeypatch.chdir(here)
    recording(logs, frame(0, 1))

    async def scene(_port: ReplayPort, _heard: list[Frame]) -> None:
        await asyncio.sleep(1)

    assert play("file:recording", scene, folder=logs)[0].data[-1] == 1
    recording(here, frame(0, 2))
    assert play("file:recording", scene, folder=logs)[0].data[-1] == 2, "what is here comes first"


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
def test_an_address_is_a_file_and_perhaps_a_speed(address: str, path: str, speed: float) -> None:
    assert parse(address) == (Path(path), speed)


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("file:", "has no file name"),
        ("file:?speed=2", "has no file name"),
        ("file:a.log?speed=0", "not a valid speed"),
        ("file:a.log?speed=fast", "not a valid speed"),
        ("file:a.log?speed=nan", "not a valid speed"),
        ("file:a.log?speed=1e9", "not a valid speed"),
        ("file:/nowhere/a.log", "cannot be read: No such file"),
        ("file:/", "Is a directory"),
    ],
)
def test_what_cannot_be_played_says_why(address: str, said: str) -> None:
    async def scene() -> None:
        with pytest.raises(PortOpenFailed, match=said) as caught:
            await open_replay(address)
        assert caught.value.facts["address"] == address

    run(scene())


def test_a_file_without_frames_of_ours_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "standard.log"
    path.write_text("(1.0) can0 123#00\n")

    async def scene() -> None:
        with pytest.raises(PortOpenFailed, match="no CAN frames with 29-bit identifiers"):
            await open_replay(f"file:{path}")

    run(scene())


def test_a_listener_that_fails_does_not_end_in_silence(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = recording(tmp_path, frame(0), frame(1))

    def fail(_frames: list[Frame]) -> None:
        raise RuntimeError("odd")

    async def scene(port: ReplayPort, _heard: list[Frame]) -> None:
        port.listen(fail)
        await asyncio.sleep(5)
        assert port.state is PortState.LOST
        assert port.trouble is not None
        assert "odd" in caplog.text

    play(f"file:{path}", scene)


@pytest.mark.parametrize("name", ["pipe", "no\0name", "x" * 5000, "/dev/zero"])
def test_what_is_no_file_is_refused_at_once_and_never_waited_for(name: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")

    async def open_it() -> None:
        with pytest.raises(PortOpenFailed, match="file"):
            await asyncio.wait_for(open_replay(f"file:{name}", folder=tmp_path), 5)

    run(open_it())


def test_a_file_that_shows_no_frame_is_given_up_and_closed_when_it_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, go, closed = recording(tmp_path, frame(1)), threading.Event(), threading.Event()
    begin, close = LogReader.open, LogReader.close

    def slowly(path: Path) -> LogReader:
        go.wait(5)
        return begin(path)

    def close_and_tell(one: LogReader) -> None:
        close(one)
        closed.set()

    monkeypatch.setattr(replay, "OPEN_S", 0.05)
    monkeypatch.setattr(LogReader, "open", slowly)
    monkeypatch.setattr(LogReader, "close", close_and_tell)

    async def open_it() -> None:
        with pytest.raises(PortOpenFailed, match=r"within 0.05 s"):
            await open_replay(f"file:{path}")
        assert not closed.is_set()
        go.set()
        async with asyncio.timeout(5):
            while not closed.is_set():
                await asyncio.sleep(0.01)

    asyncio.run(open_it())


def test_a_bit_rate_that_is_none_is_refused(tmp_path: Path) -> None:
    path = recording(tmp_path, frame(1))
    with pytest.raises(PortOpenFailed, match="bit/s"):
        run(open_replay(f"file:{path}", bitrate=0))
