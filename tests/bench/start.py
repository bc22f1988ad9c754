"""Starting: wall time from the command to the first answer over HTTP, and to six readable servos."""

import statistics
import time
from collections.abc import Iterator
from typing import Any

import httpx

from bench.line import line
from e2e.conftest import running_demo

ROUNDS = 3


def figures() -> Iterator[dict[str, Any]]:
    """Warm starts of `hornbill demo --servos 6`."""
    http: list[float] = []
    ready: list[float] = []
    for _ in range(ROUNDS):
        began = time.monotonic()
        with running_demo("--servos", "6") as (_, url):
            httpx.get(url + "api/v1/health").raise_for_status()
            http.append(time.monotonic() - began)
            while sum(one["state"] == "ready" for one in httpx.get(url + "api/v1/servos").json()) < 6:
                time.sleep(0.05)
            ready.append(time.monotonic() - began)
    for bench, took, must in (("demo answers HTTP", http, 2.0), ("demo has six readable servos", ready, 12.0)):
        yield line(bench, {"s_median": round(statistics.median(took), 2)}, of="s_median", must=must)
