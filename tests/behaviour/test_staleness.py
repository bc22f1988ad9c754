"""A healthy servo never looks old: by REST, and as a page at the end of a socket is told, however many there are."""

import asyncio
import math

import pytest

from behaviour.rig import PLAIN, Rig, Socket, json
from behaviour.scene import scene
from hornbill.servo.device.reading import ANGLE_STALE_S, LIVE_PERIOD_S
from hornbill.sim.bench.recipe import Recipe

REST = (0.0, 0.3, -0.3, 0.35, -0.4, 0.1, 14.9, -120.0)
"""Where horns stand: also where a soft start ends, a few tenths from 0°."""


def crowd(count: int) -> list[Recipe]:
    rom = {"soft_start": 0, "timeout_action": 0}
    return [
        Recipe(servo_id=n, node_id=n, angle_deg=REST[n % len(REST)], rom=rom, uid=bytes([n] * 16))
        for n in range(1, count + 1)
    ]


@pytest.mark.parametrize("count", [1, 6, 16, 40, 60, 125])
@scene(lambda count: crowd(count))
async def test_no_angle_of_a_healthy_servo_is_ever_old(rig: Rig, count: int) -> None:
    servos = await rig.ready(count, within_s=120)
    socket = Socket(rig.app)
    hello = await socket.hear("hello")
    assert hello["stale_after_s"] == {"angle": ANGLE_STALE_S, **LIVE_PERIOD_S}
    socket.say(type="subscribe", topics=["telemetry"])
    await asyncio.sleep(2.0)
    told: dict[str, float] = {}
    oldest = late = 0.0
    begun = rig.host.base.now()
    while (now := rig.host.base.now()) - begun < (12.0 if count <= 40 else 6.0):
        for message in socket.heard():
            column = message["channels"].get("current_angle") if message["type"] == "telemetry" else None
            if column is not None:
                told[message["uid"]] = column["t"][-1]
        for servo in servos:
            oldest = max(oldest, math.inf if servo.angle_at is None else now - servo.angle_at)
            late = max(late, now - told.get(servo.uid, begun))
        await asyncio.sleep(0.05)
    assert len(told) == count
    assert oldest <= ANGLE_STALE_S / 2
    assert late <= ANGLE_STALE_S
    await socket.close()


@scene(PLAIN)
async def test_the_age_in_rest_is_that_of_the_last_status(rig: Rig) -> None:
    (servo,) = await rig.ready()
    await asyncio.sleep(60)
    for _ in range(20):
        await asyncio.sleep(0.37)
        assert json(await rig.call("GET", f"/servos/{servo.uid}"))["age_s"] <= 0.11
