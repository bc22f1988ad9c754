"""Hostile and broken clients: the server keeps working, does not grow, and stops on request."""

import asyncio
import re
import time
from collections.abc import Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import httpx
import pytest

from bench.abuse import garbage, healthy, listeners_of, malformed, send_malformed, slow_loris
from e2e.servers import Server, running

Outcome = TypeVar("Outcome")
GROWTH_BYTES = 16 << 20
"""Allowed growth of the process in the second round; the first fills every cache."""


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    """A separate demo, because it is abused."""
    with running("demo", "--servos", "2") as found:
        found.ready(2)
        yield found


def memory(server: Server) -> int:
    """Bytes the server's process has in memory."""
    text = httpx.get(server.url + "metrics").text
    found = re.search(r"^process_resident_memory_bytes (\S+)$", text, re.MULTILINE)
    if found is None:
        pytest.skip("memory is available on Linux only")
    return int(float(found[1]))


async def round_of_abuse(server: Server, seed: int) -> tuple[float, int, int]:
    """Everything at once: 99 % latency of a healthy client in ms, number of responses, messages of listeners."""
    port = int(server.url.rstrip("/").rpartition(":")[2])
    uid = str(server.servos()[0]["uid"])
    over, there = asyncio.Event(), asyncio.Event()
    slow = asyncio.create_task(slow_loris(port, 60, over))
    listening = asyncio.create_task(listeners_of(port, 60, 5, over, there))
    await there.wait()

    async def abuse() -> int:
        responses, _ = await asyncio.gather(
            send_malformed(port, malformed(uid, seed, 600)), garbage(port, 4, seed)
        )  # fmt: skip
        return responses

    work = asyncio.create_task(abuse())
    try:
        latency = await healthy(server.url, uid, work)
    finally:
        over.set()
    await slow
    return latency.p99_ms, await work, await listening


def in_thread(work: Coroutine[Any, Any, Outcome]) -> Outcome:
    """Run it in a new thread: Playwright keeps a loop running in the main thread if an earlier test used it."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, work).result()


def test_abuse_neither_crashes_nor_grows_the_server_and_stop_works(server: Server) -> None:
    before = [(one["uid"], one["unsaved"]) for one in server.servos()]
    first = in_thread(round_of_abuse(server, 1))
    after_first = memory(server)
    second = in_thread(round_of_abuse(server, 2))
    assert memory(server) - after_first < GROWTH_BYTES
    for p99_ms, responses, received in (first, second):
        assert p99_ms < 1500, "latency of a well-behaved client"
        assert responses > 500, "malformed requests get responses"
        assert received > 5
    assert server.process.poll() is None
    assert [(one["uid"], one["unsaved"]) for one in server.servos()] == before, "nothing was written"

    async def stop_during_abuse() -> float:
        over = asyncio.Event()
        port = int(server.url.rstrip("/").rpartition(":")[2])
        slow = asyncio.create_task(slow_loris(port, 60, over))
        flood = asyncio.create_task(send_malformed(port, malformed(str(before[0][0]), 3, 100)))
        await asyncio.sleep(0.2)
        began = time.monotonic()
        async with httpx.AsyncClient(base_url=server.url, timeout=30) as client:
            (await client.post("/api/v1/stop")).raise_for_status()
            while not all(
                one["confirmed"] for one in (await client.get("/api/v1/stop")).json()["servos"]
            ):  # fmt: skip
                assert time.monotonic() - began < 5, "not every servo confirmed the stop"
        over.set()
        await asyncio.gather(slow, flood)
        return max(one["ms"] for one in server.api.get("/stop").json()["servos"])

    assert in_thread(stop_during_abuse()) < 250, "milliseconds until the last servo confirmed the stop"
