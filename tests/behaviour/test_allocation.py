"""Servos without a node id get one from the host, by the rules of the public Allocation type, and keep it."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import pytest

import bench.allocation
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.node.allocation import serve_allocation
from hornbill.node.allocator import Allocator, AllocatorStatus
from hornbill.node.directory import Directory
from hornbill.node.participant import Participant
from hornbill.schema.catalog import Catalog
from hornbill.sim.bench.bench import Bench
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.store import Store
from hornbill.units import NodeId, Uid
from hornbill.wire.port import CanPort
from jumping_clock import run
from unit.node.allocatee import Allocatee
from unit.node.ideal import IdealAllocator
from unit.node.peer import Peer, participant

CATALOG = Catalog.load()


@dataclass
class Host:
    """The part of the product that gives node ids, on one port and with one store."""

    store: Store
    node: Participant
    directory: Directory
    allocator: Allocator

    @classmethod
    def start(cls, port: CanPort, folder: Path, *, node_id: int = 127) -> "Host":
        store = Store(folder)
        node = participant(port, node_id=node_id)
        directory = Directory()
        allocator = Allocator(store.allocations, own_ids=frozenset({node_id}), known_nodes=directory)
        node.start()
        directory.follow(node)
        serve_allocation(node, allocator)
        return cls(store, node, directory, allocator)

    async def kill(self) -> None:
        """The process ends."""
        await self.node.close()
        await self.node.port.close()
        self.store.close()


def uid(number: int) -> bytes:
    """As of one production batch: the first two parts are the same in all of them."""
    return b"BLA21-" + b"2024\0\0" + number.to_bytes(4, "big")


def unlike(number: int) -> bytes:
    """Of sixteen bytes that have nothing in common."""
    return sha256(number.to_bytes(4)).digest()[:16]


def cold(bus: MemoryBus, count: int, *, seed: int = 1, uid_of: Callable[[int], bytes] = uid) -> list[Allocatee]:
    return [Allocatee(bus.port(f"servo{n}"), uid_of(n), seed=seed * 1000 + n) for n in range(count)]


async def until(condition: Callable[[], bool], *, limit: float) -> float:
    """Wait, looking every millisecond; the seconds it took. Fails after `limit` seconds."""
    loop = asyncio.get_running_loop()
    began = loop.time()
    while not condition():
        assert loop.time() - began < limit, f"not within {limit} s"
        await asyncio.sleep(0.001)
    return loop.time() - began


def all_have_ids(servos: list[Allocatee]) -> bool:
    return all(servo.node_id for servo in servos)


def ids(servos: list[Allocatee]) -> list[int]:
    return [servo.node_id for servo in servos]


@pytest.mark.parametrize("uid_of", [uid, unlike])
def test_sixteen_cold_servos_get_sixteen_ids_and_answers_at_once(
    tmp_path: Path, uid_of: Callable[[int], bytes]
) -> None:
    async def play() -> None:
        bus = MemoryBus()
        host = Host.start(bus.port("host"), tmp_path)
        servos = cold(bus, 16, uid_of=uid_of)
        await until(lambda: all_have_ids(servos), limit=25)
        assert sorted(ids(servos)) == list(range(110, 126))
        delays = [delay for servo in servos for delay in servo.answer_delays]
        assert len(delays) >= 3 * 16
        assert max(delays) < 0.005
        assert host.store.allocations.entries() == {servo.unique_id.hex(): servo.node_id for servo in servos}
        assert host.allocator.pending(host.node.clock()) == []
        await asyncio.sleep(1.1)
        assert sorted(host.directory.records) == list(range(110, 126))
        await host.kill()

    run(play())


def test_sixteen_servos_take_no_longer_than_with_an_ideal_allocator(tmp_path: Path) -> None:
    async def play(seed: int, *, ideal: bool) -> float:
        bus = MemoryBus()
        host = None if ideal else Host.start(bus.port("host"), tmp_path / str(seed))
        if ideal:
            IdealAllocator(bus.port("ideal"))
        servos = cold(bus, 16, seed=seed, uid_of=unlike)
        took = await until(lambda: all_have_ids(servos), limit=25)
        if host is not None:
            await host.kill()
        return took

    ours = [run(play(seed, ideal=False)) for seed in range(5)]
    best = [run(play(seed, ideal=True)) for seed in range(5)]
    assert sum(ours) <= 1.05 * sum(best)


def test_nor_do_simulated_servos_while_the_whole_server_identifies_and_polls_them() -> None:
    """`make bench` does the same with sixteen servos and more seeds."""
    ours = [bench.allocation.ours(seed, servos=6) for seed in (1, 2, 3)]
    best = [bench.allocation.ideal(seed, servos=6) for seed in (1, 2, 3)]
    assert sum(ours) <= 1.05 * sum(best)


def test_servos_keep_their_ids_when_they_restart_and_when_the_host_does(tmp_path: Path) -> None:
    async def play() -> None:
        bus = MemoryBus()
        host = Host.start(bus.port("host"), tmp_path)
        servos = cold(bus, 4)
        await until(lambda: all_have_ids(servos), limit=10)
        before = ids(servos)
        for servo in servos:
            servo.restart()
        await until(lambda: all_have_ids(servos), limit=10)
        assert ids(servos) == before
        await host.kill()
        for servo in reversed(servos):
            servo.restart()
        host = Host.start(bus.port("host again"), tmp_path)
        await until(lambda: all_have_ids(servos), limit=10)
        assert ids(servos) == before
        await host.kill()

    run(play())


def test_a_servo_that_restarts_a_hundred_times_has_one_id(tmp_path: Path) -> None:
    async def play() -> None:
        bus = MemoryBus()
        host = Host.start(bus.port("host"), tmp_path)
        servo, *_ = servos = cold(bus, 2)
        await until(lambda: all_have_ids(servos), limit=10)
        first = servo.node_id
        for _ in range(100):
            servo.restart()
            await until(lambda: all_have_ids(servos), limit=10)
            assert servo.node_id == first
        assert len(host.store.allocations.entries()) == 2
        await host.kill()

    run(play())


@pytest.mark.parametrize("stage", [1, 2])
def test_a_host_that_dies_in_the_middle_leaves_nobody_without_an_id(tmp_path: Path, stage: int) -> None:
    async def play() -> None:
        bus = MemoryBus()
        host = Host.start(bus.port("host"), tmp_path)
        servos = cold(bus, 2)
        pending = host.allocator.pending
        await until(lambda: any(each.stage >= stage for each in pending(host.node.clock())), limit=5)
        await host.kill()
        assert not any(ids(servos))
        host = Host.start(bus.port("host again"), tmp_path)
        await until(lambda: all_have_ids(servos), limit=10)
        assert sorted(ids(servos)) == [124, 125]
        await host.kill()

    run(play())


def test_a_lost_last_answer_costs_one_more_round_and_no_second_id(tmp_path: Path) -> None:
    async def play() -> None:
        bus = MemoryBus()
        host = Host.start(bus.port("host"), tmp_path)
        (servo,) = cold(bus, 1)

        def cut(_uid: Uid, _node_id: NodeId) -> None:
            bus.loss(100)

        host.allocator.on_granted.append(cut)
        await until(lambda: bool(host.store.allocations.entries()), limit=5)
        await asyncio.sleep(0.01)
        assert servo.node_id == 0
        host.allocator.on_granted.clear()
        bus.loss(0)
        took = await until(lambda: all_have_ids([servo]), limit=5)
        assert took < 1.0 + 2 * 0.4 + 0.01  # a new first request, and two follow-ups
        assert servo.node_id == 125
        assert len(host.store.allocations.entries()) == 1
        await host.kill()

    run(play())


def test_with_a_fifth_of_all_frames_lost_everybody_gets_an_id_of_their_own(tmp_path: Path) -> None:
    async def play() -> None:
        bus = MemoryBus()
        bus.loss(20, seed=3)
        host = Host.start(bus.port("host"), tmp_path)
        servos = cold(bus, 8)
        await until(lambda: all_have_ids(servos), limit=120)
        assert len(set(ids(servos))) == 8
        assert host.store.allocations.entries() == {servo.unique_id.hex(): servo.node_id for servo in servos}
        await host.kill()

    run(play())


def test_simulated_servos_of_every_kind_get_ids_and_keep_them_through_a_power_cut(tmp_path: Path) -> None:
    async def play() -> None:
        bus = MemoryBus()
        host = Host.start(bus.port("host"), tmp_path)
        bench = Bench(bus.port, CATALOG, seed=4)
        new = [bench.add(Recipe(name, model.firmware[-1])) for name, model in CATALOG.models.items()]
        static = bench.add(Recipe("BLA21-06U-A0", "1.300", node_id=124))
        await bench.start()
        await until(lambda: all(servo.node_id for servo in new), limit=20)
        before = [servo.node_id for servo in new]
        assert len({*before, static.node_id}) == len(new) + 1
        assert static.node_id == 124
        for on in (False, True):
            for uid in bench.servos:
                bench.power(uid, on)
            await asyncio.sleep(0.01)
        assert not any(servo.node_id for servo in new)
        await until(lambda: all(servo.node_id for servo in new), limit=20)
        assert [servo.node_id for servo in new] == before
        await bench.close()
        await host.kill()

    run(play())


def test_a_node_with_an_id_of_its_own_keeps_it(tmp_path: Path) -> None:
    async def play() -> None:
        bus = MemoryBus()
        host = Host.start(bus.port("host"), tmp_path)
        settled = Peer(bus.port("settled"), 125)
        (servo,) = cold(bus, 1)
        settled.say_status(9)
        await until(lambda: all_have_ids([servo]), limit=5)
        assert servo.node_id == 124
        await host.kill()

    run(play())


def test_a_pinned_id_is_taken_at_the_next_start(tmp_path: Path) -> None:
    async def play() -> None:
        bus = MemoryBus()
        host = Host.start(bus.port("host"), tmp_path)
        (servo,) = cold(bus, 1)
        await until(lambda: all_have_ids([servo]), limit=5)
        (uid_kept,) = host.store.allocations.entries()
        host.store.allocations.pin(uid_kept, NodeId(17))
        servo.restart()
        await until(lambda: all_have_ids([servo]), limit=5)
        assert servo.node_id == 17
        await host.kill()

    run(play())


def test_two_hosts_on_one_bus_agree_who_answers(tmp_path: Path) -> None:
    async def play() -> None:
        bus = MemoryBus()
        one = Host.start(bus.port("one"), tmp_path / "one", node_id=127)
        other = Host.start(bus.port("other"), tmp_path / "other", node_id=126)
        servos = cold(bus, 6)
        await until(lambda: all_have_ids(servos), limit=30)
        assert len(set(ids(servos))) == 6
        states = [one.allocator.state, other.allocator.state]
        assert sorted(states) == [AllocatorStatus.ON, AllocatorStatus.STANDBY]
        await one.kill()
        late = Allocatee(bus.port("late"), uid(99), seed=9)
        await until(lambda: all_have_ids([late]), limit=15)
        assert late.node_id not in ids(servos)
        await other.kill()

    run(play())
