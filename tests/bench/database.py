"""A PostgreSQL server that hangs for a minute of a run: what is lost, and how long a stop takes meanwhile."""

import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from threading import Event
from typing import Any

import httpx

from bench.line import line
from bench.processes import adapter, server, wait_until_ready
from bench.stopping import SERVOS, STOPS, STREAMING, one_stop, p99
from hornbill.store.store import Store
from unit.store.postgres import Cluster

AWAY_S = 60.0


def figures() -> Iterator[dict[str, Any]]:
    """A hundred stops while the database hangs, and what is in its audit afterwards."""
    with (
        Cluster() as cluster,
        tempfile.TemporaryDirectory() as folder,
        adapter("bench.stop_crowd", SERVOS) as (device, servos),
        server(STREAMING, device, folder, cluster.url) as (url, _),
    ):
        wait_until_ready(url, SERVOS)
        api = url + "api/v1/"
        uids = [one["uid"] for one in httpx.get(api + "servos").json()]
        before = [one_stop(url, servos)[0] for _ in range(STOPS)]
        began = time.time()
        cluster.suspend(10 * AWAY_S)
        ends, enough = time.monotonic() + AWAY_S, Event()
        with ThreadPoolExecutor(1) as other:
            changing = other.submit(_change, f"{api}servos/", uids, enough)
            try:
                hanging = [one_stop(url, servos)[0] for _ in range(STOPS)]
                time.sleep(max(0.0, ends - time.monotonic()))
            except BaseException:
                cluster.resume()  # it could not be stopped
                raise
            finally:
                enough.set()
            changed = changing.result()
        waiting = _pending(url)
        cluster.resume()
        resumed = time.monotonic()
        while _pending(url):
            assert time.monotonic() < resumed + 60, "not everything was written after a minute"
            time.sleep(0.1)
        written_s = time.monotonic() - resumed
        with Store(cluster.url) as store:
            rows = [row for row in store.audit.rows(limit=100_000) if row.at >= began]
        writes = [row.entry.requested for row in reversed(rows) if row.entry.action == "write"]
        pressed = sum(row.entry.action == "stop" and row.entry.outcome == "pressed" for row in rows)
        assert len(writes) <= changed, "written twice"
        assert pressed <= STOPS, "written twice"
        lost = changed + STOPS - pressed - sum(writes[n : n + 1] == [_gain(n)] for n in range(changed))
    found = {"pending": waiting, "changes": changed + STOPS, "written_s": round(written_s, 2), "lost": lost}
    yield line(f"database hangs for {AWAY_S:.0f} s, changes lost", found, of="lost", must=0, limit="no loss")
    times = {
        "stops": STOPS, "ms_p99": round(p99(hanging), 2), "ms_max": round(max(hanging), 2),
        "ms_p99_before": round(p99(before), 2),
    }  # fmt: skip
    yield line(
        "first torque off after a stop meanwhile, 20 servos at 50 Hz",
        times,
        of="ms_p99",
        must=10,
        limit="half the period of a command, 50 Hz",
    )


def _gain(number: int) -> int:
    return 50 + number % 50


def _change(servos: str, uids: list[str], enough: Event) -> int:
    """Change one gain after the other until it is enough, and return how many. What is refused is stored, too."""
    for number in count():
        if enough.is_set():
            return number
        path = f"{servos}{uids[number % SERVOS]}/parameters"
        httpx.patch(path, json={"values": {"angle_p_gain": _gain(number)}}, timeout=30).raise_for_status()
    raise AssertionError


def _pending(url: str) -> int:
    """Changes that are not in the database yet."""
    text = httpx.get(url + "metrics", timeout=30).text
    (value,) = [one.split()[1] for one in text.splitlines() if one.startswith("hornbill_store_pending_writes ")]
    return int(float(value))
