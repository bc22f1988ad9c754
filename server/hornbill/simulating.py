"""Owns `hornbill sim`: simulated servos on any bus, each with an adapter handle of its own, until interrupted."""

import asyncio
from collections.abc import Callable
from dataclasses import replace

from hornbill.bus.address import open_port
from hornbill.errors import InvalidValue
from hornbill.schema.catalog import Catalog
from hornbill.sim.bench import Bench
from hornbill.sim.demo import demo_fleet
from hornbill.wire.port import CanPort


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
    opened = [await open_port(bus) for _ in range(servos)]
    ports: list[CanPort] = list(reversed(opened))
    bench = Bench(lambda _name: ports.pop(), catalog, seed)
    for index, recipe in enumerate(demo_fleet(catalog, servos, seed)):
        if model is not None or firmware is not None:
            recipe = replace(recipe, model=model or recipe.model, firmware=firmware or recipe.firmware, rom={})
        if first is not None:
            recipe = replace(recipe, node_id=first + index)
        made = bench.add(recipe)
        say(f"{made.uid.hex()}  {recipe.model}  firmware {recipe.firmware}  node id {recipe.node_id or 'asked for'}")
    await bench.start()
    try:
        await asyncio.get_running_loop().create_future()
    finally:
        await bench.close()


def _first_id(text: str, servos: int) -> int | None:
    if text == "auto":
        return None
    if not text.isdigit() or not 1 <= int(text) <= 126 - servos:
        raise InvalidValue(f"--node-id {text!r} is neither auto nor 1 to {126 - servos} for {servos} servos.")
    return int(text)
