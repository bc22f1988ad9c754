"""A BLA34 in use: commissioned, written, saved, moved, driven by speed, measured by a step, and drawn."""

import asyncio
from dataclasses import replace

import pytest

from behaviour.rig import Rig, json, problem
from behaviour.scene import scene
from hornbill.app.view_feed import POSE_S, ViewFeed
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe
from hornbill.view.case import BLA21, case_of
from hornbill.view.viewer import Viewer

NEW = [Recipe(f"BLA34-{volts}U-AB", "1.500", serial=100 + volts, angle_deg=10.0) for volts in (12, 28)]
SET_UP = {"soft_start": 0, "speed_torque_control": 1}
READY = [replace(one, servo_id=at, node_id=20 + at, rom=SET_UP) for at, one in enumerate(NEW, start=1)]


@scene(*NEW)
async def test_new_servos_are_commissioned_with_a_profile_and_saved(rig: Rig) -> None:
    await rig.ready(2)
    servos = [rig.host.fleet.get(uid) for uid in rig.bench.servos]
    values = {"pwm_range": 800, "angle_p_gain": 40, "speed_limit_cw": 60, "angle_limit_cw": 90}
    json(await rig.call("PUT", "/profiles/doors", {"values": values, "model": "BLA34-12U-AB"}), 201)
    wanted = [{"uid": one.uid, "servo_id": at, "label": f"door {at}"} for at, one in enumerate(servos, start=1)]
    body = {"servos": wanted, "profile": "doors", "identify": True}
    job = json(await rig.call("POST", "/commissioning?wait=true", body))
    assert job["state"] == "succeeded", job["error"]
    assert [one["verdict"] for one in job["result"]["servos"]] == ["done", "done"]
    for at, (servo, sim) in enumerate(zip(servos, rig.bench.servos.values(), strict=True), start=1):
        assert [sim.memory.stored(row) for row in (0x35, 0x2C, 0x3A, 0x38, 0x45)] == [800, 40, 60, 900, at]
        assert (servo.label, servo.unsaved(), sim.starts) == (f"door {at}", [], 2)


@pytest.mark.parametrize("recipe", READY, ids=lambda recipe: recipe.model)
@scene(lambda recipe: recipe)
async def test_it_is_written_saved_moved_measured_and_drawn(rig: Rig, servo: Servo, recipe: Recipe) -> None:
    path, lease = f"/servos/{servo.uid}", await rig.lease()
    shown = json(await rig.call("GET", path))
    assert (shown["model"], shown["series"], shown["model_number"]) == (recipe.model, "BLA34", 86)

    # Its ranges are not those of the BLA21 with the same 0x53.
    limit_a = 2.4 if recipe.model == "BLA34-28U-AB" else 6.3
    for key, good, bad in (("speed_limit_cw", 80, 81), ("overcurrent_limit", limit_a, 6.4), ("pwm_range", 1100, 9)):
        json(await rig.call("PUT", f"{path}/parameters/{key}", {"value": good}, lease=lease))
        refused = await rig.call("PUT", f"{path}/parameters/{key}", {"value": bad}, lease=lease)
        problem(refused, "out_of_range", 422)
    json(await rig.call("PUT", f"{path}/parameters/speed_i_limit", {"value": 500}, lease=lease))
    assert "speed_i_limit" in servo.unsaved()
    job = json(await rig.call("POST", f"{path}/save?wait=true", {}, lease=lease))
    assert job["state"] == "succeeded", job["error"]
    assert (servo.unsaved(), rig.sim(servo).memory.stored(0x33)) == ([], 500)

    json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
    job = json(await rig.call("POST", f"{path}/step-test?wait=true", {"step_deg": 15.0}, lease=lease))
    assert job["state"] == "succeeded", job["error"]
    run = json(await rig.call("GET", f"/runs/{job['result']['run']}"))
    assert (run["parameters"]["angle_p_gain"], run["parameters"]["angle_d_gain"]) == (50, 1)
    for step in run["steps"]:
        assert step["metrics"]["overshoot_pct"] < 20
        assert step["metrics"]["settling_s"] < 1.0

    moved = {"type": "angle", "value": -75.5, "wait": "settled"}
    json(await rig.call("POST", f"{path}/command", moved, lease=lease))
    assert rig.sim(servo).angle_deg == pytest.approx(-75.5, abs=0.5)
    poses = ViewFeed()
    poses.follow(rig.host, Viewer(poses))
    task = asyncio.create_task(poses.run())
    await asyncio.sleep(1.0 + POSE_S)
    task.cancel()
    (pose,) = poses.poses()
    assert (pose.uid, pose.series, pose.limit_cw_deg) == (servo.uid, "BLA34", 179.9)
    assert pose.angle_deg == pytest.approx(rig.sim(servo).angle_deg, abs=0.2)
    assert case_of(pose.series) is BLA21

    too_fast = await rig.call("POST", f"{path}/command", {"type": "speed", "value": 81}, lease=lease)
    problem(too_fast, "out_of_range", 422)
    warnings = json(await rig.call("POST", f"{path}/command", {"type": "speed", "value": 50}, lease=lease))["warnings"]
    assert any("rotates continuously" in one for one in warnings)
    await asyncio.sleep(1.0)
    assert rig.sim(servo).speed_rpm == pytest.approx(50, abs=2)
