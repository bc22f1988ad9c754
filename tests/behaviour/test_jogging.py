"""Moves with limited speed and acceleration, as the simulated horn performs them."""

import asyncio

from behaviour.actions import move, torque
from behaviour.rig import Rig, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo

PROFILE = {"speed_deg_s": 60, "accel_deg_s2": 240}


async def torque_on(rig: Rig, servo: Servo) -> str:
    """The lease under which torque was turned on."""
    lease = await rig.lease()
    await torque(rig, servo, "on", lease)
    return lease


@scene()
async def test_a_move_keeps_its_speed_limit_and_arrives(rig: Rig, servo: Servo) -> None:
    lease, sim, loop = await torque_on(rig, servo), rig.sim(servo), asyncio.get_running_loop()
    began = loop.time()
    moving = asyncio.create_task(move(rig, servo, lease, 60, profile=PROFILE, wait="settled"))
    fastest = 0.0
    while not moving.done():
        fastest = max(fastest, abs(sim.speed_rpm) * 6)
        await asyncio.sleep(0.002)
    assert (await moving)["settled"] is True
    assert abs(sim.angle_deg - 60) < 0.6
    assert 1.2 < loop.time() - began < 2.2  # 60° at 60 °/s, and a quarter of a second to accelerate and to brake
    assert fastest < 60 * 1.6  # the servo follows each step of a fiftieth of a second


@scene()
async def test_a_new_target_a_direct_command_stop_and_a_released_lease_end_a_move(rig: Rig, servo: Servo) -> None:
    lease, sim, path = await torque_on(rig, servo), rig.sim(servo), f"/servos/{servo.uid}/command"
    for body, code, by in (
        ({"type": "angle", "value": 5000}, "out_of_range", lease),
        ({"type": "speed", "value": 10}, "invalid_value", lease),
        ({"type": "angle", "value": 10}, "lease_held", None),
    ):
        problem(await rig.call("POST", path, body | {"profile": PROFILE}, lease=by), code, 409 if by is None else 422)
    await asyncio.sleep(0.5)
    assert abs(sim.angle_deg) < 0.6
    assert (await move(rig, servo, lease, 90, profile=PROFILE))["settled"] is None, "it responds at once"
    await asyncio.sleep(0.7)
    assert 10 < sim.angle_deg < 50
    await move(rig, servo, lease, 0, profile=PROFILE)
    highest = sim.angle_deg
    for _ in range(300):
        await asyncio.sleep(0.01)
        highest = max(highest, sim.angle_deg)
    assert highest < 60
    assert abs(sim.angle_deg) < 0.6

    await move(rig, servo, lease, 90, profile=PROFILE)
    await asyncio.sleep(0.4)
    await move(rig, servo, lease, -10)
    await asyncio.sleep(1)
    assert abs(sim.angle_deg + 10) < 0.6
    for verb, end in (("POST", "/stop"), ("DELETE", f"/leases/{lease}")):
        await torque(rig, servo, "on", lease)
        await move(rig, servo, lease, 90, profile=PROFILE)
        await asyncio.sleep(0.4)
        json(await rig.call(verb, end))
        written = len(rig.writes())
        await asyncio.sleep(1)
        assert {name for _, name, _ in rig.writes()[written:]} <= {"0x20"}
        assert sim.output == 1
        await rig.call("DELETE", "/stop")
