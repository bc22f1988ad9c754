"""Sixty servos commanded 50 times a second by a server as a user starts it: slots missed, and how late at worst."""

import tempfile
import threading
import time
from collections.abc import Iterator
from typing import Any

import httpx

from bench.line import line
from bench.processes import crowd, server, wait_until_ready

SERVOS, RATE_HZ, MEASURED_S = 60, 50.0, 20.0
BAUD = 3_000_000
"""Of the serial line, which carries this stream; at 1,000,000 baud it would be refused as more than its share."""


def figures() -> Iterator[dict[str, Any]]:
    """Misses over twenty seconds in which every servo is given a new value with every burst."""
    with (
        tempfile.TemporaryDirectory() as folder,
        crowd(SERVOS) as (device, _),
        server(
            ("-m", "hornbill", "serve"), "--bus", f"slcan:{device}@{BAUD}", "--data-dir", folder, "--port", "0"
        ) as url,
        httpx.Client(base_url=url + "api/v1", timeout=30) as api,
    ):
        wait_until_ready(url, SERVOS)
        lease = {"Lease": _ask(api, "POST", "/leases", {"holder": "bench", "ttl_s": 60})["id"]}
        uids = [one["uid"] for one in _ask(api, "GET", "/servos")]
        for uid in uids:
            _ask(api, "POST", f"/servos/{uid}/torque", {"mode": "on"}, lease)
        stream = _ask(api, "POST", "/streams", {"uids": uids, "rate_hz": RATE_HZ}, lease)
        over = threading.Event()
        feeding = threading.Thread(target=_feed, args=(url, stream["id"], uids, lease, over))
        feeding.start()
        time.sleep(MEASURED_S)
        over.set()
        feeding.join()
        told = _ask(api, "GET", f"/streams/{stream['id']}")
        assert told["ended"] is None, told["ended"]
    slots = told["sent"] + told["misses"]
    figures = {
        "servos": SERVOS, "rate_hz": RATE_HZ, "bursts": told["sent"], "misses": told["misses"],
        "missed_pct": round(100 * told["misses"] / slots, 3), "worst_late_ms": told["worst_late_ms"],
        "worst_skew_ms": told["worst_skew_ms"], "bus_share": told["bus_share"],
    }  # fmt: skip
    yield line("60 servos commanded at 50 Hz, new values with every burst", figures, of="missed_pct", must=1.0, aim=0.1)


def _feed(url: str, stream: str, uids: list[str], lease: dict[str, str], over: threading.Event) -> None:
    """New values fifty times a second, as a program would send them."""
    with httpx.Client(base_url=url + "api/v1", timeout=30) as api:
        step = 0
        while not over.is_set():
            step += 1
            _ask(api, "PUT", f"/streams/{stream}", {"values": dict.fromkeys(uids, step % 40 / 10)}, lease)
            time.sleep(1 / RATE_HZ)


def _ask(api: httpx.Client, verb: str, path: str, body: object = None, lease: dict[str, str] | None = None) -> Any:
    answer = api.request(verb, path, json=body, headers=lease or {})
    assert answer.is_success, answer.text
    return answer.json()
