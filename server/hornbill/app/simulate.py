"""`hornbill sim`: simulated servos on any bus, all behind one adapter, until interrupted."""

import asyncio
from collections.abc import Callable
from dataclasses import replace

from hornbill.bus.reopening import adapter_port
from hornbill.bus.sharing import SharedBus
from hornbill.errors import InvalidValue
from hornbill.schema.catalog import Catalog
from hornbill.sim.bench.bench import Bench
from hornbill.sim.bench.demo import demo_fleet
from hornbill.sim.bench.recipe import Recipe


async def simulate(
    bus: str,
    servos: int,
    model: str | None,
    firmware: str | None,
    node_id: str,
    seed: int,
    say: Callable[[str], None],
    *,
    any_firmware: bool = False,
) -> None:
    """Put `servos` (1..100) servos on the bus `INTERFACE:CHANNEL` and keep them there.

    `node_id` is "auto" (as in the demo: some ask for one), "none" or "0" (as delivered: all ask), or the first of
    consecutive static ids. `any_firmware` allows pairs of model and firmware that never existed. Raises PortOpenFailed,
    InvalidValue.
    """
    if not 1 <= servos <= 100:
        raise InvalidValue(f"{servos} servos are outside 1 to 100.", cause=None)
    catalog = Catalog.load()
    recipes = recipes_of(catalog, servos, model, firmware, node_id, seed, any_firmware=any_firmware)
    adapter = adapter_port(bus)
    await adapter.open()
    shared = SharedBus(adapter)
    bench = Bench(shared.port, catalog, seed)
    try:
        for recipe in recipes:
            made = bench.add(recipe)
            given = recipe.node_id or "asked for"
            say(f"{made.uid.hex()}  {recipe.model}  firmware {recipe.firmware}  node id {given}")
        await bench.start()
        await asyncio.get_running_loop().create_future()
    finally:
        await bench.close()
        await shared.close()


def recipes_of(
    catalog: Catalog,
    servos: int,
    model: str | None,
    firmware: str | None,
    node_id: str,
    seed: int,
    *,
    any_firmware: bool,
) -> list[Recipe]:
    """The servos of the demo, with the model, firmware and node ids that were asked for. Raises InvalidValue."""
    recipes = demo_fleet(catalog, servos, seed)
    if model is not None or firmware is not None:
        pairs = [_pair(catalog, one, index, model, firmware) for index, one in enumerate(recipes)]
        recipes = [
            replace(
                _plain(one),
                model=pair[0],
                firmware=pair[1],
                servo_id=index + 1,
                node_id=one.node_id,
                any_firmware=any_firmware,
            )
            for index, (one, pair) in enumerate(zip(recipes, pairs, strict=True))
        ]
    if node_id in ("none", "0"):
        return [replace(_plain(one), any_firmware=any_firmware) for one in recipes]
    if node_id == "auto":
        return recipes
    if not (node_id.isascii() and node_id.isdigit()) or not 1 <= int(node_id) <= 126 - servos:
        raise InvalidValue(
            f"--node-id {node_id!r} is not auto, none or 1 to {126 - servos}, the first of {servos} servos.", cause=None
        )
    return [replace(one, node_id=int(node_id) + index, rom_sound=True) for index, one in enumerate(recipes)]


def _plain(one: Recipe) -> Recipe:
    """The same servo as it was delivered: without ids, a story, or anything saved."""
    return Recipe(one.model, one.firmware, angle_deg=one.angle_deg, uid=one.uid, serial=one.serial)


def _pair(catalog: Catalog, one: Recipe, index: int, model: str | None, firmware: str | None) -> tuple[str, str]:
    """Model and firmware of a servo: what was asked for, with something beside it that was built with that."""
    if model is not None:
        built = catalog.models[model].firmware if model in catalog.models else (one.firmware,)
        return model, firmware or (one.firmware if one.firmware in built else built[-1])
    assert firmware is not None
    fitting = [name for name, each in catalog.models.items() if firmware in each.firmware] or [one.model]
    return one.model if one.model in fitting else fitting[index % len(fitting)], firmware
