"""The simulated autopilot: allocates node IDs, commands servos as its program does, and is what hornbill finds."""

import asyncio
from dataclasses import replace

import pytest

from behaviour.rig import PLAIN, Rig, json, problem, until
from behaviour.scene import scene
from hornbill.sim.bench.recipe import Recipe

TWO = [replace(PLAIN, node_id=20, servo_id=1), replace(PLAIN, node_id=21, servo_id=2)]
NEW = Recipe("BLA21-06U-A0", "1.300", servo_id=3)


@scene(*TWO, NEW, connect=False)
async def test_it_allocates_node_ids_beside_a_guest(rig: Rig) -> None:
    json(await rig.call("PUT", "/sim/autopilot", {"program": "ardupilot"}))
    json(await rig.call("PUT", "/bus", {"address": "memory:host", "role": "guest"}))
    servos = await rig.ready(3)
    one = json(await rig.call("GET", "/sim/autopilot"))
    assert (one["allocated"], one["node_id"]) == (1, 10)
    assert {servo.node_id for servo in servos} == {20, 21, 125}
    nodes = {node["node_id"]: node for node in json(await rig.call("GET", "/nodes"))}
    assert nodes[10]["name"] == "org.ardupilot:0"


@pytest.mark.parametrize(("program", "node_id", "silent"), [("ardupilot", 10, True), ("px4", 1, False)])
@scene(*TWO)
async def test_it_commands_by_its_own_ids_and_stays_as_its_program_does(
    rig: Rig, program: str, node_id: int, silent: bool
) -> None:
    first, second = await rig.ready(2)
    json(await rig.call("PUT", "/sim/autopilot", {"program": program, "rate_hz": 100}))
    await asyncio.sleep(1)
    commanded = json(await rig.call("GET", f"/servos/{first.uid}"))["commanded_by"]
    assert (commanded == []) == silent, "ArduPilot sends nothing while its safety switch is on"
    body = {
        "armed": True, "safety_on": False, "sweep": False,
        "outputs": [{"output": n, "demand": 0.5, "high_deg": 36} for n in (1, 2, 3)],
    }  # fmt: skip
    one = json(await rig.call("PATCH", "/sim/autopilot", body))
    await asyncio.sleep(2)
    ids = {output["servo_id"] for output in one["outputs"]}
    assert ids == ({1, 2, 3, 4} if program == "ardupilot" else {0, 1, 2, 3})
    for servo in (first, second):
        (by,) = json(await rig.call("GET", f"/servos/{servo.uid}"))["commanded_by"]
        assert (by["node_id"], by["type"]) == (node_id, "unitless")
        assert by["rate_hz"] == pytest.approx(100, rel=0.02)
        assert by["command_deg"] == pytest.approx(18, abs=0.36)
        assert rig.sim(servo).angle_deg == pytest.approx(18, abs=1)


@scene(*TWO)
async def test_a_restart_is_a_gap_that_is_reported(rig: Rig) -> None:
    first, _ = await rig.ready(2)
    json(await rig.call("PUT", "/sim/autopilot", {"program": "ardupilot"}))
    json(await rig.call("PATCH", "/sim/autopilot", {"armed": True, "safety_on": False}))
    await asyncio.sleep(1)
    json(await rig.call("PATCH", "/sim/autopilot", {"restart": True}))
    await until(lambda: len(rig.events("command_lost")) == 2, 2)
    assert rig.sim(first).output == 1
    await asyncio.sleep(3)
    assert json(await rig.call("GET", f"/servos/{first.uid}"))["commanded_by"] == [], "its safety switch is on again"
    assert (await rig.call("DELETE", "/sim/autopilot")).status_code == 204
    problem(await rig.call("GET", "/sim/autopilot"), "no_autopilot", 404)


@scene(*TWO)
async def test_an_output_that_does_not_exist_changes_nothing(rig: Rig) -> None:
    json(await rig.call("PUT", "/sim/autopilot", {"program": "px4", "output_count": 2}))
    body = {"armed": True, "outputs": [{"output": 1, "demand": 1}, {"output": 3, "demand": 1}]}
    found = problem(await rig.call("PATCH", "/sim/autopilot", body), "invalid_value", 422)
    assert found["maximum"] == 2
    one = json(await rig.call("GET", "/sim/autopilot"))
    assert (one["armed"], one["outputs"][0]["demand"]) == (False, 0)
