"""A BLA34: its own ranges, driven by speed, and drawn."""

import asyncio

import pytest

from behaviour.actions import move, write
from behaviour.applying import in_order
from behaviour.rig import Rig, json, problem
from behaviour.scene import scene
from hornbill.app.view_feed import POSE_S, ViewFeed
from hornbill.sim.bench.recipe import Recipe
from hornbill.units import Uid
from hornbill.view.case import BLA21, case_of
from hornbill.view.viewer import Viewer

SET_UP = {"soft_start": 0, "speed_torque_control": 1}
READY = [
    Recipe(f"BLA34-{volts}U-AB", "1.500", servo_id=n, node_id=20 + n, angle_deg=10.0, rom={"speed_torque_control": 1})
    for n, volts in ((1, 12), (2, 28))
]


@scene(*READY)
async def test_it_is_written_within_its_own_ranges_turned_by_speed_and_drawn(rig: Rig) -> None:
    servos, lease = await in_order(rig, 2), await rig.lease()
    for servo, recipe, limit_a in zip(servos, READY, (6.3, 2.4), strict=True):
        path = f"/servos/{servo.uid}"
        shown = json(await rig.call("GET", path))
        assert (shown["model"], shown["series"], shown["model_number"]) == (recipe.model, "BLA34", 86)
        for key, good, bad in (("speed_limit_cw", 80, 81), ("overcurrent_limit", limit_a, 6.4), ("pwm_range", 1100, 9)):
            await write(rig, servo, lease, **{key: good})
            refused = await rig.call("PUT", f"{path}/parameters/{key}", {"value": bad}, lease=lease)
            problem(refused, "out_of_range", 422)
        too_fast = await rig.call("POST", f"{path}/command", {"type": "speed", "value": 81}, lease=lease)
        problem(too_fast, "out_of_range", 422)
        warnings = (await move(rig, servo, lease, 50, type="speed"))["warnings"]
        assert any("rotates continuously" in one for one in warnings)
        await asyncio.sleep(1.0)
        assert rig.sim(servo).speed_rpm == pytest.approx(50, abs=2)
        await move(rig, servo, lease, 0, type="speed")
    await asyncio.sleep(1)
    poses = ViewFeed()
    poses.follow(rig.host, Viewer(poses))
    task = asyncio.create_task(poses.run())
    await asyncio.sleep(1.0 + POSE_S)
    task.cancel()
    for pose in poses.poses():
        sim = rig.bench.servo(Uid(pose.uid))
        assert (pose.series, pose.limit_cw_deg, case_of(pose.series)) == ("BLA34", 179.9, BLA21)
        assert pose.angle_deg is not None
        assert abs((pose.angle_deg - sim.angle_deg + 180) % 360 - 180) < 0.2
