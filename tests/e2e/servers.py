"""Servers of their own for browser tests that take one down, begin without a bus, or fill it from nothing."""

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
        """As GET /servos gives them."""
        return self.api.get("/servos").json()

    def ready(self, number: int, within_s: float = 25) -> list[str]:
        """Waits until `number` servos are ready; their uids."""
        found: list[str] = []

        def enough() -> bool:
            found[:] = [str(one["uid"]) for one in self.servos() if one["state"] == "ready"]
            return len(found) >= number

        until(enough, within_s, f"not {number} servos are ready")
        return found


def until(what: Callable[[], bool], within_s: float, message: str) -> None:
    """Fails with `message` unless `what` comes true in time."""
    end = time.monotonic() + within_s
    while not what():
        assert time.monotonic() < end, message
        time.sleep(0.1)


_ports: list[int] = []
"""Where servers of this process have listened. One that has ended leaves its port to the next: a browser keeps what it
fetched and compiled by host and port."""
_in_use: set[int] = set()


def _next_port() -> int:
    """A port without a server, below those that the kernel gives to clients."""
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
    """`hornbill` with these words, on `port` if given. It is ended with the block, stopped or not."""
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
    """The words of `hornbill serve` with a data folder of its own."""
    return ("serve", "--data-dir", str(folder), *flags)


def as_in_rom(api: httpx.Client, uid: str) -> None:
    """Restart a servo whose RAM differs from ROM, or whose ROM is unknown: its save needs confirmation."""
    unsaved = api.get(f"/servos/{uid}").json()["unsaved"]
    if unsaved or api.get(f"/servos/{uid}/parameters/torque_mode").json()["rom"] is None:
        api.post(f"/servos/{uid}/restart", params={"wait": True}).raise_for_status()


def turn_manually(server: Server, uid: str, degrees: float) -> None:
    """Turn a horn while its motor has no output, so that soft start has a way to go."""

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
    """`hornbill demo`, started as a user starts it: the process and the address it printed. It ends with the block."""
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
    """A demo with so many servos, all of them ready."""
    with running("demo", "--servos", str(count), "--seed", str(seed), *flags) as server:
        server.ready(count, within_s=60)
        yield Demo(server.url, server.api)
