"""Simulated servos beside a served bus: only where it was asked for, and on the bus that is served."""

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
    """Run `scene` with a client of the whole application."""

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


def test_without_the_flag_there_is_no_simulator(tmp_path: Path) -> None:
    async def scene(client: httpx.AsyncClient) -> None:
        problem(await client.get("/sim/servos"), "no_simulator", 404)
        problem(await client.post("/sim/servos", json={"model": "BLA21-06U-A0"}), "no_simulator", 404)

    serve(scene, tmp_path, sim_api=False)


def test_with_the_flag_and_no_adapter_servos_live_on_a_bus_of_their_own(tmp_path: Path) -> None:
    async def scene(client: httpx.AsyncClient) -> None:
        assert json(await client.get("/sim/servos")) == []
        json(await client.post("/sim/servos", json={"model": "BLA15-06U-A0", "node_id": 20}), 201)
        assert await until_ready(client) == ["BLA15-06U-A0"]

    serve(scene, tmp_path, sim_api=True)


@pytest.mark.parametrize("node_id", ["²", "", "00", "126", "-1", "1.0", "None"])
def test_a_first_node_id_that_is_none_is_refused_before_a_bus_is_opened(node_id: str) -> None:
    with pytest.raises(InvalidValue, match="not auto, none or 1 to 125"):
        asyncio.run(simulate("socketcan:none", 1, None, None, node_id, 1, print))


def made(servos: int, *, model: str | None = None, firmware: str | None = None, node_id: str = "auto") -> list[Recipe]:
    return recipes_of(CATALOG, servos, model, firmware, node_id, 1, any_firmware=False)


@pytest.mark.parametrize("node_id", ["0", "none"])
@pytest.mark.parametrize("model", [None, "BLA21-12U-A0"])
def test_servos_as_delivered_have_no_ids_and_nothing_saved_and_ask_for_a_node_id(
    node_id: str, model: str | None
) -> None:
    for recipe in made(8, node_id=node_id, model=model):
        assert (recipe.servo_id, recipe.node_id, recipe.rom, recipe.rom_sound) == (0, 0, {}, True)
        servo = recipe.build(CATALOG, 1)
        assert (servo.register(0x45), servo.register(0x46)) == (0, 0)
        assert model in (None, recipe.model)


def test_node_ids_are_those_of_the_demo_or_count_from_the_one_that_is_given() -> None:
    assert [one.node_id for one in made(5)] == [10, 0, 12, 0, 14]
    assert [one.node_id for one in made(3, node_id="40")] == [40, 41, 42]
    assert [one.node_id for one in made(3, node_id="40", model="BLA21-12U-A0")] == [40, 41, 42]


def test_a_mix_has_only_models_that_were_built_with_the_firmware_asked_for() -> None:
    for firmware in CATALOG.firmware_steps:
        for recipe in made(12, firmware=firmware):
            assert recipe.firmware == firmware
            recipe.build(CATALOG, 1)
    for model in CATALOG.models:
        for recipe in made(12, model=model):
            assert recipe.model == model
            recipe.build(CATALOG, 1)


def test_a_firmware_the_model_never_had_is_refused_by_name_unless_it_is_wanted() -> None:
    async def said_first(*, any_firmware: bool) -> list[str]:
        said: asyncio.Queue[str] = asyncio.Queue()
        pair = ("BLA21-06U-A0", "1.100")
        async with asyncio.TaskGroup() as group:
            running = group.create_task(
                simulate("virtual:pairs", 1, *pair, "none", 1, said.put_nowait, any_firmware=any_firmware)
            )
            line = await said.get()
            running.cancel()
        return line.split("  ")[1:]

    with pytest.RaisesGroup(pytest.RaisesExc(InvalidValue, match=r"BLA21-06U-A0 was never built with firmware 1\.100")):
        asyncio.run(said_first(any_firmware=False))
    assert asyncio.run(said_first(any_firmware=True)) == ["BLA21-06U-A0", "firmware 1.100", "node id asked for"]


def test_over_rest_too_a_pair_that_never_existed_has_to_be_wanted(tmp_path: Path) -> None:
    async def scene(client: httpx.AsyncClient) -> None:
        body = {"model": "BLA21-06U-AB", "firmware": "1.010", "node_id": 20}
        problem(await client.post("/sim/servos", json=body), "invalid_value", 422)
        json(await client.post("/sim/servos", json=body | {"any_firmware": True}), 201)

    serve(scene, tmp_path, sim_api=True)


def test_without_a_bus_the_demo_can_be_chosen_and_runs_only_then(tmp_path: Path) -> None:
    async def scene(client: httpx.AsyncClient) -> None:
        offered = json(await client.get("/bus/adapters"))[0]
        assert (offered["address"], offered["state"]) == ("memory:demo", "ready")
        assert json(await client.get("/bus"))["state"] == "disconnected"
        assert json(await client.get("/servos")) == []

        json(await client.put("/bus", json={"address": "memory:demo"}))
        assert len(await until_ready(client)) >= 1
        assert len(json(await client.get("/sim/servos"))) == 6

        json(await client.delete("/bus"))
        json(await client.put("/bus", json={"address": "memory:demo"}))  # chosen again: the same servos, once
        assert len(json(await client.get("/sim/servos"))) == 6

    serve(scene, tmp_path, sim_api=False)


def test_beside_another_bus_no_simulated_servo_is_on_and_the_demo_chosen_again_starts_anew(tmp_path: Path) -> None:
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
        assert json(await client.get(path))["value"] == before, "RAM does not outlive the supply"
        assert all(one["power"] == "on" for one in json(await client.get("/sim/servos")))

    serve(scene, tmp_path, sim_api=False)


def test_a_bus_that_does_not_open_and_leaving_the_demo_alone_switch_no_servo_off(tmp_path: Path) -> None:
    async def scene(client: httpx.AsyncClient) -> None:
        json(await client.put("/bus", json={"address": "memory:demo"}))
        assert len(await until_ready(client)) >= 1
        problem(await client.put("/bus", json={"address": "file:nothing.log"}), "bus_open_failed", 502)
        assert all(one["power"] == "on" for one in json(await client.get("/sim/servos")))
        json(await client.delete("/bus"))
        assert all(one["power"] == "on" for one in json(await client.get("/sim/servos")))

    serve(scene, tmp_path, sim_api=False)
