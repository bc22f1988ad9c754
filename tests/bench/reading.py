"""Reading every parameter: bus time on the virtual clock, the host's CPU alone, and wall time in real time."""

import asyncio
import statistics
import time
from collections.abc import Awaitable, Callable, Iterator
from typing import Any, TypeVar

import jumping_clock as clock
from behaviour.rig import CATALOG, Rig, play
from bench.crowd import ALL_ROWS, FIRMWARE, Crowd, CrowdPort
from bench.line import line
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.servo.device.identification import read_rows
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.host import Host, HostSettings
from hornbill.sim.bench.bench import Bench
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.store import Store
from hornbill.wire.port import CanPort

READ_S = 534e-6
"""One read by name: 534 bits with real stuffing at 1 Mbit/s."""

STREAM_SHARE = 0.0026
"""Share of the bus for Status and NodeStatus of one servo."""

MANY = 16
ROUNDS = 5

T = TypeVar("T")


def figures() -> Iterator[dict[str, Any]]:
    """All 55 rows of one servo and of sixteen, while they stream, with background polling."""
    yield bus_time(1, must=1.3, aim=1.1)
    yield cpu_time(1, must=15, aim=8)
    yield bus_time(MANY, must=1.4, aim=1.1)
    yield cpu_time(MANY, must=250, aim=120)
    yield wall_time()


def bus_time(count: int, *, must: float, aim: float) -> dict[str, Any]:
    """Simulated servos that respond immediately, on the embedded bus."""

    async def scene(rig: Rig) -> dict[str, Any]:
        took, rows = await _read(await rig.ready(count), rig.host)
        limit = rows * READ_S / (1 - count * STREAM_SHARE)
        figures = {"rows": rows, "bus_s": round(took, 4), "limit_s": round(limit, 4), "ratio": round(took / limit, 3)}
        return line(f"read every parameter of {count}: bus time", figures, must=must, aim=aim)

    return play(scene, *_recipes(count))


def cpu_time(count: int, *, must: float, aim: float) -> dict[str, Any]:
    """The host with prepared responses; includes the prepared bus."""

    async def scene(host: Host) -> dict[str, Any]:
        servos = await ready(host, count)
        rows, spent = 0, list[float]()
        for _ in range(ROUNDS):
            began = time.process_time()
            _, rows = await _read(servos, host)
            spent.append(time.process_time() - began)
        took = statistics.median(spent)
        figures = {"rows": rows, "cpu_ms": round(took * 1000, 1), "us_each": round(took / rows * 1e6, 1)}
        return line(f"read every parameter of {count}: CPU of the host", figures, of="cpu_ms", must=must, aim=aim)

    crowd = Crowd(CATALOG, count)
    return clock.run(with_host(scene, lambda: CrowdPort(crowd)))


def wall_time() -> dict[str, Any]:
    """Sixteen on the embedded bus in real time, host and simulated servos in this one process."""

    async def run() -> dict[str, Any]:
        bus = MemoryBus()
        bench = Bench(bus.port, CATALOG)
        for recipe in _recipes(MANY):
            bench.add(recipe)

        async def scene(host: Host) -> dict[str, Any]:
            await bench.start()
            took, rows = await _read(await ready(host, MANY), host)
            figures = {"rows": rows, "wall_s": round(took, 3)}
            return line(
                f"read every parameter of {MANY}: wall time, servos simulated in the same process", figures,
                of="wall_s", must=1.5, aim=0.8,
            )  # fmt: skip

        try:
            return await with_host(scene, lambda: bus.port("host"))
        finally:
            await bench.close()

    return asyncio.run(run())


async def _read(servos: list[Servo], host: Host) -> tuple[float, int]:
    """Seconds on the loop's clock, and how many rows."""
    loop = asyncio.get_running_loop()
    began = loop.time()
    await asyncio.gather(*(read_rows(host.requests, servo) for servo in servos))
    took = loop.time() - began
    assert all(
        register.at is not None and register.at >= began for one in servos for register in one.registers.values()
    )
    return took, sum(len(servo.registers) for servo in servos)


async def ready(host: Host, count: int) -> list[Servo]:
    """Wait until that many servos are ready."""
    while len(found := [one for one in host.fleet.all() if one.state is State.READY]) < count:
        await asyncio.sleep(0.05)
    return found


async def with_host(scene: Callable[[Host], Awaitable[T]], port: Callable[[], CanPort]) -> T:
    """Play a scene with a host on this port and a database in memory."""

    async def open_port(_address: str, _bitrate: int) -> CanPort:
        return port()

    loop, epoch = asyncio.get_running_loop(), time.time()
    began = loop.time()

    def wall() -> float:
        return epoch + loop.time() - began  # goes with a clock that jumps

    kept = Store("sqlite://", wall=wall)
    host = Host(CATALOG, kept, open_port, HostSettings(127, bytes(range(16)), (0, 1)), wall=wall)
    try:
        await host.connect("canned:", 1_000_000)
        return await scene(host)
    finally:
        await host.close()
        kept.close()


def _recipes(count: int) -> list[Recipe]:
    return [Recipe(ALL_ROWS, FIRMWARE, servo_id=1 + n, node_id=10 + n) for n in range(count)]
