"""The bench: simulated servos on an event loop and a bus, added, removed and switched off."""

import asyncio
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.errors import PortOpenFailed, Unknown
from hornbill.sim.bench.bench import Bench, demo_fleet
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Uid
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort
from jumping_clock import run
from unit.node.ideal import IdealAllocator
from unit.sim.desk import catalog


@asynccontextmanager
async def running(opened: Callable[[str], CanPort], seed: int = 1) -> AsyncGenerator[Bench]:
    """A running bench."""
    bench = Bench(opened, catalog(), seed)
    await bench.start()
    await bench.start()  # idempotent
    yield bench
    await bench.close()


async def test_a_running_bus_carries_the_status_of_every_servo() -> None:
    bus, node_ids = MemoryBus(history=4000), range(10, 26)
    bus.port("listener")
    async with running(bus.port) as bench:
        for node_id in node_ids:
            bench.add(Recipe(node_id=node_id))
        await asyncio.sleep(5.0)
        sources = [frame.id & 0x7F for _, frame in bus.history]
        # 10 Status of two frames and one NodeStatus a second.
        assert [round(sources.count(node_id) / 105, 1) for node_id in node_ids] == [1.0] * len(node_ids)
        assert bus.load() == pytest.approx(0.042, abs=0.01)


async def test_a_closed_port_does_not_stop_the_bench() -> None:
    port = MemoryBus().port("servo")
    async with running(lambda _name: port) as bench:
        servo = bench.add(Recipe(node_id=10))
        await asyncio.sleep(0.5)
        await port.close()
        await asyncio.sleep(2.0)
        assert servo.next_due() > asyncio.get_running_loop().time()


async def test_of_two_simultaneous_removals_the_second_fails() -> None:
    bus = MemoryBus()

    def opened(name: str) -> CanPort:
        port = bus.port(name)
        close = port.close

        async def slowly() -> None:
            await asyncio.sleep(0.1)
            await close()

        port.close = slowly  # pyright: ignore[reportAttributeAccessIssue]
        return port

    async with running(opened) as bench:
        uid = Uid(bench.add(Recipe(node_id=10)).uid.hex())
        ends = await asyncio.gather(bench.remove(uid), bench.remove(uid), return_exceptions=True)
    assert [type(end) for end in ends] == [type(None), Unknown]


async def test_a_servo_without_a_port_is_not_added() -> None:
    def opened(name: str) -> CanPort:
        raise PortOpenFailed(f"{name} finds no place.", cause=None, address=name)

    async with running(opened) as bench:
        with pytest.raises(PortOpenFailed):
            bench.add(Recipe(node_id=10))
        assert bench.servos == {}


async def life(seed: int) -> list[tuple[str, Frame]]:
    """The frames of a bench with this seed on which a servo is switched off and on and gets a fault."""
    bus = MemoryBus(history=100_000)
    IdealAllocator(bus.port("allocator"))
    async with running(bus.port, seed) as bench:
        for recipe in demo_fleet(catalog(), 8, 5):
            bench.add(replace(recipe, uid=None))
        await asyncio.sleep(4.0)
        uid = next(iter(bench.servos))
        bench.power(uid, on=False)
        await asyncio.sleep(0.5)
        bench.power(uid, on=True)
        bench.servo(uid).faults.inject("watchdog_restart", on=True)
        await asyncio.sleep(1.5)
    return list(bus.history)


def test_the_same_seed_and_the_same_calls_give_the_same_frames() -> None:
    once = run(life(1))
    assert len(once) > 500
    assert run(life(1)) == once
    assert [frame for _, frame in run(life(2))] != [frame for _, frame in once]
