"""Node ID allocation by the public Allocation type, with simulated servos and bare allocatees."""

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from hashlib import sha256
from inspect import Parameter, Signature, signature
from pathlib import Path

import pytest

import bench.allocation
from behaviour.rig import until
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.node.allocation import serve_allocation
from hornbill.node.allocator import Allocator, AllocatorStatus
from hornbill.node.directory import Directory
from hornbill.node.participant import Participant
from hornbill.schema.catalog import Catalog
from hornbill.sim.bench.bench import Bench
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo
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
    """The part of the product that allocates node IDs, on one port and with one store."""

    folder: Path
    store: Store
    node: Participant
    directory: Directory
    allocator: Allocator
    closed: bool = False

    @classmethod
    def start(cls, port: CanPort, folder: Path, *, node_id: int = 127) -> "Host":
        store = Store(folder)
        node = participant(port, node_id=node_id)
        directory = Directory()
        allocator = Allocator(store.allocations, own_ids=frozenset({node_id}), known_nodes=directory)
        node.start()
        directory.follow(node)
        serve_allocation(node, allocator)
        return cls(folder, store, node, directory, allocator)

    async def close(self) -> None:
        """End the process. Idempotent."""
        if self.closed:
            return
        self.closed = True
        await self.node.close()
        await self.node.port.close()
        self.store.close()


def uid(number: int) -> bytes:
    """The UID of one production batch: all share the first two parts."""
    return b"BLA21-" + b"2024\0\0" + number.to_bytes(4, "big")


def unrelated(number: int) -> bytes:
    """A UID that shares nothing with the others."""
    return sha256(number.to_bytes(4)).digest()[:16]


def new_servos(bus: MemoryBus, count: int, *, seed: int = 1, uid_of: Callable[[int], bytes] = uid) -> list[Allocatee]:
    return [Allocatee(bus.port(f"servo{n}"), uid_of(n), seed=seed * 1000 + n) for n in range(count)]


def allocating(act: Callable[..., Awaitable[None]]) -> Callable[..., None]:
    """Decorate a coroutine function `(bus, host, …)`: a test that plays it with a host on an empty bus."""

    @wraps(act)
    def test(tmp_path: Path, **arguments: object) -> None:
        async def play() -> None:
            bus = MemoryBus()
            host = Host.start(bus.port("host"), tmp_path)
            await act(bus, host, **arguments)
            await host.close()

        run(play())

    others = [each for name, each in signature(act).parameters.items() if name not in ("bus", "host")]
    test.__signature__ = Signature(  # pyright: ignore[reportAttributeAccessIssue]
        [Parameter("tmp_path", Parameter.POSITIONAL_OR_KEYWORD), *others]
    )
    return test


async def all_have_ids(servos: Sequence[Allocatee | SimulatedServo], limit: float = 10.0) -> float:
    """Wait until each has a node ID; the seconds it took."""
    loop = asyncio.get_running_loop()
    began = loop.time()
    await until(lambda: all(servo.node_id for servo in servos), limit, 0.001)
    return loop.time() - began


def ids(servos: list[Allocatee]) -> list[int]:
    return [servo.node_id for servo in servos]


@pytest.mark.parametrize("uid_of", [uid, unrelated])
@allocating
async def test_sixteen_new_servos_get_sixteen_ids_with_prompt_responses(
    bus: MemoryBus, host: Host, uid_of: Callable[[int], bytes]
) -> None:
    servos = new_servos(bus, 16, uid_of=uid_of)
    await all_have_ids(servos, 25)
    assert sorted(ids(servos)) == list(range(110, 126))
    delays = [delay for servo in servos for delay in servo.response_delays]
    assert len(delays) >= 3 * 16
    assert max(delays) < 0.005
    assert host.store.allocations.entries() == {servo.unique_id.hex(): servo.node_id for servo in servos}
    assert host.allocator.pending(host.node.clock()) == []
    await asyncio.sleep(1.1)
    assert sorted(host.directory.records) == list(range(110, 126))


def test_sixteen_servos_take_no_longer_than_with_an_ideal_allocator(tmp_path: Path) -> None:
    async def play(seed: int, *, ideal: bool) -> float:
        bus = MemoryBus()
        host = None if ideal else Host.start(bus.port("host"), tmp_path / str(seed))
        if ideal:
            IdealAllocator(bus.port("ideal"))
        servos = new_servos(bus, 16, seed=seed, uid_of=unrelated)
        took = await all_have_ids(servos, 25)
        if host is not None:
            await host.close()
        return took

    ours = [run(play(seed, ideal=False)) for seed in range(3)]
    best = [run(play(seed, ideal=True)) for seed in range(3)]
    assert sum(ours) <= 1.05 * sum(best)


def test_simulated_servos_take_no_longer_while_the_server_identifies_them() -> None:
    """`make bench` does the same with sixteen servos and more seeds."""
    ours = [bench.allocation.ours(seed, servos=6) for seed in (1, 2)]
    best = [bench.allocation.ideal(seed, servos=6) for seed in (1, 2)]
    assert sum(ours) <= 1.05 * sum(best)


@allocating
async def test_ids_survive_restarts_of_servos_and_host(bus: MemoryBus, host: Host) -> None:
    servos = new_servos(bus, 4)
    await all_have_ids(servos)
    before = ids(servos)
    for servo in servos:
        servo.restart()
    await all_have_ids(servos)
    assert ids(servos) == before
    await host.close()
    for servo in reversed(servos):
        servo.restart()
    host = Host.start(bus.port("host again"), host.folder)
    await all_have_ids(servos)
    assert ids(servos) == before
    await host.close()


@pytest.mark.parametrize("stage", [1, 2])
@allocating
async def test_an_allocation_interrupted_by_a_host_restart_completes(bus: MemoryBus, host: Host, stage: int) -> None:
    servos = new_servos(bus, 2)
    pending = host.allocator.pending
    await until(lambda: any(each.stage >= stage for each in pending(host.node.clock())), 5)
    await host.close()
    assert not any(ids(servos))
    host = Host.start(bus.port("host again"), host.folder)
    await all_have_ids(servos)
    assert sorted(ids(servos)) == [124, 125]
    await host.close()


@allocating
async def test_a_lost_last_response_costs_one_more_round(bus: MemoryBus, host: Host) -> None:
    (servo,) = new_servos(bus, 1)

    def cut(_uid: Uid, _node_id: NodeId) -> None:
        bus.loss(100)

    host.allocator.on_granted.append(cut)
    await until(lambda: bool(host.store.allocations.entries()), 5)
    await asyncio.sleep(0.01)
    assert servo.node_id == 0
    host.allocator.on_granted.clear()
    bus.loss(0)
    took = await all_have_ids([servo])
    assert took < 1.0 + 2 * 0.4 + 0.01  # a new first request, and two follow-ups
    assert servo.node_id == 125
    assert len(host.store.allocations.entries()) == 1


@allocating
async def test_every_model_gets_an_id_and_keeps_it_after_a_power_cut(bus: MemoryBus, host: Host) -> None:
    bench = Bench(bus.port, CATALOG, seed=4)
    new = [bench.add(Recipe(name, model.firmware[-1])) for name, model in CATALOG.models.items()]
    static = bench.add(Recipe("BLA21-06U-A0", "1.300", node_id=124))
    await bench.start()
    await all_have_ids(new, 20)
    before = [servo.node_id for servo in new]
    assert len({*before, static.node_id}) == len(new) + 1
    assert static.node_id == 124
    for on in (False, True):
        for uid in bench.servos:
            bench.power(uid, on)
        await asyncio.sleep(0.01)
    assert not any(servo.node_id for servo in new)
    await all_have_ids(new, 20)
    assert [servo.node_id for servo in new] == before
    await bench.close()


@allocating
async def test_a_static_node_id_is_not_allocated(bus: MemoryBus, host: Host) -> None:
    settled = Peer(bus.port("settled"), 125)
    (servo,) = new_servos(bus, 1)
    settled.say_status(9)
    await all_have_ids([servo])
    assert servo.node_id == 124


def test_of_two_hosts_one_is_on_standby(tmp_path: Path) -> None:
    async def play() -> None:
        bus = MemoryBus()
        one = Host.start(bus.port("one"), tmp_path / "one", node_id=127)
        other = Host.start(bus.port("other"), tmp_path / "other", node_id=126)
        servos = new_servos(bus, 6)
        await all_have_ids(servos, 30)
        assert len(set(ids(servos))) == 6
        states = [one.allocator.state, other.allocator.state]
        assert sorted(states) == [AllocatorStatus.ON, AllocatorStatus.STANDBY]
        await one.close()
        late = Allocatee(bus.port("late"), uid(99), seed=9)
        await all_have_ids([late])
        assert late.node_id not in ids(servos)
        await other.close()

    run(play())
