"""A crowd of streaming servos on a serial adapter, the server as a user starts it, one WebSocket: its CPU time."""

import asyncio
import os
import pty
import re
import subprocess
import sys
import tempfile
import time
import tty
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import orjson
from websockets.asyncio.client import connect

from bench.line import line

SERVOS = 125
MEASURED_S = 15.0
TOPICS = ["servos", "telemetry", "events", "jobs", "bus"]
"""The subscription of the page, for every servo."""

SERVER = [sys.executable, "-m", "hornbill"]


def figures() -> Iterator[dict[str, Any]]:
    """Share of a core the server takes, its background polling and its adapter included.

    `us_a_sample` compares versions: one that polls more sends more samples.
    """
    with _crowd() as device, _server(device) as (server, url):
        _wait_until_ready(url)
        seen, share = asyncio.run(_watch(server.pid, url.replace("http", "ws") + "api/v1/ws"))
        bus = httpx.get(url + "api/v1/bus").json()
    figures = {
        "servos": SERVOS, "core_pct": round(share * 100, 1),
        "us_a_sample": round(share * 1e6 * MEASURED_S / seen.samples),
        "samples_per_s": round(seen.samples / MEASURED_S),
        "messages_per_s": round(seen.messages / MEASURED_S), "kB_per_s": round(seen.bytes / MEASURED_S / 1000),
        "rx_fps": bus["rx_fps"], "tx_fps": bus["tx_fps"],
    }  # fmt: skip
    yield line("125 servos stream into the server, one WebSocket", figures, of="core_pct", must=35, aim=15)


@dataclass
class _Seen:
    messages: int = 0
    bytes: int = 0
    samples: int = 0


async def _watch(server: int, address: str) -> tuple[_Seen, float]:
    """Messages over one socket in MEASURED_S, and the CPU seconds per second of the server."""
    async with connect(address, max_size=None) as socket:
        await socket.send(orjson.dumps({"type": "subscribe", "topics": TOPICS}).decode())
        async with asyncio.timeout(2.0):
            while True:  # what was recalled at the start is not what streaming costs
                await socket.recv()
                if orjson.loads(await socket.recv())["type"] == "telemetry":
                    break
        await asyncio.sleep(1.0)
        seen, began, cpu = _Seen(), time.monotonic(), _cpu_s(server)
        while time.monotonic() - began < MEASURED_S:
            text = await socket.recv()
            seen.messages += 1
            seen.bytes += len(text)
            message = orjson.loads(text)
            if message["type"] == "telemetry":
                seen.samples += sum(len(column["t"]) for column in message["channels"].values())
        return seen, (_cpu_s(server) - cpu) / (time.monotonic() - began)


def _cpu_s(process: int) -> float:
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(") ")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _wait_until_ready(url: str) -> None:
    until = time.monotonic() + 60
    while sum(one["state"] == "ready" for one in httpx.get(url + "api/v1/servos", timeout=30).json()) < SERVOS:
        assert time.monotonic() < until, f"not all {SERVOS} servos are ready after a minute"
        time.sleep(0.5)


@contextmanager
def _server(device: str) -> Generator[tuple[subprocess.Popen[str], str]]:
    with tempfile.TemporaryDirectory() as folder:
        command = [*SERVER, "serve", "--port", "0", "--data-dir", folder, "--bus", f"slcan:{device}"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            try:
                assert process.stdout is not None
                found = re.search(r"http://\S+/", process.stdout.readline())
                assert found is not None, "the server printed no address"
                yield process, found[0]
            finally:
                process.terminate()
                process.wait(timeout=10)


@contextmanager
def _crowd() -> Generator[str]:
    """The device of a serial adapter with servos behind it, in a separate process."""
    theirs, ours = pty.openpty()
    tty.setraw(ours)
    command = [sys.executable, "-m", "bench.serial_crowd", str(theirs), str(SERVOS)]
    with subprocess.Popen(command, pass_fds=(theirs,), cwd=Path(__file__).parents[1]) as process:
        try:
            yield os.ttyname(ours)
        finally:
            process.terminate()
            os.close(ours)
            os.close(theirs)
