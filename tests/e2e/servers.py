"""Servers for browser tests that stop one, start without a bus, or add all servos."""

import os
import re
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from socket import socket
from subprocess import PIPE, Popen

import httpx

from e2e import preloaded


@dataclass(frozen=True)
class Server:
    """A running server: its process, its address, and a client of it."""

    process: preloaded.Forked
    url: str
    api: httpx.Client

    def servos(self) -> list[dict[str, object]]:
        """The response of GET /servos."""
        return self.api.get("/servos").json()

    def ready(self, number: int, within_s: float = 120) -> list[str]:
        """Wait until `number` servos are ready. Returns their UIDs."""
        found: list[str] = []

        def enough() -> bool:
            found[:] = [str(one["uid"]) for one in self.servos() if one["state"] == "ready"]
            return len(found) >= number

        until(enough, within_s, f"not {number} servos are ready")
        return found


def until(what: Callable[[], bool], within_s: float, message: str) -> None:
    """Wait until `what` is true. Fails with `message` after `within_s`."""
    end = time.monotonic() + within_s
    while not what():
        assert time.monotonic() < end, message
        time.sleep(0.1)


_ports: list[int] = []
"""Ports of earlier servers of this process, reused because a browser caches downloads and scripts by host and port."""
_in_use: set[int] = set()


def _next_port() -> int:
    """An unused port below the kernel's ephemeral range."""
    for port in _ports:
        if port not in _in_use:
            return port
    random = Random(os.getpid() + len(_ports))
    while True:
        port = random.randrange(20_000, 32_000)
        with socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
        _ports.append(port)
        return port


@contextmanager
def running(*words: str, port: int | None = None) -> Generator[Server]:
    """`hornbill` with these arguments, on `port` if given. Ended with the block, also while stopped."""
    port = _next_port() if port is None else port
    _in_use.add(port)
    process = preloaded.start(*words, "--port", str(port))
    try:
        line = process.stdout.readline()
        found = re.search(r"https?://\S+/", line)
        assert found is not None, f"{words} printed no address but {line!r}"
        with httpx.Client(base_url=found[0] + "api/v1", timeout=30) as api:
            yield Server(process, found[0], api)
    finally:
        process.end()
        _in_use.discard(port)


def serving(folder: Path, *flags: str) -> tuple[str, ...]:
    """Arguments of `hornbill serve` with its own data folder."""
    return ("serve", "--data-dir", str(folder), *flags)


def as_in_rom(api: httpx.Client, uid: str) -> None:
    """Restart a servo whose RAM differs from ROM, or whose ROM is unknown: its save needs confirmation."""
    unsaved = api.get(f"/servos/{uid}").json()["unsaved"]
    if unsaved or api.get(f"/servos/{uid}/parameters/torque_mode").json()["rom"] is None:
        api.post(f"/servos/{uid}/restart", params={"wait": True}).raise_for_status()


def turn_manually(server: Server, uid: str, degrees: float) -> None:
    """Turn a horn while its motor has no output, so that soft start has a distance to travel."""

    def turned() -> bool:
        return server.api.patch(f"/sim/servos/{uid}", json={"external_angle_deg": degrees}).is_success

    def seen() -> bool:
        return abs((server.api.get(f"/servos/{uid}").json()["angle_deg"] or 0) - degrees) < 1

    until(turned, 20, f"{uid} has output")
    until(seen, 20, f"{uid} is not seen at {degrees}°")


@dataclass(frozen=True)
class Demo:
    """A running `hornbill demo`."""

    url: str
    api: httpx.Client


@contextmanager
def running_demo(*flags: str) -> Generator[tuple[Popen[str], str]]:
    """`hornbill demo`, started as a user does: the process and the address it printed. Ended with the block."""
    command = [sys.executable, "-m", "hornbill", "demo", "--port", "0", *flags]
    with Popen(command, stdout=PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            found = re.search(r"https?://\S+/", line)
            assert found is not None, f"hornbill demo printed no address but {line!r}"
            yield process, found[0]
        finally:
            process.terminate()
            process.wait(timeout=10)


@contextmanager
def ready_demo(count: int, *flags: str, seed: int = 1) -> Generator[Demo]:
    """A demo with `count` servos, all ready."""
    with running("demo", "--servos", str(count), "--seed", str(seed), *flags) as server:
        server.ready(count)
        yield Demo(server.url, server.api)
