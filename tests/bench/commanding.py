"""Sixty servos commanded 50 times a second by a server as a user starts it: missed slots and maximum delay."""

import tempfile
import threading
import time
from collections.abc import Iterator
from typing import Any

import httpx

from bench.line import line
from bench.processes import adapter, server, wait_until_ready

SERVOS, RATE_HZ, MEASURED_S = 60, 50.0, 12.0
BAUD = 3_000_000
"""Baud rate of the serial line; at 1,000,000 the stream would be rejected for exceeding its share."""


def figures() -> Iterator[dict[str, Any]]:
    """Misses over twenty seconds with a new value for every servo in every burst."""
    with (
        tempfile.TemporaryDirectory() as folder,
        adapter("bench.stop_crowd", SERVOS) as (device, _),
        server(("-m", "hornbill", "serve"), "--bus", f"slcan:{device}@{BAUD}", "--data-dir", folder, "--port", "0") as (
            url,
            _,
        ),
        httpx.Client(base_url=url + "api/v1", timeout=30) as api,
    ):
        wait_until_ready(url, SERVOS)
        lease = {"Lease": _request(api, "POST", "/leases", {"holder": "bench", "ttl_s": 60})["id"]}
        uids = [one["uid"] for one in _request(api, "GET", "/servos")]
        for uid in uids:
            _request(api, "POST", f"/servos/{uid}/torque", {"mode": "on"}, lease)
        stream = _request(api, "POST", "/streams", {"uids": uids, "rate_hz": RATE_HZ}, lease)
        over = threading.Event()
        feeding = threading.Thread(target=_feed, args=(url, stream["id"], uids, lease, over))
        feeding.start()
        time.sleep(MEASURED_S)
        over.set()
        feeding.join()
        state = _request(api, "GET", f"/streams/{stream['id']}")
        assert state["ended"] is None, state["ended"]
    slots = state["sent"] + state["misses"]
    figures = {
        "servos": SERVOS, "rate_hz": RATE_HZ, "bursts": state["sent"], "misses": state["misses"],
        "missed_pct": round(100 * state["misses"] / slots, 3), "worst_late_ms": state["worst_late_ms"],
        "worst_skew_ms": state["worst_skew_ms"], "bus_share": state["bus_share"],
    }  # fmt: skip
    yield line(
        "60 servos commanded at 50 Hz, new values with every burst",
        figures,
        of="missed_pct",
        must=1.0,
        aim=0.1,
        limit="the period of a burst, 20 ms",
    )


def _feed(url: str, stream: str, uids: list[str], lease: dict[str, str], over: threading.Event) -> None:
    """New values fifty times a second, as a program would send them."""
    with httpx.Client(base_url=url + "api/v1", timeout=30) as api:
        step = 0
        while not over.is_set():
            step += 1
            _request(api, "PUT", f"/streams/{stream}", {"values": dict.fromkeys(uids, step % 40 / 10)}, lease)
            time.sleep(1 / RATE_HZ)


def _request(api: httpx.Client, verb: str, path: str, body: object = None, lease: dict[str, str] | None = None) -> Any:
    response = api.request(verb, path, json=body, headers=lease or {})
    assert response.is_success, response.text
    return response.json()
