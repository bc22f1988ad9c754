"""Reading every parameter: bus time on the virtual clock, and the host's CPU."""

import asyncio
import statistics
import time
from collections.abc import Awaitable, Callable, Collection, Iterator, Sequence
from typing import Any, TypeVar

import jumping_clock as clock
from behaviour.rig import CATALOG, Rig, play
from bench.crowd import ALL_ROWS, FIRMWARE, Crowd, CrowdPort
from bench.line import line
from hornbill.servo.device.identification import read_rows
from hornbill.servo.device.requests import READ
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.host import Host, HostSettings
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.store import Store
from hornbill.wire.port import CanPort
from hornbill.wire.services import EMPTY, GetSetRequest

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
    yield bus_time(MANY, must=1.4, aim=1.1)
    yield cpu_time(must=1.5)


def bus_time(count: int, *, must: float, aim: float) -> dict[str, Any]:
    """Simulated servos that respond immediately, on the embedded bus."""

    async def scene(rig: Rig) -> dict[str, Any]:
        took, rows = await _read(await rig.ready(count), rig.host)
        limit = rows * READ_S / (1 - count * STREAM_SHARE)
        figures = {"rows": rows, "bus_s": round(took, 4), "limit_s": round(limit, 4), "ratio": round(took / limit, 3)}
        return line(
            f"read every parameter of {count}: bus time", figures, must=must, aim=aim, limit="the bits of the frames"
        )

    return play(scene, *_recipes(count))


def cpu_time(*, must: float) -> dict[str, Any]:
    """The host with prepared responses, compared with the same requests without what it does with their responses.

    Both include the prepared bus.
    """

    async def scene(host: Host) -> dict[str, Any]:
        servos = await ready(host, MANY)
        rows, pairs = 0, list[tuple[float, float]]()
        for _ in range(ROUNDS):
            began = time.process_time()
            _, rows = await _read(servos, host)
            between = time.process_time()
            await requests_alone(host, servos, times=1)
            pairs.append((between - began, time.process_time() - between))
        figures = {"rows": rows, **compared(pairs)}
        return line(
            f"read every parameter of {MANY}: CPU of the host, of that of its requests",
            figures,
            must=must,
            limit="its requests alone",
        )

    crowd = Crowd(CATALOG, MANY)
    return clock.run(with_host(scene, lambda: CrowdPort(crowd)))


async def requests_alone(
    host: Host, servos: Sequence[Servo], *, times: int, rows: Collection[str] | None = None
) -> None:
    """Read rows, by default all, that many times with requests of the participant, and ignore the responses."""
    participant = host.requests.connected()

    async def read(servo: Servo) -> None:
        assert servo.node_id is not None
        for _ in range(times):
            for key in servo.registers if rows is None else rows:
                name = servo.registers[key].parameter.name
                await participant.request(servo.node_id, GetSetRequest(0, EMPTY, name), **READ.options)

    await asyncio.gather(*map(read, servos))


def compared(pairs: Sequence[tuple[float, float]]) -> dict[str, float]:
    """CPU milliseconds of both, and their ratio."""
    return {
        "cpu_ms": round(statistics.median(mine for mine, _ in pairs) * 1000, 1),
        "alone_ms": round(statistics.median(theirs for _, theirs in pairs) * 1000, 1),
        "ratio": round(statistics.median(mine / theirs for mine, theirs in pairs), 2),
    }


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
