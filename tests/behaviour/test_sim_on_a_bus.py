"""Simulated servos of a server: only if requested, and on the bus that is served."""

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path

import httpx
import pytest

import jumping_clock as clock
from behaviour.rig import CATALOG, json, problem
from hornbill.app.composition import build
from hornbill.app.settings import Settings
from hornbill.app.simulate import recipes_of, simulate
from hornbill.errors import InvalidValue
from hornbill.sim.bench.recipe import Recipe

Scene = Callable[[httpx.AsyncClient], Awaitable[None]]


def serve(scene: Scene, folder: Path, *, sim_api: bool) -> None:
    """Run `scene` with a client of the complete application."""

    async def run() -> None:
        settings = Settings(data_dir=folder, view=False, sim_api=sim_api)
        app = build(settings, demo=False)
        transport = httpx.ASGITransport(app)
        async with (
            app.router.lifespan_context(app),
            httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1/api/v1", timeout=None) as client,
        ):
            await scene(client)

    clock.run(run())


async def until_ready(client: httpx.AsyncClient) -> list[str]:
    """The models of the servos once one is ready."""
    async with asyncio.timeout(30):
        while True:
            servos = (await client.get("/servos")).json()
            if any(one["state"] == "ready" for one in servos):
                return [one["model"] for one in servos]
            await asyncio.sleep(0.05)


@pytest.mark.parametrize("sim_api", [False, True])
def test_without_an_adapter_the_simulator_has_a_bus_of_its_own_if_it_is_enabled(tmp_path: Path, sim_api: bool) -> None:
    async def scene(client: httpx.AsyncClient) -> None:
        body = {"model": "BLA15-06U-A0", "node_id": 20}
        if not sim_api:
            problem(await client.get("/sim/servos"), "no_simulator", 404)
            problem(await client.post("/sim/servos", json=body), "no_simulator", 404)
            return
        assert json(await client.get("/sim/servos")) == []
        json(await client.post("/sim/servos", json=body), 201)
        assert await until_ready(client) == ["BLA15-06U-A0"]
        never_built = {"model": "BLA21-06U-AB", "firmware": "1.010", "node_id": 21}
        problem(await client.post("/sim/servos", json=never_built), "invalid_value", 422)
        json(await client.post("/sim/servos", json=never_built | {"any_firmware": True}), 201)

    serve(scene, tmp_path, sim_api=sim_api)


@pytest.mark.parametrize("node_id", ["²", "", "00", "126", "-1", "1.0", "None"])
def test_an_invalid_first_node_id_is_refused_before_a_bus_is_opened(node_id: str) -> None:
    with pytest.raises(InvalidValue, match="--node-id"):
        asyncio.run(simulate("socketcan:none", 1, None, None, node_id, 1, print))


def made(servos: int, *, model: str | None = None, firmware: str | None = None, node_id: str = "auto") -> list[Recipe]:
    return recipes_of(CATALOG, servos, model, firmware, node_id, 1, any_firmware=False)


@pytest.mark.parametrize("node_id", ["0", "none"])
@pytest.mark.parametrize("model", [None, "BLA21-12U-A0"])
def test_new_servos_have_no_ids_and_nothing_saved_and_request_a_node_id(node_id: str, model: str | None) -> None:
    for recipe in made(8, node_id=node_id, model=model):
        assert (recipe.servo_id, recipe.node_id, recipe.rom, recipe.rom_sound) == (0, 0, {}, True)
        servo = recipe.build(CATALOG, 1)
        assert (servo.register(0x45), servo.register(0x46)) == (0, 0)
        assert model in (None, recipe.model)


def test_node_ids_are_those_of_the_demo_or_count_from_the_given_one() -> None:
    assert [one.node_id for one in made(5)] == [10, 0, 12, 0, 14]
    assert [one.node_id for one in made(3, node_id="40")] == [40, 41, 42]
    assert [one.node_id for one in made(3, node_id="40", model="BLA21-12U-A0")] == [40, 41, 42]


def test_a_mix_has_only_models_that_were_built_with_the_given_firmware() -> None:
    for firmware in CATALOG.firmware_steps:
        for recipe in made(12, firmware=firmware):
            assert recipe.firmware == firmware
            recipe.build(CATALOG, 1)
    for model in CATALOG.models:
        for recipe in made(12, model=model):
            assert recipe.model == model
            recipe.build(CATALOG, 1)


def test_firmware_that_the_model_never_had_is_refused_unless_allowed() -> None:
    async def first_line(*, any_firmware: bool) -> list[str]:
        lines: asyncio.Queue[str] = asyncio.Queue()
        pair = ("BLA21-06U-A0", "1.100")
        async with asyncio.TaskGroup() as group:
            running = group.create_task(
                simulate("virtual:pairs", 1, *pair, "none", 1, lines.put_nowait, any_firmware=any_firmware)
            )
            line = await lines.get()
            running.cancel()
        return line.split("  ")

    with pytest.RaisesGroup(pytest.RaisesExc(InvalidValue, match=r"BLA21-06U-A0.*1\.100")):
        asyncio.run(first_line(any_firmware=False))
    assert asyncio.run(first_line(any_firmware=True))[1:3] == ["BLA21-06U-A0", "firmware 1.100"]


def test_without_a_bus_the_demo_can_be_selected_and_its_servos_stay_on_if_no_other_bus_opens(tmp_path: Path) -> None:
    async def scene(client: httpx.AsyncClient) -> None:
        offered = json(await client.get("/bus/adapters"))[0]
        assert (offered["address"], offered["state"]) == ("memory:demo", "ready")
        assert json(await client.get("/bus"))["state"] == "disconnected"
        assert json(await client.get("/servos")) == []

        json(await client.put("/bus", json={"address": "memory:demo"}))
        assert len(await until_ready(client)) >= 1

        async def powered() -> list[str]:
            return [one["power"] for one in json(await client.get("/sim/servos"))]

        assert await powered() == ["on"] * 6
        problem(await client.put("/bus", json={"address": "file:nothing.log"}), "bus_open_failed", 502)
        assert await powered() == ["on"] * 6
        json(await client.delete("/bus"))
        assert await powered() == ["on"] * 6
        json(await client.put("/bus", json={"address": "memory:demo"}))  # the same servos, once
        assert await powered() == ["on"] * 6

    serve(scene, tmp_path, sim_api=False)


def test_on_another_bus_simulated_servos_are_off_and_the_demo_selected_again_restarts_them(tmp_path: Path) -> None:
    empty = tmp_path / "logs" / "empty.log"
    empty.parent.mkdir(parents=True)
    empty.write_text("(1.000000) can0 1E08FF05#0102030405060708\n")

    async def scene(client: httpx.AsyncClient) -> None:
        json(await client.put("/bus", json={"address": "memory:demo"}))
        assert len(await until_ready(client)) >= 1
        uid = next(one["uid"] for one in json(await client.get("/servos")) if one["state"] == "ready")
        path = f"/servos/{uid}/parameters/temperature_limit_upper"
        before = json(await client.get(path))["value"]
        json(await client.put(path, json={"value": before - 1}))

        json(await client.put("/bus", json={"address": "file:empty.log"}))
        simulated = json(await client.get("/sim/servos"))
        assert len(simulated) == 6
        assert [one["power"] for one in simulated] == ["off"] * 6

        problem(await client.put("/bus", json={"address": "file:nothing.log"}), "bus_open_failed", 502)
        json(await client.put("/bus", json={"address": "memory:demo"}))
        async with asyncio.timeout(30):
            while json(await client.get(f"/servos/{uid}"))["state"] != "ready":
                await asyncio.sleep(0.05)
        assert json(await client.get(path))["value"] == before, "RAM is lost without supply"
        assert all(one["power"] == "on" for one in json(await client.get("/sim/servos")))

    serve(scene, tmp_path, sim_api=False)
