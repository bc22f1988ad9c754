"""A PostgreSQL server that hangs for a minute of a run: what is lost, and how long a stop takes meanwhile."""

import tempfile
import time
from collections.abc import Iterator
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
        began = time.time()
        cluster.suspend(2 * AWAY_S)
        ends, first, changed = time.monotonic() + AWAY_S, list[float](), 0
        while time.monotonic() < ends:
            if len(first) < STOPS:
                first.append(one_stop(url, servos)[0])
            uid = uids[changed % SERVOS]
            path = f"{api}servos/{uid}/parameters"
            httpx.patch(path, json={"values": {"angle_p_gain": 50 + changed}}, timeout=30).raise_for_status()
            changed += 1
        assert len(first) == STOPS, f"only {len(first)} stops in {AWAY_S:.0f} s"
        waiting = _pending(api)
        cluster.resume()
        resumed = time.monotonic()
        while _pending(api):
            assert time.monotonic() < resumed + 60, "not everything was written after a minute"
            time.sleep(0.1)
        written_s = time.monotonic() - resumed
        with Store(cluster.url) as store:
            rows = [row for row in store.audit.rows(limit=100_000) if row.at >= began]
        writes = [row.entry.after for row in reversed(rows) if row.entry.action == "write"]
        pressed = sum(row.entry.action == "stop" and row.entry.outcome == "pressed" for row in rows)
        assert len(writes) <= changed, "written twice"
        assert pressed <= STOPS, "written twice"
        lost = changed + STOPS - pressed - sum(writes[n : n + 1] == [50 + n] for n in range(changed))
    found = {"pending": waiting, "changes": changed + STOPS, "written_s": round(written_s, 2), "lost": lost}
    yield line(f"database hangs for {AWAY_S:.0f} s, changes lost", found, of="lost", must=0)
    times = {"stops": STOPS, "ms_p99": round(p99(sorted(first)), 2), "ms_max": round(max(first), 2)}
    yield line("first torque off after a stop meanwhile, 20 servos at 50 Hz", times, of="ms_p99", must=10)


def _pending(api: str) -> int:
    """Changes that are not in the database yet."""
    text = httpx.get(api + "metrics", timeout=30).text
    (value,) = [one.split()[1] for one in text.splitlines() if one.startswith("hornbill_store_pending_writes ")]
    return int(float(value))
