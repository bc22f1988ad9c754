"""Simulated servos beside a served bus: only where it was asked for, and on the bus that is served."""

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path

import httpx
import pytest

from behaviour.rig import json, problem
from hornbill.app import build
from hornbill.bus import clock
from hornbill.errors import InvalidValue
from hornbill.settings import Settings
from hornbill.simulating import simulate

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


@pytest.mark.parametrize("node_id", ["²", "", "0", "126", "-1", "1.0"])
def test_a_first_node_id_that_is_none_is_refused_before_a_bus_is_opened(node_id: str) -> None:
    with pytest.raises(InvalidValue, match="neither auto nor 1 to 125"):
        asyncio.run(simulate("socketcan:none", 1, None, None, node_id, 1, print))


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
