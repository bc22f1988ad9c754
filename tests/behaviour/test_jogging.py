"""Moves of limited speed and acceleration, as the simulated horn carries them out."""

import asyncio

from behaviour.rig import Rig, json, problem
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo

PROFILE = {"speed_deg_s": 60, "accel_deg_s2": 240}


async def ready(rig: Rig) -> tuple[Servo, str, str]:
    servo = (await rig.ready())[0]
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    return servo, f"/servos/{servo.uid}/command", lease


def to(degrees: float, **more: object) -> dict[str, object]:
    return {"type": "angle", "value": degrees, "profile": PROFILE, **more}


@scene()
async def test_a_move_with_a_profile_is_never_faster_than_asked_and_arrives(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    sim, loop = rig.sim(servo), asyncio.get_running_loop()
    began = loop.time()
    moving = asyncio.create_task(rig.call("POST", path, to(60, wait="settled"), lease=lease))
    fastest = 0.0
    while not moving.done():
        fastest = max(fastest, abs(sim.speed_rpm) * 6)
        await asyncio.sleep(0.002)
    answer = json(await moving)
    assert answer["settled"] is True
    assert abs(sim.angle_deg - 60) < 0.6
    assert 1.2 < loop.time() - began < 2.2  # 60° at 60 °/s, and a quarter of a second to get there and to brake
    assert fastest < 60 * 1.6  # the servo follows each step of a fiftieth of a second


@scene()
async def test_without_waiting_it_answers_at_once_and_a_new_target_bends_the_way(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    sim = rig.sim(servo)
    assert json(await rig.call("POST", path, to(90), lease=lease))["settled"] is None
    await asyncio.sleep(0.7)
    assert 10 < sim.angle_deg < 50
    json(await rig.call("POST", path, to(0), lease=lease))
    highest = sim.angle_deg
    for _ in range(300):
        await asyncio.sleep(0.01)
        highest = max(highest, sim.angle_deg)
    assert highest < 60
    assert abs(sim.angle_deg) < 0.6


@scene()
async def test_stop_and_a_direct_command_end_a_move(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    json(await rig.call("POST", path, to(90), lease=lease))
    await asyncio.sleep(0.4)
    json(await rig.call("POST", path, {"type": "angle", "value": -10}, lease=lease))
    await asyncio.sleep(1)
    assert abs(rig.sim(servo).angle_deg + 10) < 0.6
    json(await rig.call("POST", path, to(90), lease=lease))
    await asyncio.sleep(0.4)
    json(await rig.call("POST", "/stop"))
    written = len(rig.writes())
    await asyncio.sleep(1)
    assert {name for _, name, _ in rig.writes()[written:]} <= {"0x20"}
    assert rig.sim(servo).output == 1


@scene()
async def test_a_lease_given_back_in_the_middle_takes_torque(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    json(await rig.call("POST", path, to(90), lease=lease))
    await asyncio.sleep(0.4)
    json(await rig.call("DELETE", f"/leases/{lease}"))
    await asyncio.sleep(0.3)
    assert rig.sim(servo).output == 1


@scene()
async def test_a_target_beyond_a_limit_or_a_profile_for_a_speed_is_refused_and_nothing_moves(rig: Rig) -> None:
    servo, path, lease = await ready(rig)
    problem(await rig.call("POST", path, to(5000), lease=lease), "out_of_range", 422)
    problem(await rig.call("POST", path, {"type": "speed", "value": 10, "profile": PROFILE}, lease=lease),
            "invalid_value", 422)  # fmt: skip
    problem(await rig.call("POST", path, to(10)), "lease_held", 409)
    await asyncio.sleep(0.5)
    assert abs(rig.sim(servo).angle_deg) < 0.6
