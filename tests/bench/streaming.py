"""A crowd of streaming servos on a serial adapter, the server as a user starts it, one WebSocket: its CPU time.

The peer is pydronecan, which only decodes as many frames of such a bus in a second.
"""

import asyncio
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import httpx
import orjson
from dronecan.driver import CANFrame
from websockets.asyncio.client import connect

from bench.line import PYDRONECAN, cpu, line
from bench.processes import adapter, cpu_s, server, wait_until_ready
from bench.stack import decode_with_peer, saturated_mix

SERVOS = 125
MEASURED_S = 12.0
MUST, AIM = 1.0, 0.6
"""CPU time of the server, as a multiple of the peer's."""
TOPICS = ["servos", "telemetry", "events", "jobs", "bus"]
"""The subscription of the page, for every servo."""


def figures() -> Iterator[dict[str, Any]]:
    """Share of a core the server takes, its background polling and its adapter included.

    `us_a_sample` compares versions: one that polls more sends more samples.
    """
    with (
        adapter("bench.serial_crowd", SERVOS) as (device, _),
        tempfile.TemporaryDirectory() as folder,
        server(["-m", "hornbill"], "serve", "--port", "0", "--data-dir", folder, "--bus", f"slcan:{device}") as (
            url,
            pid,
        ),
    ):
        wait_until_ready(url, SERVOS)
        seen, share = asyncio.run(_watch(pid, url.replace("http", "ws") + "api/v1/ws"))
        bus = httpx.get(url + "api/v1/bus").json()
    peer = _peer_s_a_frame() * bus["rx_fps"]
    figures = {
        "times": round(share / peer, 2), "peer_core_pct": round(peer * 100, 1),
        "servos": SERVOS, "core_pct": round(share * 100, 1),
        "us_a_sample": round(share * 1e6 * MEASURED_S / seen.samples),
        "samples_per_s": round(seen.samples / MEASURED_S),
        "messages_per_s": round(seen.messages / MEASURED_S), "kB_per_s": round(seen.bytes / MEASURED_S / 1000),
        "rx_fps": bus["rx_fps"], "tx_fps": bus["tx_fps"],
    }  # fmt: skip
    yield line(
        "125 servos stream into the server, one WebSocket", figures, of="times", must=MUST, aim=AIM, peer=PYDRONECAN
    )


def _peer_s_a_frame() -> float:
    """CPU seconds in which pydronecan decodes one frame of a full bus."""
    mix = saturated_mix(1)
    raw = [CANFrame(frame.id, frame.data, True, ts_monotonic=frame.at, ts_real=frame.at) for frame in mix]
    return min(cpu(lambda: decode_with_peer(raw)) for _ in range(3)) / len(raw)


@dataclass
class _Seen:
    messages: int = 0
    bytes: int = 0
    samples: int = 0


async def _watch(pid: int, address: str) -> tuple[_Seen, float]:
    """Messages over one socket in MEASURED_S, and the CPU seconds per second of the server."""
    async with connect(address, max_size=None) as socket:
        await socket.send(orjson.dumps({"type": "subscribe", "topics": TOPICS}).decode())
        async with asyncio.timeout(2.0):
            while True:  # what was recalled at the start is not what streaming costs
                await socket.recv()
                if orjson.loads(await socket.recv())["type"] == "telemetry":
                    break
        await asyncio.sleep(1.0)
        seen, began, cpu = _Seen(), time.monotonic(), cpu_s(pid)
        while time.monotonic() - began < MEASURED_S:
            text = await socket.recv()
            seen.messages += 1
            seen.bytes += len(text)
            message = orjson.loads(text)
            if message["type"] == "telemetry":
                seen.samples += sum(len(column["t"]) for column in message["channels"].values())
        return seen, (cpu_s(pid) - cpu) / (time.monotonic() - began)
