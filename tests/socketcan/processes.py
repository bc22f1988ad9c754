"""Other processes of these tests: hornbill, forked from one that has imported it, and waiting for its effects."""

import os
import re
import select
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import httpx

from e2e import preloaded
from e2e.preloaded import Forked

TIMEOUT_S = 120.0
"""Starting is slow where system calls are."""

T = TypeVar("T")


@contextmanager
def hornbill(*words: str) -> Generator[Forked]:
    """`hornbill` with these arguments, in its own process; ended afterwards."""
    process = preloaded.start(*words)
    try:
        yield process
    finally:
        process.end()


@contextmanager
def serving(bus: str, data: Path, *words: str) -> Generator[httpx.Client]:
    """`hornbill serve` on a bus, with further arguments. Yields a client of its API."""
    with hornbill("serve", "--bus", bus, "--port", "0", "--data-dir", str(data), *words) as process:
        found = re.search(r"http://\S+/", line(process))
        assert found is not None
        # One connection per request: the server may close an idle one just before its next use.
        limits = httpx.Limits(max_keepalive_connections=0)
        with httpx.Client(base_url=found[0] + "api/v1", timeout=TIMEOUT_S, limits=limits) as client:
            yield client


def identified(api: httpx.Client) -> set[str]:
    """UIDs of the servos that are identified and online."""
    found = api.get("/servos").raise_for_status().json()
    return {one["uid"] for one in found if one["state"] not in ("identifying", "offline")}


def line(process: Forked) -> str:
    """The next line a process prints."""
    end = time.monotonic() + TIMEOUT_S
    got = b""
    while not got.endswith(b"\n"):
        ready, _, _ = select.select([process.stdout], [], [], max(0.0, end - time.monotonic()))
        assert ready, f"it prints nothing more than {got!r}"
        one = os.read(process.stdout.fileno(), 1)
        assert one, f"it ended after {got!r}"
        got += one
    return got.decode().rstrip("\n")


def until(look: Callable[[], T], what: str) -> T:
    """The first result of `look` that is true."""
    end = time.monotonic() + TIMEOUT_S
    while not (found := look()):
        assert time.monotonic() < end, what
        time.sleep(0.2)
    return found
