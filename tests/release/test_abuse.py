"""What a hostile or broken client does to the real server: it goes on, does not grow, and stops when it is told to."""

import asyncio
import re
import time
from collections.abc import Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import httpx
import pytest

from bench.abuse import garbage, healthy, looking_on, malformed, send_malformed, slow_loris
from e2e.servers import Server, running

Outcome = TypeVar("Outcome")
GROWTH_BYTES = 16 << 20
"""What the process may have more after the second round than after the first, which fills every cache."""


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    """A demo of its own: what is done to it must not spoil anybody else's."""
    with running("demo", "--servos", "2") as found:
        found.ready(2)
        yield found


def memory(server: Server) -> int:
    """Bytes the server's process has in memory."""
    text = httpx.get(server.url + "metrics").text
    found = re.search(r"^process_resident_memory_bytes (\S+)$", text, re.MULTILINE)
    if found is None:
        pytest.skip("the process tells its memory on Linux only")
    return int(float(found[1]))


async def round_of_abuse(server: Server, seed: int) -> tuple[float, int, int]:
    """Everything at once: 99 % latency of a healthy client in ms, requests answered, messages listeners got."""
    port = int(server.url.rstrip("/").rpartition(":")[2])
    uid = str(server.servos()[0]["uid"])
    over, there = asyncio.Event(), asyncio.Event()
    slow = asyncio.create_task(slow_loris(port, 60, over))
    listening = asyncio.create_task(looking_on(port, 60, 5, over, there))
    await there.wait()

    async def abuse() -> int:
        answered, _ = await asyncio.gather(
            send_malformed(port, malformed(uid, seed, 600)), garbage(port, 4, seed)
        )  # fmt: skip
        return answered

    work = asyncio.create_task(abuse())
    try:
        latency = await healthy(server.url, uid, work)
    finally:
        over.set()
    await slow
    return latency.p99_ms, await work, await listening


def apart(work: Coroutine[Any, Any, Outcome]) -> Outcome:
    """Run it in a thread of its own: Playwright, where a test before used it, keeps a loop running in this one."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, work).result()


def test_abuse_neither_crashes_nor_grows_the_server_and_stop_still_works(server: Server) -> None:
    before = [(one["uid"], one["unsaved"]) for one in server.servos()]
    first = apart(round_of_abuse(server, 1))
    after_first = memory(server)
    second = apart(round_of_abuse(server, 2))
    assert memory(server) - after_first < GROWTH_BYTES
    for p99_ms, answered, heard in (first, second):
        assert p99_ms < 1500, "a client that behaves waits too long meanwhile"
        assert answered > 500, "malformed requests are answered"
        assert heard > 5
    assert server.process.poll() is None
    assert [(one["uid"], one["unsaved"]) for one in server.servos()] == before, "nothing was written"

    async def stopped_amid() -> float:
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
                assert time.monotonic() - began < 5, "a stop amid abuse is not answered by every servo"
        over.set()
        await asyncio.gather(slow, flood)
        return max(one["ms"] for one in server.api.get("/stop").json()["servos"])

    assert apart(stopped_amid()) < 250, "milliseconds until the last servo answered the stop"
