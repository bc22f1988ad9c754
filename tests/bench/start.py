"""Starting: wall time from the command to the first answer over HTTP, and to six readable servos."""

import statistics
import time
from collections.abc import Iterator
from typing import Any

import httpx

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
    yield {"bench": "demo answers HTTP", "s_median": round(statistics.median(http), 2), "must_s": 2.0}
    yield {"bench": "demo has six readable servos", "s_median": round(statistics.median(ready), 2), "must_s": 12.0}
