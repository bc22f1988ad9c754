"""The recorder of the last ten minutes: its cost on a full bus, and the delay that writing a recording causes."""

import asyncio
import gc
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from bench.line import cpu, line
from bench.stack import BURST_S, saturated_mix
from hornbill.bus.recordings.folder import RECORDINGS, FileFolder
from hornbill.bus.recordings.recording import RecordingWriter
from hornbill.node.hooks import Hooks
from hornbill.schema.catalog import Catalog
from hornbill.servo.host import Host, HostSettings
from hornbill.servo.recorder.frame_ring import FrameRing
from hornbill.servo.recorder.recorder import Recorder
from hornbill.store.store import Store
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort

ROUNDS = 9
FULL_FPS = 7000
MINUTE_S = 60


def figures() -> Iterator[dict[str, Any]]:
    """Share of a core at 7,000 frames a second; then a recording of a full minute."""
    yield keeping()
    yield writing()


def keeping() -> dict[str, Any]:
    """Frames in bursts of a millisecond through the tap's hooks, with and without the recorder."""
    mix = saturated_mix(10)
    bursts: dict[int, list[Frame]] = {}
    for frame in mix:
        bursts.setdefault(int(frame.at / BURST_S), []).append(frame)

    def through(listener: Callable[[Sequence[Frame], bool], None]) -> float:
        hooks: Hooks[Sequence[Frame], bool] = Hooks()
        hooks.append(listener)

        def run() -> None:
            for burst in bursts.values():
                hooks.notify(burst, False)

        return cpu(run)

    gc.collect()
    pairs = [(through(FrameRing().add), through(_ignore)) for _ in range(ROUNDS)]
    ours, alone = (statistics.median(column) for column in zip(*pairs, strict=True))
    each = (ours - alone) / len(mix)
    return line(
        "recorder, a full bus",
        {
            "frames": len(mix), "us_a_frame": round(each * 1e6, 3), "tap_alone_us": round(alone / len(mix) * 1e6, 3),
            "frames_per_s": round(len(mix) / ours), "core_pct": round(each * FULL_FPS * 100, 2),
        },
        must=3.0, of="core_pct", limit="the frames of a full bus, 7,000/s",
    )  # fmt: skip


def writing() -> dict[str, Any]:
    """A minute of a full bus into a recording, on a real clock, while the loop is used every millisecond."""
    return asyncio.run(_writing())


async def _writing() -> dict[str, Any]:
    async def no_port(address: str, bitrate: int) -> CanPort:
        raise NotImplementedError(f"{address} at {bitrate}")

    with tempfile.TemporaryDirectory() as folder, Store("sqlite://") as store:
        host = Host(Catalog.load(), store, no_port, HostSettings(127, bytes(16), (0, 1)))
        box: Recorder = host.recorder
        box.begin(partial(RecordingWriter.begin, FileFolder(Path(folder), RECORDINGS)))
        now = host.base.now()
        mix = saturated_mix(10)
        first, span = mix[0].at, 10.0
        for turn in range(MINUTE_S // 10):
            start = now - MINUTE_S + turn * span - first
            for frame in mix:
                box.ring.add([frame._replace(at=frame.at + start)], frame.id & 0x8000 != 0)
        idle = await _lateness(asyncio.ensure_future(asyncio.sleep(3.0)))
        done = box.trigger("bench", float(MINUTE_S))
        assert box.pending is not None
        box.pending.since, box.pending.until = now - MINUTE_S, now  # the ten seconds after it are not waited for
        began, busy = time.monotonic(), time.thread_time()
        late = await _lateness(done)
        took, cpu_s = time.monotonic() - began, time.thread_time() - busy
        size = (Path(folder) / await done).stat().st_size
        await host.close()
    return line(
        "recorder, a recording of a full minute",
        {
            "frames": len(mix) * MINUTE_S // 10, "s": round(took, 2), "mb": round(size / 1e6, 2),
            "loop_busy_pct": round(cpu_s / took * 100),
            "late_ms_p50": round(late[len(late) // 2], 2),
            "idle_late_ms_p99": round(idle[int(len(idle) * 0.99)], 2),
            "late_ms_p99": round(late[int(len(late) * 0.99)], 2), "late_ms_max": round(late[-1], 2),
        },
        must=10.0, of="late_ms_p99", limit="two switch intervals of the interpreter",
    )  # fmt: skip


async def _lateness(until: "asyncio.Future[Any]") -> list[float]:
    """Delays of the loop in milliseconds, sorted."""
    late: list[float] = []
    while not until.done():
        due = time.monotonic() + 0.001
        await asyncio.sleep(0.001)
        late.append((time.monotonic() - due) * 1000)
    return sorted(late)


def _ignore(_frames: Sequence[Frame], _sent: bool) -> None:
    """Ignore frames."""
