"""Clients that are connected while a stop is measured: `python -m bench.stop_listeners URL SOCKETS`.

In a separate process: its work must not delay the measurement.
"""

import asyncio
import sys

import httpx
import orjson
from websockets.asyncio.client import connect

TOPICS = ["servos", "telemetry", "events", "jobs", "bus"]


async def look_on(url: str, sockets: int) -> None:
    """Sockets that receive everything, and a client that reads every parameter of each servo, until ended."""

    async def listen() -> None:
        async with connect(url.replace("http", "ws") + "api/v1/ws", max_size=None) as socket:
            await socket.send(orjson.dumps({"type": "subscribe", "topics": TOPICS}).decode())
            while True:
                await socket.recv()

    async def read() -> None:
        async with httpx.AsyncClient(base_url=url + "api/v1", timeout=60) as api:
            uids = [one["uid"] for one in (await api.get("/servos")).json()]
            while True:
                for uid in uids:
                    (await api.get(f"/servos/{uid}/parameters?refresh=true")).raise_for_status()

    async with asyncio.TaskGroup() as group:
        for _ in range(sockets):
            group.create_task(listen())
        group.create_task(read())


if __name__ == "__main__":
    asyncio.run(look_on(sys.argv[1], int(sys.argv[2])))
