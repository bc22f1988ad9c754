"""Validated writes per second on a bus without bit times, and the effect of abuse on other clients.

Abuse is ten thousand malformed requests in two rounds, beside sockets, slow requests and garbage.

The four simulated servos and their bus live in the server's process, as in the demo: by profile about a quarter of the
time of a write of motion is theirs. The client is a process of its own: with fewer than two cores free the figures show
of the machine. A write of motion is one request on the bus and kept nowhere; one of the configuration is three
(what is there, the new value, the proof), and two commits: the snapshot before it and the audit row after it.
"""

import asyncio
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from typing import Any

import httpx
import orjson

from bench.abuse import Latency, garbage, healthy, listeners_of, malformed, send_malformed, slow_loris
from bench.line import line
from bench.processes import HERE, adapter, server, wait_until_ready
from bench.stopping import SERVOS, one_stop, p99

WRITERS, WRITING_S = 4, 5.0
IDLE, ACTIVE, SLOW, MALFORMED, GARBAGE, STOPS = 200, 20, 100, 5_000, 24, 100


def figures() -> Iterator[dict[str, Any]]:
    """Writes; then two rounds of abuse, of which the first fills every cache."""
    yield from _writes()
    yield from _abuse()


def _writes() -> Iterator[dict[str, Any]]:
    with server(("-m", "bench.load_server"), str(WRITERS)) as (url, _):
        wait_until_ready(url, WRITERS)
        for key, must in (("command_angle", 1000), ("smoothing", 250)):
            command = (sys.executable, "-m", "bench.load_client", _port(url), key, str(WRITERS), str(WRITING_S))
            found = orjson.loads(subprocess.run(command, cwd=HERE, stdout=subprocess.PIPE, check=True).stdout)
            fast = {"us_a_write": round(1e6 / found["per_s"]), **found}
            yield line(f"validated PUT of {key}, telemetry on", fast, of="us_a_write", must=1e6 / must)
            yield line(f"validated PUT of {key}, the slowest", found, of="ms_p99", must=10)


def _abuse() -> Iterator[dict[str, Any]]:
    with (
        tempfile.TemporaryDirectory() as folder,
        adapter("bench.stop_crowd", SERVOS) as (device, servos),
        server(("-m", "hornbill", "serve", "--port", "0", "--data-dir", folder), "--bus", f"slcan:{device}") as (
            url,
            _,
        ),
    ):
        wait_until_ready(url, SERVOS)
        rounds = [asyncio.run(_round(url, seed)) for seed in (1, 2)]
        first, second = (memory for _, memory in rounds)
        latency = rounds[1][0]
        growth = {
            "growth_mib": round((second - first) / 2**20, 1), "rss_mib": round(second / 2**20, 1),
            "idle_sockets": IDLE, "active_sockets": ACTIVE, "slow_requests": SLOW, "malformed_requests": MALFORMED,
            "healthy_ms_median": round(latency.median_ms, 1), "healthy_ms_p99": round(latency.p99_ms, 1),
        }  # fmt: skip
        yield line("a second round of abuse: growth of the process", growth, of="growth_mib", must=16)
        with subprocess.Popen((sys.executable, "-m", "bench.load", url), cwd=HERE) as abusing:
            time.sleep(2.0)
            reached = [one_stop(url, servos)[0] for _ in range(STOPS)]
            assert abusing.poll() is None, "the abuse has ended early"
            abusing.terminate()
        found = {"stops": STOPS, "ms_median": round(statistics.median(reached), 2), "ms_p99": round(p99(reached), 2)}
        yield line("first torque off after a stop amid abuse", found, of="ms_p99", must=50)


async def _round(url: str, seed: int) -> tuple[Latency, int]:
    """Everything at once; the latency of a healthy client, and the memory of the server afterwards."""
    port, over, there = int(_port(url)), asyncio.Event(), asyncio.Event()
    async with httpx.AsyncClient(timeout=30) as client:
        uid = str((await client.get(f"{url}api/v1/servos")).json()[0]["uid"])
        others = asyncio.gather(slow_loris(port, SLOW, over), listeners_of(port, IDLE, ACTIVE, over, there))
        await there.wait()
        abuse = asyncio.gather(send_malformed(port, malformed(uid, seed, MALFORMED)), garbage(port, GARBAGE, seed))
        latency = await healthy(url, uid, abuse)
        over.set()
        await others
        found = re.search(r"^process_resident_memory_bytes (\S+)$", (await client.get(f"{url}metrics")).text, re.M)
    assert found is not None
    return latency, int(float(found[1]))


def _port(url: str) -> str:
    return url.rstrip("/").rpartition(":")[2]


async def _for_ever(url: str) -> None:
    for seed in range(1_000_000):
        await _round(url, seed)


if __name__ == "__main__":
    asyncio.run(_for_ever(sys.argv[1]))
