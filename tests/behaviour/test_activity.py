"""What a servo does now, as REST and sockets tell it: hunting, saturation, its own time-out; and no false alarm."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.rig import CATALOG, PLAIN, Rig, Socket, json, play
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.demo import demo_fleet
from hornbill.sim.bench.recipe import Recipe

HUNTS = Recipe(
    "BLA21-12U-A0", "1.300", servo_id=1, node_id=11, angle_deg=100.0, load_inertia=3.0,
    rom={"speed_torque_control": 1, "angle_p_gain": 100, "angle_d_gain": 0, "angle_dead_band": 0, "timeout_action": 0},
)  # fmt: skip
"""As in the demo, with a time-out that lets it go on."""
ALARMS = ("hunting", "hunting_ended", "saturated", "saturated_ended")


async def doing(rig: Rig, servo: Servo) -> str:
    return str(json(await rig.call("GET", f"/servos/{servo.uid}"))["activity"]["state"])


def alarms(rig: Rig) -> list[str]:
    return [event.code for code in ALARMS for event in rig.events(code)]


async def until(rig: Rig, servo: Servo, state: str, within_s: float) -> None:
    async with asyncio.timeout(within_s):
        while rig.host.activities.of(servo).doing != state:
            await asyncio.sleep(0.02)


async def steadily(rig: Rig, servo: Servo, state: str, seconds: float) -> None:
    for _ in range(round(seconds / 0.05)):
        await asyncio.sleep(0.05)
        assert rig.host.activities.of(servo).doing == state


async def on(rig: Rig, servo: Servo) -> str:
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    return lease


@scene(HUNTS)
async def test_the_servo_that_hunts_is_told_within_three_seconds_without_flapping_until_it_is_calmed(rig: Rig) -> None:
    (servo,) = await rig.ready()
    socket = Socket(rig.app)
    socket.say(type="subscribe", topics=["servos", "events"])
    await until(rig, servo, "hunting", 3.0)
    await steadily(rig, servo, "hunting", 60.0)
    (event,) = rig.events("hunting")
    assert event.params["peak_to_peak_deg"] == pytest.approx(2.0, abs=0.5)
    shown = json(await rig.call("GET", f"/servos/{servo.uid}"))["activity"]
    assert shown["state"] == "hunting"
    assert shown["peak_to_peak_deg"] == pytest.approx(2.0, abs=0.5)
    last: list[dict[str, Any]] = [one for one in socket.heard() if one["type"] == "servos"]
    assert last[-1]["servos"][0]["activity"]["state"] == "hunting"
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"angle_dead_band": 3}}))
    await until(rig, servo, "holding", 8.0)
    await steadily(rig, servo, "holding", 20.0)
    assert alarms(rig) == ["hunting", "hunting_ended"]
    await socket.close()


def test_a_healthy_fleet_raises_no_alarm_in_minutes_of_moves_jogs_restarts_and_rest() -> None:
    fleet = [one for one in demo_fleet(CATALOG, 10, 1) if "hunts" not in one.story]

    async def scene(rig: Rig) -> None:
        servos = await rig.ready(len(fleet), within_s=60)
        lease = await rig.lease()
        movable = [one for one in servos if not one.rom_lost]
        for servo in movable:
            json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
        for turn in range(12):
            for servo in movable:
                body = {"type": "angle", "value": (-1) ** turn * 30, "clamp": True, "confirm": ["turns", "turn_count"]}
                json(await rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease))
            await asyncio.sleep(2.5)
        for tick in range(150):
            body = {"type": "angle", "value": round(abs(tick % 20 - 10) * 1.0, 1), "clamp": True}
            json(await rig.call("POST", f"/servos/{movable[0].uid}/command", body, lease=lease))
            await asyncio.sleep(0.05)
        await asyncio.sleep(35)  # the lease expires meanwhile
        for servo in servos:
            rig.bench.power(servo.uid, False)
        await asyncio.sleep(4)
        for servo in servos:
            rig.bench.power(servo.uid, True)
        await asyncio.sleep(60)
        assert alarms(rig) == []

    play(scene, *fleet)


@scene(replace(PLAIN, rom={"timeout_action": 0}))
async def test_a_horn_held_against_a_heavy_load_is_saturated_until_the_load_goes(rig: Rig) -> None:
    (servo,) = await rig.ready()
    await asyncio.sleep(3)
    rig.sim(servo).conditions.load_pct = 92.0
    await until(rig, servo, "saturated", 12.0)
    await steadily(rig, servo, "saturated", 20.0)
    rig.sim(servo).conditions.load_pct = 20.0
    await until(rig, servo, "holding", 8.0)
    await asyncio.sleep(5)
    assert alarms(rig) == ["saturated", "saturated_ended"]


@pytest.mark.parametrize(("action", "state"), [("off", "released"), ("brake", "brake"), ("hold", "held_after_timeout")])
@scene(PLAIN)
async def test_what_its_own_time_out_does_is_told(rig: Rig, action: str, state: str) -> None:
    (servo,) = await rig.ready()
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"timeout_action": action}}))
    lease = await on(rig, servo)
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 10}, lease=lease))
    await asyncio.sleep(4)
    assert await doing(rig, servo) == "holding"
    rig.host.motion.stop_commanding(servo)
    await asyncio.sleep(4)
    assert await doing(rig, servo) == state


@scene(PLAIN)
async def test_a_time_out_of_before_the_server_started_is_told(rig: Rig) -> None:
    (servo,) = await rig.ready()
    lease = await on(rig, servo)
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": 10}, lease=lease))
    await asyncio.sleep(5)
    rig.host.motion.stop_commanding(servo)
    await asyncio.sleep(5)
    servo.output.commanded_at = servo.output.timed_out_at = None  # a server that knows nothing of before
    json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
    await rig.ready()
    await asyncio.sleep(3)
    assert rig.sim(servo).output == 1
    assert await doing(rig, servo) == "released"


@scene(replace(PLAIN, rom={"speed_torque_control": 1}))
async def test_turning_off_brake_and_silence_have_their_words(rig: Rig) -> None:
    (servo,) = await rig.ready()
    lease = await on(rig, servo)
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "speed", "value": 20}, lease=lease))
    await asyncio.sleep(2)
    assert await doing(rig, servo) == "turning"
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "brake"}))
    await asyncio.sleep(1)
    assert await doing(rig, servo) == "brake"
    json(await rig.call("POST", "/stop"))
    await asyncio.sleep(1)
    assert await doing(rig, servo) == "off"
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(5)
    assert await doing(rig, servo) == "unknown"
