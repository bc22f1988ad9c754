"""The bench: simulated servos on an event loop and a bus, added, removed and switched off."""

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import replace
from itertools import count

import pytest

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.errors import InvalidValue, PortOpenFailed, Unknown
from hornbill.sim.bench.bench import Bench, demo_fleet
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Uid
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort
from jumping_clock import run
from unit.node.ideal import IdealAllocator
from unit.sim.desk import catalog


@pytest.fixture
def bus() -> MemoryBus:
    bus = MemoryBus(history=4000)
    bus.port("listener")
    return bus


@pytest.fixture
@asynccontextmanager
async def bench(bus: MemoryBus) -> AsyncGenerator[Bench]:
    """A running bench."""
    bench = Bench(bus.port, catalog(), 1)
    await bench.start()
    yield bench
    await bench.close()


@pytest.mark.parametrize("seed", [1, 2, 3])
async def test_six_demo_servos_are_up_within_8_seconds(seed: int) -> None:
    bus = MemoryBus()
    IdealAllocator(bus.port("host"))
    bench = Bench(bus.port, catalog(), seed)
    for recipe in demo_fleet(catalog(), 6, seed):
        bench.add(recipe)
    await bench.start()
    loop = asyncio.get_running_loop()
    began = loop.time()
    while not all(servo.node_id for servo in bench.servos.values()):
        await asyncio.sleep(0.01)
        assert loop.time() - began < 8.0
    node_ids = [servo.node_id for servo in bench.servos.values()]
    assert len(set(node_ids)) == 6
    await bench.close()


async def test_a_running_bus_carries_the_status_of_every_servo(bus: MemoryBus, bench: Bench) -> None:
    for node_id in range(10, 26):
        bench.add(Recipe(node_id=node_id))
    await asyncio.sleep(5.0)
    sources = [frame.id & 0x7F for _, frame in bus.history]
    # 10 Status of two frames and one NodeStatus a second.
    assert {node_id: round(sources.count(node_id) / 105, 1) for node_id in range(10, 26)} == dict.fromkeys(
        range(10, 26), 1.0
    )
    assert bus.load() == pytest.approx(0.042, abs=0.01)


async def test_servos_are_added_and_removed_while_the_bus_runs(bench: Bench) -> None:
    await bench.start()  # idempotent
    servo = bench.add(Recipe(node_id=10))
    uid = Uid(servo.uid.hex())
    await asyncio.sleep(0.3)
    assert servo.node_id == 10
    assert bench.servo(uid) is servo
    await bench.remove(uid)
    assert bench.servos == {}
    with pytest.raises(Unknown):
        await bench.remove(uid)
    await asyncio.sleep(1.0)


async def test_power_off_ends_transmission_and_power_on_restarts(bus: MemoryBus, bench: Bench) -> None:
    servo = bench.add(Recipe(node_id=10))
    uid = Uid(servo.uid.hex())
    await asyncio.sleep(1.0)
    bench.power(uid, on=False)
    await asyncio.sleep(0.1)
    sent = len(bus.history)
    assert sent
    await asyncio.sleep(5.0)
    assert len(bus.history) == sent
    bench.power(uid, on=True)
    await asyncio.sleep(1.0)
    assert len(bus.history) > sent
    assert servo.starts == 2


async def test_a_horn_without_torque_can_be_turned_manually(bench: Bench) -> None:
    servo = bench.add(Recipe(node_id=10, rom={"torque_mode": 1}))
    await asyncio.sleep(0.5)
    assert bench.turn_manually(Uid(servo.uid.hex()), 33.0)
    assert servo.register(0x08) == 330


async def test_a_closed_port_does_not_stop_the_bench() -> None:
    bus = MemoryBus()
    ports = [bus.port("servo")]
    bench = Bench(lambda _name: ports[0], catalog())
    servo = bench.add(Recipe(node_id=10))
    await bench.start()
    await asyncio.sleep(0.5)
    await ports[0].close()
    await asyncio.sleep(2.0)
    assert servo.next_due() > asyncio.get_running_loop().time()
    await bench.close()


def test_invalid_servos_are_refused() -> None:
    names = count()
    bench = Bench(lambda _name: MemoryBus().port(f"{next(names)}"), catalog())
    with pytest.raises(InvalidValue, match="Unknown model"):  # test_recipe.py has the other cases
        bench.add(Recipe("BLA99"))
    uid = bytes(16)
    bench.add(Recipe(uid=uid))
    with pytest.raises(ValueError, match="already"):
        bench.add(Recipe(uid=uid))


def test_the_same_seed_gives_the_same_bench() -> None:
    def uids(seed: int) -> list[Uid]:
        bench = Bench(lambda _name: MemoryBus().port("x"), catalog(), seed)
        for _ in range(3):
            bench.add(Recipe())
        return list(bench.servos)

    assert uids(1) == uids(1)
    assert len(set(uids(1) + uids(2))) == 6


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

    bench = Bench(opened, catalog())
    await bench.start()
    uid = Uid(bench.add(Recipe(node_id=10)).uid.hex())
    ends = await asyncio.gather(bench.remove(uid), bench.remove(uid), return_exceptions=True)
    assert [type(end) for end in ends] == [type(None), Unknown]


async def test_a_servo_without_a_port_is_not_added() -> None:
    def opened(name: str) -> CanPort:
        raise PortOpenFailed(f"{name} finds no place.", cause=None, address=name)

    bench = Bench(opened, catalog())
    await bench.start()
    with pytest.raises(PortOpenFailed):
        bench.add(Recipe(node_id=10))
    assert bench.servos == {}
    await bench.close()


def test_the_same_seed_and_the_same_calls_give_the_same_frames() -> None:
    def frames(seed: int) -> list[tuple[str, Frame]]:
        async def scenario() -> list[tuple[str, Frame]]:
            bus = MemoryBus(history=100_000)
            IdealAllocator(bus.port("allocator"))
            bench = Bench(bus.port, catalog(), seed)
            for recipe in demo_fleet(catalog(), 8, 5):
                bench.add(replace(recipe, uid=None))
            await bench.start()
            await asyncio.sleep(4.0)
            uid = next(iter(bench.servos))
            bench.power(uid, on=False)
            await asyncio.sleep(0.5)
            bench.power(uid, on=True)
            bench.servo(uid).faults.inject("watchdog_restart", on=True)
            await asyncio.sleep(1.5)
            await bench.close()
            return list(bus.history)

        return run(scenario())

    once = frames(1)
    assert len(once) > 500
    assert frames(1) == once
    assert [frame for _, frame in frames(2)] != [frame for _, frame in once]
