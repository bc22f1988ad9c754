"""Ten WebSockets at full telemetry: CPU the server takes for packing and sending, with and without sockets."""

import asyncio
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import orjson
import uvicorn
from websockets.asyncio.client import connect

from behaviour.rig import CATALOG
from bench.line import line
from hornbill.api.http import create_api
from hornbill.bus.listing import Adapters
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host, HostSettings
from hornbill.servo.runtime.hub import Sampled, ServoChanged
from hornbill.store.store import Store
from hornbill.units import Uid
from hornbill.wire.port import CanPort

SOCKETS = 10
SERVOS = 20
HZ = 50
CHANNELS = ("current_angle", "current_speed")
MEASURED_S = 3.0
ROUNDS = 3

LISTENING = b"listening\n"

TOPICS = '{"type":"subscribe","topics":["servos","telemetry","events","jobs","bus"]}'


def figures() -> Iterator[dict[str, Any]]:
    """CPU time of the server's process, minus that without clients, which run in another process."""
    yield asyncio.run(_measure())


async def _measure() -> dict[str, Any]:
    kept = Store("sqlite://")

    async def no_port(_address: str, _bitrate: int) -> CanPort:
        raise AssertionError

    host = Host(CATALOG, kept, no_port, HostSettings(127, bytes(range(16)), (0, 1)))
    app = create_api(CATALOG)
    app.state.host, app.state.adapters = host, Adapters(detectors={})
    config = uvicorn.Config(
        app, log_level="warning", access_log=False, ws="websockets-sansio", port=0, ws_per_message_deflate=False,
        lifespan="off",
    )  # fmt: skip
    server = uvicorn.Server(config)
    running = asyncio.create_task(server.serve())
    while not server.started:
        await asyncio.sleep(0.01)
    port = server.servers[0].sockets[0].getsockname()[1]
    servos = [_servo(host, number) for number in range(SERVOS)]
    sampling = asyncio.create_task(_sample(host, servos))
    try:
        shares: list[float] = []
        messages = samples = 0
        for _ in range(ROUNDS):
            alone = await _share()
            clients = await asyncio.create_subprocess_exec(
                sys.executable, "-m", "bench.sockets", str(port), stdout=subprocess.PIPE, cwd=Path(__file__).parents[1]
            )  # fmt: skip
            assert clients.stdout is not None
            assert await clients.stdout.readline() == LISTENING  # not before: until then it costs nothing
            shares.append(await _share() - alone)
            message, _ = await clients.communicate()
            messages, samples = map(int, message.split())
    finally:
        sampling.cancel()
        server.should_exit = True
        await running
        await host.close()
        kept.close()
    figures = {
        "sockets": SOCKETS, "servos": SERVOS, "core_pct": round(statistics.median(shares) * 100, 2),
        "messages_per_s": round(messages / MEASURED_S), "samples_per_s": round(samples / MEASURED_S),
    }  # fmt: skip
    return line(
        "ten sockets at full telemetry: packing and sending",
        figures,
        of="core_pct",
        must=5,
        limit="a twentieth of a core",
    )


def _servo(host: Host, number: int) -> Servo:
    """A servo as if it had been seen on a bus."""
    servo = host.fleet._servos[Uid(f"{number:032x}")] = Servo(Uid(f"{number:032x}"), CATALOG)  # pyright: ignore[reportPrivateUsage]
    servo.identify_as(CATALOG.models["BLA21-06U-A0"], 1300)
    servo.model_number, servo.online, servo.identified = 1, True, True
    return servo


async def _sample(host: Host, servos: list[Servo]) -> None:
    """Every channel at its rate, and a change of status a second a servo."""
    loop = asyncio.get_running_loop()
    began, turn = loop.time(), 0
    while True:
        for place, servo in enumerate(servos):
            for key in CHANNELS:
                host.hub.publish(Sampled(servo.uid, key, loop.time(), (turn * 7 + place) % 3600 / 10))
            if (turn + place) % HZ == 0:
                host.hub.publish(ServoChanged(servo.uid))
        turn += 1
        await asyncio.sleep(max(0.0, began + turn / HZ - loop.time()))


async def _share() -> float:
    """CPU seconds a second of this process."""
    began, cpu = time.monotonic(), time.process_time()
    await asyncio.sleep(MEASURED_S)
    return (time.process_time() - cpu) / (time.monotonic() - began)


async def _listen(port: int, all_here: asyncio.Barrier) -> tuple[int, int]:
    """Messages and samples over one socket in MEASURED_S after all are connected."""
    url = f"ws://127.0.0.1:{port}/api/v1/ws"
    # The closing handshake would wait behind all that is queued.
    async with connect(url, max_size=None, compression=None, close_timeout=0.1) as socket:
        await socket.send(TOPICS)
        began = time.monotonic()
        while time.monotonic() < began + 2.0:  # what was recalled at the start is not what streaming costs
            await socket.recv()
        if await all_here.wait() == 0:
            sys.stdout.buffer.write(LISTENING)
            sys.stdout.buffer.flush()
        messages = samples = 0
        until = time.monotonic() + MEASURED_S
        while time.monotonic() < until:
            message = await socket.recv()
            messages += 1
            samples += _samples(orjson.loads(message))
    return messages, samples


def _samples(message: dict[str, Any]) -> int:
    return sum(len(column["t"]) for column in message.get("channels", {}).values())


async def _clients(port: int) -> None:
    all_here = asyncio.Barrier(SOCKETS)
    found = await asyncio.gather(*(_listen(port, all_here) for _ in range(SOCKETS)))
    sys.stdout.write(f"{sum(messages for messages, _ in found)} {sum(samples for _, samples in found)}\n")


if __name__ == "__main__":
    asyncio.run(_clients(int(sys.argv[1])))
