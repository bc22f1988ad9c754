"""Chaos: the same faults for the same seed, each of which ends with what was before."""

import asyncio
from dataclasses import asdict
from itertools import islice

import pytest

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.schema.catalog import Catalog
from hornbill.sim.bench.bench import Bench
from hornbill.sim.bench.chaos import BUS_KINDS, KINDS, ChaosKind, Injection, plan
from hornbill.sim.bench.recipe import Recipe
from jumping_clock import run

CATALOG = Catalog.load()
MODELS = ("BLA21-06U-A0", "BLA15-12U-A0", "BLA21-28U-AB")


def test_a_plan_depends_only_on_its_arguments_and_has_all_kinds() -> None:
    first = [*islice(plan(7, 6), 500)]
    assert first == [*islice(plan(7, 6), 500)]
    assert first != [*islice(plan(8, 6), 500)]
    assert {one.kind for one in first} == set(KINDS)
    assert [one.at_s for one in first] == sorted(one.at_s for one in first)
    assert first[-1].at_s / first[-1].number == pytest.approx(10.0, rel=0.2), "the mean interval"
    assert all((one.servo is None) is (one.kind in BUS_KINDS) for one in first)


def test_no_two_injections_act_on_the_same_at_the_same_time() -> None:
    until: dict[tuple[int | None, str], float] = {}
    for one in islice(plan(3, 2, interval_s=0.5), 2000):
        on = one.servo, "supply" if one.kind in ("power_cut", "rom_lost") else one.kind
        assert until.get(on, 0.0) <= one.at_s
        until[on] = one.until_s


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_is_injected_and_ends_with_what_was_before(kind: ChaosKind) -> None:
    async def main() -> tuple[list[Injection], bool]:
        bus = MemoryBus(fast=True)
        bench = Bench(bus.port, CATALOG, 1, bus)
        for node, model in enumerate(MODELS, 11):
            bench.add(Recipe(model, servo_id=node, node_id=node) if model != MODELS[1] else Recipe(model, "1.200"))
        await bench.start()
        await asyncio.sleep(1)
        before = [asdict(one.conditions) for one in bench.servos.values()]
        bench.chaos.start(5, [kind], 3.0)
        await asyncio.sleep(120)
        assert bench.chaos.running
        found = [*bench.chaos.injections]
        assert bench.chaos.injected == len(found) > 5
        ended = [one for one in found if not one.active]
        assert ended
        bench.chaos.stop()
        assert not any(one.active for one in found)
        await asyncio.sleep(20)
        same = before == [asdict(one.conditions) for one in bench.servos.values()]
        assert all(one.powered for one in bench.servos.values())
        await bench.close()
        return found, same

    found, same = run(main())
    assert same
    again, _ = run(main())
    assert [(one.number, one.uid, one.values, one.at) for one in found] == [
        (one.number, one.uid, one.values, one.at) for one in again
    ]
    assert {one.kind for one in found} == {kind}


def test_without_servos_or_without_a_bus_there_is_nothing_to_inject() -> None:
    async def main() -> None:
        bus = MemoryBus(fast=True)
        bench = Bench(bus.port, CATALOG)
        with pytest.raises(ValueError, match="no simulated servos"):
            bench.chaos.start(1)
        bench.add(Recipe(servo_id=1, node_id=11))
        with pytest.raises(ValueError, match="None of these"):
            bench.chaos.start(1, ["frame_loss"])
        bench.chaos.start(1)
        assert not BUS_KINDS & {*bench.chaos.kinds}
        await bench.close()
        assert not bench.chaos.running

    run(main())
