"""The client of the load benchmark: `python -m bench.load_client PORT KEY CONNECTIONS SECONDS`.

Writes requests as bytes over connections that stay open: the time it takes itself is taken from the server's cores.
"""

import asyncio
import sys
import time
from typing import Any

import httpx
import orjson

VALUES = {"command_angle": (1.5, -1.5), "smoothing": (True, False)}
"""Rows written in turn: one of motion, and one of the configuration, which is verified and recorded in history."""
IDLE_S = 2.0
"""Duration of measuring the server without requests, to subtract simulated servos and telemetry."""


def _request(uid: str, key: str, value: object, lease: str) -> bytes:
    body = orjson.dumps({"value": value})
    head = (
        f"PUT /api/v1/servos/{uid}/parameters/{key} HTTP/1.1", "Host: 127.0.0.1", f"Lease: {lease}",
        "Content-Type: application/json", f"Content-Length: {len(body)}", "", "",
    )  # fmt: skip
    return "\r\n".join(head).encode() + body


async def _connection(port: int, requests: list[bytes], until: float, took: list[float]) -> None:
    """Send requests one after the other, each with a new value, until that time."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    number = 0
    while time.perf_counter() < until:
        began = time.perf_counter()
        writer.write(requests[number % len(requests)])
        number += 1
        head = await reader.readuntil(b"\r\n\r\n")
        assert head.startswith(b"HTTP/1.1 200"), head + await reader.read(500)
        low = head.lower()
        at = low.index(b"content-length:") + 15
        await reader.readexactly(int(low[at : low.index(b"\r", at)]))
        took.append(time.perf_counter() - began)
    writer.close()


async def _all(port: int, places: list[list[bytes]], until: float, took: list[float]) -> None:
    await asyncio.gather(*(_connection(port, requests, until, took) for requests in places))


def process(port: int, name: str) -> float:
    """A metric of the server's process: cpu_seconds_total, resident_memory_bytes, open_fds."""
    text = httpx.get(f"http://127.0.0.1:{port}/metrics").text
    line = next(line for line in text.splitlines() if line.startswith(f"process_{name} "))
    return float(line.split()[1])


def run(port: int, key: str, connections: int, seconds: float) -> dict[str, Any]:
    """Requests per second and milliseconds over all connections, each with its own servo, and CPU time per request."""
    api = f"http://127.0.0.1:{port}/api/v1"
    servos = httpx.get(f"{api}/servos").json()
    lease = httpx.post(f"{api}/leases", json={"holder": "load", "ttl_s": 60}).json()["id"]
    for one in servos:
        httpx.post(
            f"{api}/servos/{one['uid']}/torque", json={"mode": "on"}, headers={"Lease": lease}
        ).raise_for_status()
    uids = [str(servos[number % len(servos)]["uid"]) for number in range(connections)]
    places = [[_request(uid, key, value, lease) for value in VALUES[key]] for uid in uids]
    cpu, began = process(port, "cpu_seconds_total"), time.perf_counter()
    time.sleep(IDLE_S)
    idle = (process(port, "cpu_seconds_total") - cpu) / (time.perf_counter() - began)
    took: list[float] = []
    for lasts in (1.0, seconds):  # the first is for warming up
        took.clear()
        cpu, began = process(port, "cpu_seconds_total"), time.perf_counter()
        asyncio.run(_all(port, places, began + lasts, took))
        lasted = time.perf_counter() - began
        cpu = process(port, "cpu_seconds_total") - cpu
    httpx.delete(f"{api}/leases/{lease}")
    took.sort()
    return {
        "connections": connections, "per_s": round(len(took) / lasted), "ms_median": _ms(took, 0.5),
        "ms_p99": _ms(took, 0.99), "ms_max": _ms(took, 1.0), "core_pct": round(cpu / lasted * 100),
        "core_pct_idle": round(idle * 100), "cpu_ms_a_request": round((cpu - idle * lasted) / len(took) * 1000, 3),
    }  # fmt: skip


def _ms(took: list[float], share: float) -> float:
    return round(took[max(0, round(share * len(took)) - 1)] * 1000, 2)


if __name__ == "__main__":
    sys.stdout.buffer.write(orjson.dumps(run(int(sys.argv[1]), sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))))
