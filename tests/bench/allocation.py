"""Node ids for sixteen servos from cold, by the whole server and by an ideal allocator on the same seeds: bus time.

What the servos draw decides how long it takes (600 to 1000 ms, then 0 to 400 ms twice, one servo after the other), so
only the ratio says something of an allocator. The server identifies, reads and polls each servo meanwhile.
"""

import asyncio
import statistics
from collections.abc import Iterator
from typing import Any

from behaviour.rig import CATALOG, Rig, play
from bench.line import line
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.sim.bench.bench import Bench
from hornbill.sim.bench.recipe import Recipe
from jumping_clock import run
from unit.node.ideal import IdealAllocator

SERVOS = 16
SEEDS = 3
LIMIT_S = 60.0
IDEAL_RESPONSE_S = 0.001
LOOK_S = 0.001


def figures() -> Iterator[dict[str, Any]]:
    """Medians over the seeds, and their ratio; the greatest ratio of a pair."""
    pairs = [(ours(seed), ideal(seed)) for seed in range(1, SEEDS + 1)]
    mine, best = (statistics.median(column) for column in zip(*pairs, strict=True))
    figures = {
        "servos": SERVOS, "seeds": SEEDS, "s": round(mine, 2), "ideal_s": round(best, 2),
        "times": round(mine / best, 4), "times_greatest": round(max(took / least for took, least in pairs), 3),
    }  # fmt: skip
    name = "node ids for 16 servos from cold, against an ideal allocator"
    yield line(name, figures, must=1.05, aim=1.01, of="times", peer="an ideal allocator")


def ours(seed: int, servos: int = SERVOS) -> float:
    """Seconds with the server."""

    async def scene(rig: Rig) -> float:
        return await _all_have_ids(rig.bench)

    return play(scene, *recipes(servos), seed=seed)


def ideal(seed: int, servos: int = SERVOS) -> float:
    """Seconds with the ideal allocator, and nothing else on the bus."""

    async def scene() -> float:
        bus = MemoryBus()
        IdealAllocator(bus.port("ideal"), IDEAL_RESPONSE_S)
        bench = Bench(bus.port, CATALOG, seed)
        for recipe in recipes(servos):
            bench.add(recipe)
        await bench.start()
        took = await _all_have_ids(bench)
        await bench.close()
        return took

    return run(scene())


def recipes(count: int) -> list[Recipe]:
    """New servos without node ID and soft start, so that only the allocation is measured."""
    return [Recipe("BLA21-06U-A0", "1.300", servo_id=1 + number, rom={"soft_start": 0}) for number in range(count)]


async def _all_have_ids(bench: Bench) -> float:
    loop = asyncio.get_running_loop()
    began = loop.time()
    async with asyncio.timeout(LIMIT_S):
        while not all(servo.node_id for servo in bench.servos.values()):
            await asyncio.sleep(LOOK_S)
    return loop.time() - began
