"""Jog with twenty servos streaming: from the socket's message to its frame, in bus time and in wall time."""

import asyncio
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import orjson

from behaviour.rig import CATALOG, PLAIN, Rig, Socket, json, play
from bench.crowd import STATUS_S
from bench.line import line
from bench.reading import ready, with_host
from hornbill.api.live.event_log import EventLog
from hornbill.api.live.session import SocketSession
from hornbill.api.live.socket_queue import SocketQueue
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.servo.host import Host
from hornbill.sim.bench.bench import Bench
from hornbill.sim.bench.recipe import Recipe
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import GetSetRequest

SERVOS = 20
COMMANDS = 200
EVERY_S = 0.02
CHANNELS = ["current_angle", "current_speed", "current_torque"]


def figures() -> Iterator[dict[str, Any]]:
    """Milliseconds from the arrival of a `command` message to the last bit, or the transmission, of its frame."""
    for spread in (True, False):
        yield play(partial(bus_time, spread=spread), *_recipes())
    yield asyncio.run(wall_time())


async def bus_time(rig: Rig, *, spread: bool) -> dict[str, Any]:
    """On the virtual clock: the cost of the bus and of the queues, with telemetry of all servos.

    Switched on in one instant, all twenty say their Status (two frames, and before anything of ours) in one breath of
    5 ms, ten times a second; `spread` over the period, as clocks of their own have it after a while.
    """
    loop = asyncio.get_running_loop()
    servos = await rig.ready(SERVOS)
    if spread:
        for servo in servos:
            rig.bench.power(servo.uid, False)
        await asyncio.sleep(4)
        for servo in servos:
            rig.bench.power(servo.uid, True)
            await asyncio.sleep(STATUS_S / SERVOS)
        await asyncio.sleep(5)
        servos = await rig.ready(SERVOS)
    for servo in servos:
        options = {"channels": CHANNELS, "rate_hz": 20}
        json(await rig.call("PUT", f"/servos/{servo.uid}/telemetry", options))
    lease = await rig.lease()
    socket = Socket(rig.app)
    await socket.receive("hello")
    said: dict[int, float] = {}
    rig.bus.history.clear()
    for n in range(COMMANDS):
        await asyncio.sleep(EVERY_S + n % 7 / 1000)
        if n % 20 == 0:
            await rig.call("PUT", f"/leases/{lease}")
        said[n] = loop.time()
        uid = servos[n // 50].uid  # each is jogged for some seconds
        command = {"uid": uid, "type": "angle", "value": n / 10}
        socket.send(type="command", lease=lease, commands=[command])
    await asyncio.sleep(0.5)
    sent = _angles([frame for name, frame in rig.bus.history if name == "host"])
    await socket.close()
    took = [sent[n] - at for n, at in said.items() if n in sent]
    name = "jog: socket to frame, bus time" + ("" if spread else ", all Statuses at once")
    return _line(name, took, must=5 if spread else 10, limit="the Statuses that are sent first, 5 ms at once")


async def wall_time() -> dict[str, Any]:
    """In real time, with the host and the twenty simulated servos in this one process."""
    bus = MemoryBus()
    bench = Bench(bus.port, CATALOG)
    for recipe in _recipes():
        bench.add(recipe)

    async def scene(host: Host) -> dict[str, Any]:
        await bench.start()
        servos = await ready(host, SERVOS)
        lease = host.leases.grant("bench", 60.0, host.base.now())
        session = SocketSession(host, SocketQueue(EventLog(host, demo=False)))
        said: dict[int, float] = {}
        frames: list[Frame] = []
        assert host.connection is not None
        host.connection.participant.on_frames.append(lambda batch, ours: frames.extend(batch) if ours else None)
        for n in range(COMMANDS):
            await asyncio.sleep(EVERY_S)
            host.leases.renew(lease.id, host.base.now())
            command = {"uid": servos[n // 100].uid, "type": "angle", "value": n / 10}
            text = orjson.dumps({"type": "command", "lease": lease.id, "commands": [command]}).decode()
            said[n] = host.base.now()
            await session.handle(text)
        await asyncio.sleep(0.5)
        sent = _angles(frames)
        session.close()
        took = [sent[n] - at for n, at in said.items() if n in sent]
        name = "jog: socket to frame, wall time, servos simulated in the same process"
        return _line(name, took, must=5, limit="a quarter of the period of a jog, 50 Hz")

    try:
        return await with_host(scene, lambda: bus.port("host"))
    finally:
        await bench.close()


def _angles(frames: Sequence[Frame]) -> dict[int, float]:
    """When each angle, in 0.1°, was first written to 0x00."""
    found: dict[int, float] = {}
    for transfer in Reassembler().feed(list(frames)):
        if transfer.kind is Kind.REQUEST and transfer.type_id == GetSetRequest.TYPE.id:
            request = GetSetRequest.decode(transfer.payload)
            if request is not None and request.name == "0x00" and isinstance(request.value.value, int):
                found.setdefault(request.value.value, transfer.at)
    return found


def _line(name: str, took: list[float], *, must: float, limit: str) -> dict[str, Any]:
    ranked = sorted(1000 * one for one in took)
    at = {"ms_median": 0.5, "ms_p99": 0.99, "ms_max": 1.0}
    # only the newest of the values that arrive while another waits for its response is sent
    figures = {key: round(ranked[min(int(share * len(ranked)), len(ranked) - 1)], 3) for key, share in at.items()}
    name = f"{name}, {SERVOS} servos streaming"
    return line(name, {"jogs": len(ranked), **figures}, of="ms_p99", must=must, limit=limit)


def _recipes() -> list[Recipe]:
    return [replace(PLAIN, node_id=10 + n, servo_id=1 + n) for n in range(SERVOS)]
