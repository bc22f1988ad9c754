"""Owns `hornbill sim`: simulated servos on any bus, all behind one adapter, until interrupted."""

import asyncio
from collections.abc import Callable
from dataclasses import replace

from hornbill.bus.reopening import adapter_port
from hornbill.bus.sharing import SharedBus
from hornbill.errors import InvalidValue
from hornbill.schema.catalog import Catalog
from hornbill.sim.bench import Bench
from hornbill.sim.demo import demo_fleet
from hornbill.sim.recipe import Recipe


async def simulate(
    bus: str,
    servos: int,
    model: str | None,
    firmware: str | None,
    node_id: str,
    seed: int,
    say: Callable[[str], None],
) -> None:
    """Put `servos` (1..100) servos on the bus `INTERFACE:CHANNEL` and keep them there.

    `node_id` is "auto" (a mix: some ask for one) or the first of consecutive static ids. Raises PortOpenFailed,
    InvalidValue.
    """
    if not 1 <= servos <= 100:
        raise InvalidValue(f"{servos} servos are outside 1 to 100.")
    first = _first_id(node_id, servos)
    catalog = Catalog.load()
    adapter = adapter_port(bus)
    await adapter.open()
    shared = SharedBus(adapter)
    bench = Bench(shared.port, catalog, seed)
    for index, recipe in enumerate(demo_fleet(catalog, servos, seed)):
        if model is not None or firmware is not None:
            recipe = Recipe(
                model or recipe.model, firmware or recipe.firmware, servo_id=index + 1, node_id=recipe.node_id,
                angle_deg=recipe.angle_deg, uid=recipe.uid, serial=recipe.serial,
            )  # fmt: skip
        if first is not None:
            recipe = replace(recipe, node_id=first + index, rom_sound=True)
        made = bench.add(recipe)
        say(f"{made.uid.hex()}  {recipe.model}  firmware {recipe.firmware}  node id {recipe.node_id or 'asked for'}")
    await bench.start()
    try:
        await asyncio.get_running_loop().create_future()
    finally:
        await bench.close()
        await shared.close()


def _first_id(text: str, servos: int) -> int | None:
    if text == "auto":
        return None
    if not (text.isascii() and text.isdigit()) or not 1 <= int(text) <= 126 - servos:
        raise InvalidValue(f"--node-id {text!r} is neither auto nor 1 to {126 - servos} for {servos} servos.")
    return int(text)
