"""The recorder: never in the way of the bus, whatever the disk does."""

import asyncio
import threading
from collections.abc import Awaitable, Callable, Mapping, Sequence
from pathlib import Path

import pytest

from hornbill.bus.recordings import bus_log as module
from hornbill.bus.recordings.bus_log import BATCH_S, BusLog, LogPhase, log_name
from hornbill.bus.recordings.folder import LOGS, FileFolder
from hornbill.bus.recordings.reader import LogReader
from hornbill.bus.recordings.writer import LogFormat, LogWriter
from hornbill.errors import Busy, InvalidValue, LogFailed, Unknown
from hornbill.wire.frame import Frame, LoggedFrame
from jumping_clock import run

UTC = 1_700_000_000.0
Listener = Callable[[Sequence[Frame], bool], None]


class Bench:
    """A recorder with a bus that is only a list of who listens."""

    def __init__(self, folder: Path) -> None:
        self.listeners: list[Listener] = []
        self.events: list[tuple[str, str, str]] = []
        self.address = "socketcan:can0"
        self.recorder = BusLog(
            FileFolder(folder, LOGS),
            listen=self.listen,
            address=lambda: self.address,
            utc=lambda at: at + UTC,
            publish=self.tell,
        )

    def tell(self, level: str, code: str, text: str, params: Mapping[str, object]) -> None:
        self.events.append((level, code, text))

    def listen(self, listener: Listener) -> Callable[[], None]:
        self.listeners.append(listener)
        return lambda: self.listeners.remove(listener) if listener in self.listeners else None

    def say(self, *frames: Frame, sent: bool = False) -> None:
        for listener in tuple(self.listeners):
            listener(frames, sent)

    def codes(self) -> list[str]:
        return [code for _, code, _ in self.events]


def play(folder: Path, scene: Callable[[Bench], Awaitable[None]]) -> None:
    async def all_of_it() -> None:
        await scene(Bench(folder))

    run(all_of_it())


def frame(n: int) -> Frame:
    return Frame(0x1003_F30B, n.to_bytes(4, "big"), 1000.0 + n / 1000)


def read(path: Path) -> list[LoggedFrame]:
    recording = LogReader.open(path)
    found = list(recording)
    recording.close()
    return found


def test_times_never_go_back_although_what_is_received_is_heard_later_than_what_is_sent(tmp_path: Path) -> None:
    async def scene(bench: Bench) -> None:
        await bench.recorder.start(LogFormat.CANDUMP, "bench", 10**6)
        loop = asyncio.get_running_loop()
        for n in range(40):
            now = loop.time()
            bench.say(frame(n)._replace(at=now), sent=True)
            await asyncio.sleep(0.007)
            bench.say(frame(100 + n)._replace(at=now - 0.02), frame(200 + n)._replace(at=now + 0.003))
        await bench.recorder.stop()
        found = read(tmp_path / "bench.log")
        assert len(found) == 120
        times = [each.frame.at for each in found]
        assert times == sorted(times)
        for way in (0, 100, 200):
            own = [int.from_bytes(each.frame.data, "big") for each in found]
            assert [n for n in own if way <= n < way + 40] == list(range(way, way + 40))

    play(tmp_path, scene)


def test_what_was_heard_until_it_is_stopped_is_in_the_file(tmp_path: Path) -> None:
    async def scene(bench: Bench) -> None:
        assert bench.recorder.status.phase is LogPhase.IDLE
        begun = await bench.recorder.start(LogFormat.CANDUMP, "bench", 10**6)
        assert (begun.phase, begun.name, begun.frames) == (LogPhase.RUNNING, "bench.log", 0)
        bench.say(frame(1), frame(2))
        await asyncio.sleep(3 * BATCH_S)
        assert bench.recorder.status.frames == 2
        bench.address = "slcan:/dev/ttyACM0?speed=1"
        bench.say(frame(3), sent=True)
        ended = await bench.recorder.stop()
        assert (ended.phase, ended.frames, ended.dropped, ended.reason) == (LogPhase.STOPPED, 3, 0, None)
        assert bench.listeners == []
        found = read(tmp_path / "bench.log")
        assert [(one.channel, one.sent) for one in found] == [("can0", False), ("can0", False), ("ttyACM0", True)]
        assert [one.frame.at for one in found] == [UTC + 1000.001, UTC + 1000.002, UTC + 1000.003]
        assert ended.size == (tmp_path / "bench.log").stat().st_size
        assert bench.codes() == ["log_started", "log_stopped"]
        assert await bench.recorder.stop() == ended, "twice is harmless"

    play(tmp_path, scene)


def test_what_is_written_is_on_the_disk_soon_and_not_only_at_the_end(tmp_path: Path) -> None:
    async def scene(bench: Bench) -> None:
        await bench.recorder.start(LogFormat.CANDUMP, "bench", 10**6)
        bench.say(frame(1))
        await asyncio.sleep(2 * BATCH_S)
        assert len(read(tmp_path / "bench.log")) == 1
        await bench.recorder.stop()

    play(tmp_path, scene)


def test_a_full_log_ends_by_itself_and_says_so_once(tmp_path: Path) -> None:
    async def scene(bench: Bench) -> None:
        await bench.recorder.start(LogFormat.CANDUMP, "small", 2000)
        for n in range(200):
            bench.say(frame(n))
            await asyncio.sleep(0.01)
        ended = bench.recorder.status
        assert ended.phase is LogPhase.FULL
        assert ended.reason is not None
        assert ended.reason.text == "It reached its limit of 0.002 MB."
        assert (tmp_path / "small.log").stat().st_size == ended.size <= 2000
        assert len(read(tmp_path / "small.log")) == ended.frames > 20
        assert bench.listeners == []
        assert bench.codes() == ["log_started", "log_full"]
        again = await bench.recorder.start(LogFormat.BLF, "next", 2000)
        assert again.phase is LogPhase.RUNNING
        await bench.recorder.stop()

    play(tmp_path, scene)


@pytest.mark.parametrize(
    ("raised", "reason"),
    [
        (OSError(28, "No space left on device"), "No space left on device: free space on the disk of the data folder."),
        (OSError(5, "Input/output error"), "Input/output error."),
        (ValueError("odd"), "It could not be written: odd."),
    ],
)
def test_a_disk_that_fails_ends_the_log_with_the_reason_and_nothing_else(
    raised: Exception, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(_file: LogWriter, _batch: object) -> bool:
        raise raised

    async def scene(bench: Bench) -> None:
        await bench.recorder.start(LogFormat.ASC, "bench", 10**6)
        bench.say(frame(1))
        await asyncio.sleep(0.05)
        monkeypatch.setattr(LogWriter, "write", fail)
        await asyncio.sleep(1)
        ended = bench.recorder.status
        assert (ended.phase, ended.frames) == (LogPhase.FAILED, 0)
        assert ended.reason is not None
        assert ended.reason.text == reason
        bench.say(frame(2))
        assert bench.codes() == ["log_started", "log_failed"]
        level, _, text = bench.events[-1]
        assert level == "warning"
        assert text.startswith(f"The log bench.asc ended. {reason}")
        assert (await bench.recorder.stop()).phase is LogPhase.FAILED

    play(tmp_path, scene)


def test_a_slow_disk_never_slows_the_bus_and_what_it_misses_is_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On the real clock, because it is a real thread that hangs."""
    monkeypatch.setattr(module, "QUEUE_LIMIT", 100)
    go_on = threading.Event()
    write = LogWriter.write

    def slow(file: LogWriter, batch: Sequence[LoggedFrame]) -> bool:
        go_on.wait(10)
        return write(file, batch)

    monkeypatch.setattr(LogWriter, "write", slow)

    async def scene() -> None:
        bench = Bench(tmp_path)
        loop = asyncio.get_running_loop()
        await bench.recorder.start(LogFormat.CANDUMP, "bench", 10**6)
        bench.say(frame(0))
        while bench.recorder._waiting:  # pyright: ignore[reportPrivateUsage]
            await asyncio.sleep(0.01)
        began = loop.time()
        for n in range(250):
            bench.say(frame(n))
        assert loop.time() - began < 0.05
        assert bench.recorder.status.dropped == 150
        go_on.set()
        ended = await bench.recorder.stop()
        assert (ended.phase, ended.frames, ended.dropped) == (LogPhase.STOPPED, 101, 150)
        assert "too slow for 150 frames" in bench.events[-1][2]

    asyncio.run(scene())


def test_a_disk_that_hangs_is_left_to_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CLOSE_S", 0.05)
    go_on = threading.Event()

    def hang(_file: LogWriter, _batch: object) -> bool:
        return go_on.wait(10)

    monkeypatch.setattr(LogWriter, "write", hang)

    async def scene() -> None:
        bench = Bench(tmp_path)
        await bench.recorder.start(LogFormat.CANDUMP, "bench", 10**6)
        bench.say(frame(0))
        ended = await bench.recorder.stop()
        assert ended.phase is LogPhase.FAILED
        assert ended.reason is not None
        assert ended.reason.text == "The disk did not complete it within 0.05 s."
        assert bench.listeners == []
        go_on.set()
        await asyncio.sleep(0.05)
        assert bench.recorder.status == ended

    asyncio.run(scene())


def test_only_one_log_at_a_time(tmp_path: Path) -> None:
    async def scene(bench: Bench) -> None:
        await bench.recorder.start(LogFormat.CANDUMP, None, 10**6)
        with pytest.raises(Busy, match="is already running"):
            await bench.recorder.start(LogFormat.CANDUMP, "other", 10**6)
        name = bench.recorder.status.name
        assert name is not None
        assert name.endswith("Z.log")
        with pytest.raises(Busy, match="is running"):
            await bench.recorder.delete(name)
        await bench.recorder.stop()
        await bench.recorder.delete(name)
        assert bench.recorder.folder.all() == []

    play(tmp_path, scene)


def test_a_log_that_cannot_be_made_is_told_and_another_can_be(tmp_path: Path) -> None:
    (tmp_path / "logs").write_text("a file where the folder should be")

    async def scene(bench: Bench) -> None:
        with pytest.raises(LogFailed, match="cannot be written"):
            await bench.recorder.start(LogFormat.CANDUMP, "bench", 10**6)
        assert bench.recorder.status.phase is LogPhase.FAILED
        (tmp_path / "logs").unlink()
        assert (await bench.recorder.start(LogFormat.CANDUMP, "bench", 10**6)).phase is LogPhase.RUNNING
        await bench.recorder.stop()

    play(tmp_path / "logs", scene)


@pytest.mark.parametrize(
    "name", ["", " ", "..", "../x", "a/b", "a\\b", "/etc/passwd", ".hidden", "x" * 81, "a\0b", "a b", "Ä", "-rf"]
)
def test_names_that_could_leave_the_folder_or_are_odd_are_refused(name: str, tmp_path: Path) -> None:
    folder = FileFolder(tmp_path, LOGS)
    with pytest.raises(InvalidValue, match="is not a valid log name"):
        folder.new(log_name(LogFormat.CANDUMP, name))
    for path in (name, f"{name}.log", f"{name}.log/../x.log"):
        with pytest.raises(Unknown, match="not found"):
            folder.path(path)


def test_the_folder_lists_finds_and_deletes_logs_and_nothing_else(tmp_path: Path) -> None:
    folder = FileFolder(tmp_path / "logs", LOGS)
    assert folder.all() == []
    (tmp_path / "logs").mkdir()
    (tmp_path / "secret.log").write_text("not in the folder")
    for name in ("one.log", "two.blf", "notes.txt"):
        (tmp_path / "logs" / name).write_text(name)
    (tmp_path / "logs" / "folder.log").mkdir()
    assert {one.name for one in folder.all()} == {"one.log", "two.blf"}
    assert {one.size for one in folder.all()} == {7}
    for name in ("notes.txt", "folder.log", "../secret.log", "three.log"):
        with pytest.raises(Unknown, match="not found"):
            folder.delete(name)
    folder.delete("one.log")
    assert [one.name for one in folder.all()] == ["two.blf"]
    with pytest.raises(InvalidValue, match=r"A log two\.blf exists already"):
        folder.new(log_name(LogFormat.BLF, "two"))
    assert folder.new(log_name(LogFormat.BLF, "three.blf")).name == "three.blf", (
        "an ending that is given is not doubled"
    )


def test_a_stop_while_the_file_is_still_being_made_ends_that_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    go = threading.Event()

    def slowly(path: Path, form: LogFormat, limit: int) -> LogWriter:
        go.wait(5)
        return LogWriter(path, form, limit)

    monkeypatch.setattr(module, "LogWriter", slowly)

    async def scene() -> None:
        bench = Bench(tmp_path)
        starting = asyncio.create_task(bench.recorder.start(LogFormat.CANDUMP, "bench", 10**6))
        await asyncio.sleep(0)
        stopping = asyncio.create_task(bench.recorder.stop())
        await asyncio.sleep(0)
        go.set()
        await starting
        assert (await stopping).phase is LogPhase.STOPPED
        assert bench.listeners == []

    asyncio.run(scene())
