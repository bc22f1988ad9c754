"""The angle of a healthy servo is never stale, in REST and in a WebSocket, however many servos there are."""

import asyncio
import math

import pytest

from behaviour.rig import PLAIN, Rig, Socket, json
from behaviour.scene import scene
from hornbill.servo.device.reading import ANGLE_STALE_S, LIVE_PERIOD_S
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe

AT_REST = (0.0, 0.3, -0.3, 0.35, -0.4, 0.1, 14.9, -120.0)
"""Angles of horns at rest, some as a soft start leaves them: a few tenths from 0°."""


def crowd(count: int) -> list[Recipe]:
    rom = {"soft_start": 0, "timeout_action": 0}
    return [
        Recipe(servo_id=n, node_id=n, angle_deg=AT_REST[n % len(AT_REST)], rom=rom, uid=bytes([n] * 16))
        for n in range(1, count + 1)
    ]


async def check_angles(rig: Rig, count: int) -> None:
    """Watch the age of every angle for six seconds."""
    servos = await rig.ready(count, within_s=120)
    socket = Socket(rig.app)
    hello = await socket.receive("hello")
    assert hello["stale_after_s"] == {"angle": ANGLE_STALE_S, **LIVE_PERIOD_S}
    socket.send(type="subscribe", topics=["telemetry"])
    await asyncio.sleep(2.0)
    received: dict[str, float] = {}
    oldest = late = 0.0
    began = rig.host.base.now()
    while (now := rig.host.base.now()) - began < 6.0:
        for message in socket.received():
            column = message["channels"].get("current_angle") if message["type"] == "telemetry" else None
            if column is not None:
                received[message["uid"]] = column["t"][-1]
        for servo in servos:
            oldest = max(oldest, math.inf if servo.angle_at is None else now - servo.angle_at)
            late = max(late, now - received.get(servo.uid, began))
        await asyncio.sleep(0.05)
    assert len(received) == count
    assert oldest <= ANGLE_STALE_S / 2
    assert late <= ANGLE_STALE_S
    await socket.close()


@pytest.mark.parametrize("count", [1, 30])
@scene(lambda count: crowd(count))
async def test_the_angle_of_a_healthy_servo_is_never_stale(rig: Rig, count: int) -> None:
    await check_angles(rig, count)


@scene(PLAIN)
async def test_the_age_at_rest_is_that_of_the_last_status(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(60)
    for _ in range(20):
        await asyncio.sleep(0.37)
        assert json(await rig.call("GET", f"/servos/{servo.uid}"))["age_s"] <= 0.11


@scene(PLAIN)
async def test_the_list_of_servos_is_as_fresh_as_each_servo(rig: Rig, servo: Servo) -> None:
    async def compare(times: int) -> float:
        age_s = 0.0
        for _ in range(times):
            (listed,) = json(await rig.call("GET", "/servos"))
            assert listed == json(await rig.call("GET", f"/servos/{servo.uid}"))
            age_s = listed["age_s"]
            await asyncio.sleep(0.033)
        return age_s

    await compare(40)
    await rig.call("PATCH", f"/servos/{servo.uid}", {"label": "rudder"})
    await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"smoothing": False}})
    await compare(2)
    await rig.cable.unplug()
    assert await compare(150) > 4.0


@scene(PLAIN)
async def test_a_read_overtaken_by_torque_off_is_no_older_than_it(rig: Rig, servo: Servo) -> None:
    """The response to a read may arrive after the response to a later, more urgent write."""
    path = f"/servos/{servo.uid}/parameters"
    for step in range(40):
        mode = ("off", "brake")[step % 2]
        reading = asyncio.create_task(rig.call("GET", f"{path}/torque_mode"))
        await asyncio.sleep(step * 25e-6)
        await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": mode})
        await reading
        assert json(await rig.call("GET", path))["parameters"]["torque_mode"]["value"] == mode, step
        await asyncio.sleep(0.05)
