"""The bus log: complete and in order, bounded, and never a burden for the bus."""

import asyncio
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from hornbill.bus.recordings import bus_log as module
from hornbill.bus.recordings.bus_log import BATCH_S, BusLog, LogPhase
from hornbill.bus.recordings.folder import LOGS, FileFolder
from hornbill.bus.recordings.reader import LogReader
from hornbill.bus.recordings.writer import LogFormat, LogWriter
from hornbill.errors import LogFailed
from hornbill.wire.frame import Frame, LoggedFrame

UTC = 1_700_000_000.0
Listener = Callable[[Sequence[Frame], bool], None]


class Bench:
    """A recorder, and a bus that is only a list of listeners."""

    def __init__(self, folder: Path) -> None:
        self.listeners: list[Listener] = []
        self.events: list[tuple[str, str, str]] = []
        self.address = "socketcan:can0"
        self.recorder = BusLog(
            FileFolder(folder, LOGS), listen=self.listen, address=lambda: self.address, utc=lambda at: at + UTC,
            publish=lambda level, code, text, params: self.events.append((level, code, text)),
        )  # fmt: skip

    def listen(self, listener: Listener) -> Callable[[], None]:
        self.listeners.append(listener)
        return lambda: self.listeners.remove(listener) if listener in self.listeners else None

    def transfer(self, *frames: Frame, sent: bool = False) -> None:
        for listener in tuple(self.listeners):
            listener(frames, sent)

    def codes(self) -> list[str]:
        return [code for _, code, _ in self.events]


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def frame(n: int) -> Frame:
    return Frame(0x1003_F30B, n.to_bytes(4, "big"), 1000.0 + n / 1000)


def read(path: Path) -> list[LoggedFrame]:
    recording = LogReader.open(path)
    found = list(recording)
    recording.close()
    return found


async def test_timestamps_are_sorted_although_received_frames_arrive_later_than_sent_ones(
    bench: Bench, tmp_path: Path
) -> None:
    await bench.recorder.start(LogFormat.CANDUMP, "bench", 10**6)
    loop = asyncio.get_running_loop()
    for n in range(40):
        now = loop.time()
        bench.transfer(frame(n)._replace(at=now), sent=True)
        await asyncio.sleep(0.007)
        bench.transfer(frame(100 + n)._replace(at=now - 0.02), frame(200 + n)._replace(at=now + 0.003))
    await bench.recorder.stop()
    found = read(tmp_path / "bench.log")
    assert len(found) == 120
    times = [each.frame.at for each in found]
    assert times == sorted(times)
    for first in (0, 100, 200):
        own = [int.from_bytes(each.frame.data, "big") for each in found]
        assert [n for n in own if first <= n < first + 40] == list(range(first, first + 40))


async def test_the_file_contains_every_frame_until_the_stop(bench: Bench, tmp_path: Path) -> None:
    begun = await bench.recorder.start(LogFormat.CANDUMP, "bench", 10**6)
    assert (begun.phase, begun.name, begun.frames) == (LogPhase.RUNNING, "bench.log", 0)
    bench.transfer(frame(1), frame(2))
    await asyncio.sleep(2 * BATCH_S)
    assert len(read(tmp_path / "bench.log")) == 2, "written within two batches"
    await asyncio.sleep(BATCH_S)
    assert bench.recorder.status.frames == 2
    bench.address = "slcan:/dev/ttyACM0?speed=1"
    bench.transfer(frame(3), sent=True)
    ended = await bench.recorder.stop()
    assert (ended.phase, ended.frames, ended.dropped, ended.reason) == (LogPhase.STOPPED, 3, 0, None)
    assert bench.listeners == []
    found = read(tmp_path / "bench.log")
    assert [(one.channel, one.sent) for one in found] == [("can0", False), ("can0", False), ("ttyACM0", True)]
    assert [one.frame.at for one in found] == [UTC + 1000.001, UTC + 1000.002, UTC + 1000.003]
    assert bench.codes() == ["log_started", "log_stopped"]
    assert await bench.recorder.stop() == ended, "idempotent"


@pytest.mark.parametrize(
    ("raised", "reason"),
    [
        (OSError(5, "Input/output error"), "Input/output error."),
        (ValueError("odd"), "It could not be written: odd."),
    ],
)
async def test_a_failing_disk_ends_the_log_with_the_reason(
    bench: Bench, raised: Exception, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_file: LogWriter, _batch: object) -> bool:
        raise raised

    await bench.recorder.start(LogFormat.ASC, "bench", 10**6)
    bench.transfer(frame(1))
    await asyncio.sleep(0.05)
    monkeypatch.setattr(LogWriter, "write", fail)
    await asyncio.sleep(1)
    ended = bench.recorder.status
    assert (ended.phase, ended.frames) == (LogPhase.FAILED, 0)
    assert ended.reason is not None
    assert ended.reason.text == reason
    assert bench.listeners == []
    assert bench.codes() == ["log_started", "log_failed"]
    level, _, text = bench.events[-1]
    assert level == "warning"
    assert text.startswith(f"The log bench.asc ended. {reason}")
    assert (await bench.recorder.stop()).phase is LogPhase.FAILED


@pytest.mark.real_time
async def test_a_slow_disk_never_slows_the_bus_and_dropped_frames_are_counted(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In real time, because a real thread hangs."""
    monkeypatch.setattr(module, "QUEUE_LIMIT", 100)
    go_on = threading.Event()
    write = LogWriter.write

    def slow(file: LogWriter, batch: Sequence[LoggedFrame]) -> bool:
        go_on.wait(10)
        return write(file, batch)

    monkeypatch.setattr(LogWriter, "write", slow)
    await bench.recorder.start(LogFormat.CANDUMP, "bench", 10**6)
    bench.transfer(frame(0))
    while bench.recorder._waiting:  # pyright: ignore[reportPrivateUsage]
        await asyncio.sleep(0.01)
    for n in range(250):
        bench.transfer(frame(n))  # would time out in the hanging disk if it waited
    assert bench.recorder.status.dropped == 150
    go_on.set()
    ended = await bench.recorder.stop()
    assert (ended.phase, ended.frames, ended.dropped) == (LogPhase.STOPPED, 101, 150)
    assert "too slow for 150 frames" in bench.events[-1][2]


@pytest.mark.real_time
async def test_a_hanging_disk_is_abandoned(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CLOSE_S", 0.05)
    go_on = threading.Event()

    def hang(_file: LogWriter, _batch: object) -> bool:
        return go_on.wait(10)

    monkeypatch.setattr(LogWriter, "write", hang)
    await bench.recorder.start(LogFormat.CANDUMP, "bench", 10**6)
    bench.transfer(frame(0))
    ended = await bench.recorder.stop()
    assert ended.phase is LogPhase.FAILED
    assert ended.reason is not None
    assert ended.reason.text == "The disk did not complete it within 0.05 s."
    assert bench.listeners == []
    go_on.set()
    await asyncio.sleep(0.05)
    assert bench.recorder.status == ended


async def test_a_log_that_cannot_be_created_is_reported_and_another_can_be_started(tmp_path: Path) -> None:
    bench = Bench(tmp_path / "logs")
    (tmp_path / "logs").write_text("a file where the folder should be")
    with pytest.raises(LogFailed, match="cannot be written"):
        await bench.recorder.start(LogFormat.CANDUMP, "bench", 10**6)
    assert bench.recorder.status.phase is LogPhase.FAILED
    (tmp_path / "logs").unlink()
    started = await bench.recorder.start(LogFormat.CANDUMP, None, 10**6)
    assert started.phase is LogPhase.RUNNING
    assert (started.name or "").endswith("Z.log")
    await bench.recorder.stop()


@pytest.mark.real_time
async def test_a_stop_while_the_file_is_being_created_ends_that_log(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    go = threading.Event()

    def slowly(path: Path, form: LogFormat, limit: int) -> LogWriter:
        go.wait(5)
        return LogWriter(path, form, limit)

    monkeypatch.setattr(module, "LogWriter", slowly)
    starting = asyncio.create_task(bench.recorder.start(LogFormat.CANDUMP, "bench", 10**6))
    await asyncio.sleep(0)
    stopping = asyncio.create_task(bench.recorder.stop())
    await asyncio.sleep(0)
    go.set()
    await starting
    assert (await stopping).phase is LogPhase.STOPPED
    assert bench.listeners == []
