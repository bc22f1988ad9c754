"""The activity of a servo in REST and sockets: hunting, saturation, its own timeout; and no false alarm."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.actions import move, torque, write
from behaviour.rig import PLAIN, Rig, Socket, json, until
from behaviour.scene import scene
from hornbill.domain.plant import PlantConstants
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe

HUNTS = Recipe(
    "BLA21-12U-A0", "1.300", servo_id=1, node_id=11, angle_deg=100.0, plant=PlantConstants(inertia=3.0),
    rom={"speed_torque_control": 1, "angle_p_gain": 100, "angle_d_gain": 0, "angle_dead_band": 0, "timeout_action": 0},
)  # fmt: skip
"""As in the demo, with a timeout action that lets it continue."""
ALARMS = ("hunting", "hunting_ended", "saturated", "saturated_ended")


async def doing(rig: Rig, servo: Servo) -> str:
    return str(json(await rig.call("GET", f"/servos/{servo.uid}"))["activity"]["state"])


def alarms(rig: Rig) -> list[str]:
    return [event.code for code in ALARMS for event in rig.events(code)]


async def becomes(rig: Rig, servo: Servo, state: str, within_s: float) -> None:
    await until(lambda: rig.host.activities.of(servo).doing == state, within_s)


async def steadily(rig: Rig, servo: Servo, state: str, seconds: float) -> None:
    for _ in range(round(seconds / 0.05)):
        await asyncio.sleep(0.05)
        assert rig.host.activities.of(servo).doing == state


async def commanded(rig: Rig, servo: Servo, kind: str = "angle", value: float = 10.0) -> None:
    """Turn torque on and command it."""
    lease = await rig.lease()
    await torque(rig, servo, "on", lease)
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": kind, "value": value}, lease=lease))


async def alarmless(rig: Rig, count: int, *, moves: int, jogs: int, rest_s: float) -> None:
    """Move, jog, rest past the end of the lease, restart and rest; nothing must raise an alarm."""
    servos = await rig.ready(count, within_s=60)
    lease = await rig.lease(ttl_s=moves * 2.5 + jogs * 0.05 + 5)
    movable = [one for one in servos if not one.rom_lost]
    more: dict[str, Any] = {"clamp": True, "confirm": ["turns", "turn_count"]}
    for servo in movable:
        await torque(rig, servo, "on", lease)
    for turn in range(moves):
        for servo in movable:
            await move(rig, servo, lease, (-1) ** turn * 30, **more)
        await asyncio.sleep(2.5)
    for tick in range(jogs):
        await move(rig, movable[0], lease, round(abs(tick % 20 - 10) * 1.0, 1), **more)
        await asyncio.sleep(0.05)
    await asyncio.sleep(15)
    assert rig.host.leases.current(rig.host.base.now()) is None
    for on in (False, True):
        for servo in servos:
            rig.bench.power(servo.uid, on)
        await asyncio.sleep(rest_s if on else 4)
    assert alarms(rig) == []


async def watched(rig: Rig, servo: Servo) -> tuple[list[float], list[float]]:
    """Times and true angles of a horn for one second."""
    t: list[float] = []
    angle: list[float] = []
    for _ in range(1000):
        await asyncio.sleep(0.001)
        t.append(asyncio.get_running_loop().time())
        rig.sim(servo).motion.advance(t[-1])
        angle.append(rig.sim(servo).angle_deg)
    return t, angle


def rate_of(t: list[float], angle: list[float]) -> float:
    """Frequency of a swing from its upward crossings of its middle."""
    middle = (max(angle) + min(angle)) / 2
    ups = [at for at, before, after in zip(t, angle, angle[1:], strict=False) if before < middle <= after]
    return (len(ups) - 1) / (ups[-1] - ups[0])


@scene(HUNTS)
async def test_hunting_is_reported_within_3_s_and_until_it_ends(rig: Rig, servo: Servo) -> None:
    socket = Socket(rig.app)
    socket.send(type="subscribe", topics=["servos", "events"])
    await becomes(rig, servo, "hunting", 3.0)
    await steadily(rig, servo, "hunting", 30.0)
    (event,) = rig.events("hunting")
    assert event.params["peak_to_peak_deg"] == pytest.approx(2.0, abs=0.5)
    shown = json(await rig.call("GET", f"/servos/{servo.uid}"))["activity"]
    assert shown["state"] == "hunting"
    assert shown["peak_to_peak_deg"] == pytest.approx(2.0, abs=0.5)
    t, angle = await watched(rig, servo)
    assert shown["oscillation_hz"] == pytest.approx(rate_of(t, angle), rel=0.05)
    last: list[dict[str, Any]] = [one for one in socket.received() if one["type"] == "servos"]
    assert last[-1]["servos"][0]["activity"]["state"] == "hunting"
    await write(rig, servo, angle_dead_band=3)
    await becomes(rig, servo, "holding", 8.0)
    await steadily(rig, servo, "holding", 10.0)
    assert alarms(rig) == ["hunting", "hunting_ended"]


@scene(replace(PLAIN, rom={"timeout_action": 0}))
async def test_saturation_is_reported_until_the_load_goes(rig: Rig, servo: Servo) -> None:
    await asyncio.sleep(3)
    rig.sim(servo).conditions.load_pct = 92.0
    await becomes(rig, servo, "saturated", 12.0)
    await steadily(rig, servo, "saturated", 10.0)
    rig.sim(servo).conditions.load_pct = 20.0
    await becomes(rig, servo, "holding", 8.0)
    await asyncio.sleep(5)
    assert alarms(rig) == ["saturated", "saturated_ended"]


@pytest.mark.parametrize(("action", "state"), [("off", "released"), ("brake", "brake"), ("hold", "held_after_timeout")])
@scene(PLAIN)
async def test_the_action_of_the_servos_own_timeout_is_shown(rig: Rig, servo: Servo, action: str, state: str) -> None:
    await write(rig, servo, timeout_action=action)
    await commanded(rig, servo)
    await asyncio.sleep(4)
    assert await doing(rig, servo) == "holding"
    rig.host.motion.stop_commanding(servo)
    await asyncio.sleep(4)
    assert await doing(rig, servo) == state
    if action == "off":
        servo.output.commanded_at = servo.output.timed_out_at = None  # as for a server started since
        json(await rig.call("PUT", "/bus", {"address": "memory:host"}))
        await rig.ready()
        await asyncio.sleep(3)
        assert rig.sim(servo).output == 1
        assert await doing(rig, servo) == state


@scene(replace(PLAIN, rom={"speed_torque_control": 1}))
async def test_turning_brake_off_and_unknown_are_shown(rig: Rig, servo: Servo) -> None:
    await commanded(rig, servo, "speed", 20)
    await asyncio.sleep(2)
    assert await doing(rig, servo) == "turning"
    await torque(rig, servo, "brake")
    await asyncio.sleep(1)
    assert await doing(rig, servo) == "brake"
    json(await rig.call("POST", "/stop"))
    await asyncio.sleep(1)
    assert await doing(rig, servo) == "off"
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(5)
    assert await doing(rig, servo) == "unknown"
