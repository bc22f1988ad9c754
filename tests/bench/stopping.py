"""Stop with twenty servos streaming, ten sockets and full reads: bus time until all have acknowledged, and real time
from the last byte of the request to torque off coming out of the adapter, while every core is busy."""

import asyncio
import os
import select
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import httpx

from behaviour.rig import PLAIN, Rig, json, play
from bench.line import line
from bench.processes import adapter, listeners, server, wait_until_ready

SERVOS, SOCKETS, STOPS = 20, 10, 100
STREAMING = ("-m", "bench.stop_server")
"""A server whose bursts continue through every stop; a stop would end a stream."""


def figures() -> Iterator[dict[str, Any]]:
    """Over twenty stops in bus time, and over a hundred in real time."""
    yield from _in_bus_time()
    yield from _in_real_time()


def _in_bus_time() -> Iterator[dict[str, Any]]:
    """Milliseconds from the request to the last of twenty acknowledgements, on a bus with true bit times."""

    async def scene(rig: Rig) -> dict[str, Any]:
        servos = await rig.ready(20)
        last: list[float] = []
        for _ in range(20):
            paths = [f"/servos/{servo.uid}/parameters?refresh=true" for servo in servos]
            reading = [asyncio.create_task(rig.call("GET", path)) for path in paths]
            await asyncio.sleep(0.05)
            state = json(await rig.call("POST", "/stop"))
            last.append(max(one["ms"] for one in state["servos"]))
            json(await rig.call("DELETE", "/stop"))
            for task in reading:
                json(await task)
        figures = {"stops": len(last), "ms_median": statistics.median(last), "ms_max": max(last)}
        return line(
            "stop reaches 20 servos during full reads",
            figures,
            of="ms_max",
            must=60,
            limit="three periods of a command, 50 Hz",
        )

    yield play(scene, *(replace(PLAIN, node_id=10 + n, servo_id=1 + n) for n in range(20)))


def _in_real_time() -> Iterator[dict[str, Any]]:
    """Milliseconds from a request's last byte to the first and to the twentieth torque off out of the adapter."""
    with (
        tempfile.TemporaryDirectory() as folder,
        adapter("bench.stop_crowd", SERVOS) as (device, servos),
        server(STREAMING, device, folder) as (url, _),
    ):
        wait_until_ready(url, SERVOS)
        with listeners(url, SOCKETS) as listeners_of, busy_cores():
            time.sleep(2.0)
            first, last = zip(*(one_stop(url, servos) for _ in range(STOPS)), strict=True)
            assert listeners_of.poll() is None, "who looks on has ended early"
    figures = {"stops": STOPS, "ms_median": statistics.median(first), "ms_p99": p99(first), "ms_max": max(first)}
    figures = {name: round(value, 2) for name, value in figures.items()}
    yield line(
        "first torque off after a stop, 20 servos at 50 Hz, 10 sockets, full reads, every core busy", figures,
        of="ms_p99", must=10, limit="half the period of a command, 50 Hz",
    )  # fmt: skip
    figures = {"stops": STOPS, "ms_median": statistics.median(last), "ms_p99": p99(last), "ms_max": max(last)}
    figures = {name: round(value, 2) for name, value in figures.items()}
    yield line(
        "all 20 reached by a stop, the same", figures, of="ms_p99", must=60, limit="three periods of a command, 50 Hz"
    )


@contextmanager
def busy_cores() -> Generator[None]:
    """One process per core that computes without a pause, at normal priority, until the block ends."""
    loops = [subprocess.Popen((sys.executable, "-c", "while True: pass")) for _ in range(os.cpu_count() or 1)]
    try:
        yield
    finally:
        for one in loops:
            one.kill()
            one.wait()


def p99(values: Sequence[float]) -> float:
    """The 99th of a hundred, rising."""
    return sorted(values)[round(0.99 * len(values)) - 1]


def one_stop(url: str, crowd: "subprocess.Popen[bytes]") -> tuple[float, float]:
    """Milliseconds to the first and to the last servo, over a connection that is open already, as a page has one."""
    port = int(url.rstrip("/").rpartition(":")[2])
    with socket.create_connection(("127.0.0.1", port)) as line_:
        head = b"POST /api/v1/stop HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
        time.sleep(0.05)
        sent = time.monotonic()
        line_.sendall(head)
        reached: dict[int, float] = {}
        while len(reached) < SERVOS:
            assert crowd.stdout is not None
            ready, _, _ = select.select([crowd.stdout], [], [], 5.0)
            assert ready, f"only {len(reached)} servos were reached in 5 s"
            node, at = crowd.stdout.readline().split()
            if float(at) >= sent:
                reached.setdefault(int(node), float(at))
        while line_.recv(65536):
            pass
    httpx.delete(url + "api/v1/stop")
    time.sleep(0.2)
    return (min(reached.values()) - sent) * 1000, (max(reached.values()) - sent) * 1000
