"""`hornbill sim`: simulated servos on any bus, all on one adapter, until interrupted."""

import asyncio
import json
import signal
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import cast

from hornbill.bus.reopening import adapter_port
from hornbill.bus.sharing import SharedBus
from hornbill.domain.autopilot import Program
from hornbill.domain.plant import PlantConstants, plant_from
from hornbill.errors import InvalidValue
from hornbill.schema.catalog import Catalog
from hornbill.sim.bench.autopilot import MAX_OUTPUTS
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
    autopilot: Program | None = None,
    plant: PlantConstants | None = None,
    chaos: int | None = None,
) -> None:
    """Simulate `servos` (1 to 100) servos on the bus `INTERFACE:CHANNEL`.

    `node_id`: "auto" (as in the demo: some request one), "none" or "0" (as delivered: all request one), or the first of
    consecutive static IDs. `autopilot`: add an armed autopilot that moves them. `any_firmware` allows combinations of
    model and firmware that do not exist. `plant`: constants of every horn. `chaos`: seed of faults
    to inject. Raises PortOpenFailed, InvalidValue.
    """
    if not 1 <= servos <= 100:
        raise InvalidValue(f"Invalid number of servos {servos}. Use 1 to 100.", cause=None)
    catalog = Catalog.load()
    recipes = recipes_of(catalog, servos, model, firmware, node_id, seed, any_firmware=any_firmware)
    if plant is not None:
        recipes = [replace(one, plant=plant) for one in recipes]
    ended = _on_signal()
    adapter = adapter_port(bus)
    await adapter.open()
    shared = SharedBus(adapter)
    bench = Bench(shared.port, catalog, seed)
    try:
        for recipe in recipes:
            made = bench.add(recipe)
            assigned = recipe.node_id or "requested"
            say(f"{made.uid.hex()}  {recipe.model}  firmware {recipe.firmware}  node ID {assigned}")
        await bench.start()
        if autopilot is not None:
            await bench.set_autopilot(autopilot, outputs=min(servos, MAX_OUTPUTS))
            one = bench.autopilot
            assert one is not None
            one.armed, one.safety_on = True, False
            say(f"{autopilot} on node ID {one.node_id}, armed: commands servo IDs from {one.actuator_id(0)}")
        if chaos is not None:
            bench.chaos.start(chaos)
        await ended.wait()
    finally:
        await bench.close()
        await shared.close()


def _on_signal() -> asyncio.Event:
    """Event set by SIGINT and SIGTERM, also where a shell ignores SIGINT for programs in the background."""
    ended = asyncio.Event()
    for one in (signal.SIGINT, signal.SIGTERM):
        try:
            asyncio.get_running_loop().add_signal_handler(one, ended.set)
        except (NotImplementedError, RuntimeError, ValueError):
            pass  # on Windows, and outside the main thread
    return ended


def read_plant(file: Path) -> PlantConstants:
    """Constants of a horn from a TOML or JSON file: a table of constants, or one under `plant`, as in a twin.

    Raises InvalidValue for a file that cannot be read, an unknown constant and a value out of range.
    """
    try:
        text = file.read_text(encoding="utf-8")
        found: object = json.loads(text) if file.suffix.lower() == ".json" else tomllib.loads(text)
    except (OSError, ValueError) as error:
        raise InvalidValue(
            f"{file} cannot be read as {'JSON' if file.suffix.lower() == '.json' else 'TOML'}: {error}. "
            "Enter a .toml or .json file of plant constants.",
            cause=None,
        ) from None
    if not isinstance(found, dict) or not found:
        raise InvalidValue(f"{file} has no plant constants. Enter for example: inertia = 3.0", cause=None)
    document = cast("dict[str, object]", found)
    inner = document.get("plant")
    if isinstance(inner, dict):
        return plant_from(cast("dict[str, object]", inner))
    return plant_from(document)


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
    """Servos of the demo, with the requested model, firmware and node IDs. Raises InvalidValue."""
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
            f"Invalid --node-id {node_id!r}. Use auto, none or 1 to {126 - servos} for the first of {servos} servos.",
            cause=None,
        )
    return [replace(one, node_id=int(node_id) + index, rom_sound=True) for index, one in enumerate(recipes)]


def _plain(one: Recipe) -> Recipe:
    """The same servo as delivered: without IDs, story or saved values."""
    return Recipe(one.model, one.firmware, angle_deg=one.angle_deg, uid=one.uid, serial=one.serial)


def _pair(catalog: Catalog, one: Recipe, index: int, model: str | None, firmware: str | None) -> tuple[str, str]:
    """Model and firmware of a servo: the requested ones, complemented by a matching firmware or model."""
    if model is not None:
        built = catalog.models[model].firmware if model in catalog.models else (one.firmware,)
        return model, firmware or (one.firmware if one.firmware in built else built[-1])
    assert firmware is not None
    fitting = [name for name, each in catalog.models.items() if firmware in each.firmware] or [one.model]
    return one.model if one.model in fitting else fitting[index % len(fitting)], firmware
