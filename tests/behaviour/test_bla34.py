"""A BLA34 all the way: commissioned, written, saved, moved, driven by speed, measured by a step, and drawn."""

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
ONES = [replace(one, servo_id=at, node_id=20 + at, rom=SET_UP) for at, one in enumerate(NEW, start=1)]
each = pytest.mark.parametrize("recipe", ONES, ids=lambda recipe: recipe.model)


@scene(*NEW)
async def test_new_ones_are_commissioned_with_a_profile_and_saved(rig: Rig) -> None:
    await rig.ready(2)
    servos = [rig.host.fleet.get(uid) for uid in rig.bench.servos]
    values = {"pwm_range": 800, "angle_p_gain": 40, "speed_limit_cw": 60, "angle_limit_cw": 90}
    json(await rig.call("PUT", "/profiles/doors", {"values": values, "model": "BLA34-12U-AB"}), 201)
    wanted = [{"uid": one.uid, "servo_id": at, "label": f"door {at}"} for at, one in enumerate(servos, start=1)]
    body = {"servos": wanted, "profile": "doors", "identify": True}
    job = json(await rig.call("POST", "/commissioning?wait=true", body))
    assert job["state"] == "succeeded", job["error"]
    assert [unit["verdict"] for unit in job["result"]["servos"]] == ["done", "done"]
    for at, (servo, sim) in enumerate(zip(servos, rig.bench.servos.values(), strict=True), start=1):
        assert [sim.memory.stored(row) for row in (0x35, 0x2C, 0x3A, 0x38, 0x45)] == [800, 40, 60, 900, at]
        assert (servo.label, servo.unsaved(), sim.starts) == (f"door {at}", [], 2)


@each
@scene(lambda recipe: recipe)
async def test_its_own_ranges_hold_and_not_those_of_the_bla21_with_the_same_0x53(
    rig: Rig, servo: Servo, recipe: Recipe
) -> None:
    shown = json(await rig.call("GET", f"/servos/{servo.uid}"))
    assert (shown["model"], shown["series"], shown["model_number"]) == (recipe.model, "BLA34", 86)
    lease = await rig.lease()
    path = f"/servos/{servo.uid}"
    for key, good, bad in (("speed_limit_cw", 80, 81), ("overcurrent_limit", 2.4, 6.4), ("pwm_range", 1100, 9)):
        value = good if recipe.model == "BLA34-28U-AB" or key != "overcurrent_limit" else 6.3
        json(await rig.call("PUT", f"{path}/parameters/{key}", {"value": value}, lease=lease))
        refused = await rig.call("PUT", f"{path}/parameters/{key}", {"value": bad}, lease=lease)
        problem(refused, "out_of_range", 422)
    json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
    too_fast = await rig.call("POST", f"{path}/command", {"type": "speed", "value": 81}, lease=lease)
    problem(too_fast, "out_of_range", 422)


@each
@scene(lambda recipe: recipe)
async def test_it_is_saved_and_reads_back(rig: Rig, servo: Servo, recipe: Recipe) -> None:
    lease = await rig.lease()
    path = f"/servos/{servo.uid}"
    json(await rig.call("PUT", f"{path}/parameters/speed_i_limit", {"value": 500}, lease=lease))
    assert servo.unsaved() == ["speed_i_limit"]
    job = json(await rig.call("POST", f"{path}/save?wait=true", {}, lease=lease))
    assert job["state"] == "succeeded", job["error"]
    assert (servo.unsaved(), rig.sim(servo).memory.stored(0x33)) == ([], 500)


@each
@scene(lambda recipe: recipe)
async def test_it_goes_to_an_angle_and_turns_at_a_speed(rig: Rig, servo: Servo, recipe: Recipe) -> None:
    lease = await rig.lease()
    path = f"/servos/{servo.uid}"
    json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
    moved = {"type": "angle", "value": -75.5, "wait": "settled"}
    json(await rig.call("POST", f"{path}/command", moved, lease=lease))
    assert rig.sim(servo).angle_deg == pytest.approx(-75.5, abs=0.5)
    said = json(await rig.call("POST", f"{path}/command", {"type": "speed", "value": 50}, lease=lease))["warnings"]
    assert any("rotates continuously" in one for one in said)
    await asyncio.sleep(1.0)
    assert rig.sim(servo).speed_rpm == pytest.approx(50, abs=2)


@each
@scene(lambda recipe: recipe)
async def test_a_step_is_measured_and_damped_with_its_own_gains(rig: Rig, servo: Servo, recipe: Recipe) -> None:
    lease = await rig.lease()
    path = f"/servos/{servo.uid}"
    json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
    job = json(await rig.call("POST", f"{path}/step-test?wait=true", {"step_deg": 15.0}, lease=lease))
    assert job["state"] == "succeeded", job["error"]
    run = json(await rig.call("GET", f"/runs/{job['result']['run']}"))
    assert (run["parameters"]["angle_p_gain"], run["parameters"]["angle_d_gain"]) == (50, 1)
    for step in run["steps"]:
        assert step["metrics"]["overshoot_pct"] < 20
        assert step["metrics"]["settling_s"] < 1.0


@each
@scene(lambda recipe: recipe)
async def test_it_is_drawn_where_it_stands_in_a_case_of_sensible_size(rig: Rig, servo: Servo, recipe: Recipe) -> None:
    poses = ViewFeed()
    poses.follow(rig.host, Viewer(poses))
    task = asyncio.create_task(poses.run())
    await asyncio.sleep(1.0 + POSE_S)
    task.cancel()
    (pose,) = poses.poses()
    assert (pose.uid, pose.series, pose.limit_cw_deg) == (servo.uid, "BLA34", 179.9)
    assert pose.angle_deg == pytest.approx(rig.sim(servo).angle_deg, abs=0.2)
    assert case_of(pose.series) is BLA21
