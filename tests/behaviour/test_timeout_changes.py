"""Changing the servo's own timeout (0x27) under command, and timeouts too short to keep alive (4.19)."""

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest

from behaviour.rig import PLAIN, Rig, json, until
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.sim import address

SPEEDY = replace(PLAIN, rom={"speed_torque_control": 1})
HOLDING = replace(PLAIN, rom={"timeout_action": 0})


async def commanded(rig: Rig, value: float = 15.0, kind: str = "angle") -> tuple[Servo, str, dict[str, object]]:
    """A servo under command, the lease, and the response."""
    servo = (await rig.ready())[0]
    lease = await rig.lease()
    body = {"type": kind, "value": value}
    return servo, lease, json(await rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease))


async def set_timeout(rig: Rig, servo: Servo, lease: str, ms: int) -> None:
    path = f"/servos/{servo.uid}/parameters/timeout_time"
    json(await rig.call("PUT", path, {"value": ms}, lease=lease))


@asynccontextmanager
async def torque_stays_on(rig: Rig, servo: Servo) -> AsyncGenerator[None]:
    """Check every half millisecond that torque is on, and at the end that the command has not ended."""
    sim, off = rig.sim(servo), 0

    async def watch() -> None:
        nonlocal off
        while True:
            sim.advance(asyncio.get_running_loop().time())
            off += sim.output != 0
            await asyncio.sleep(0.0005)

    task = asyncio.create_task(watch())
    yield
    task.cancel()
    assert (off, rig.events("command_ended")) == (0, [])


@pytest.mark.parametrize("after_s", [0.01, 0.2, 0.32, 1.0])
@pytest.mark.parametrize(("before", "ms"), [(1000, 100), (60_000, 100), (1000, 300), (60_000, 1000)])
@scene(lambda before: replace(PLAIN, rom={"timeout_time": before}))
async def test_a_timeout_shortened_under_command_keeps_torque_on(
    rig: Rig, after_s: float, before: int, ms: int
) -> None:
    servo, lease, _ = await commanded(rig)
    async with torque_stays_on(rig, servo):
        await asyncio.sleep(after_s)
        await set_timeout(rig, servo, lease, ms)
        await asyncio.sleep(2)


@scene()
async def test_every_call_that_changes_the_timeout_and_a_refused_one_keep_torque_on(rig: Rig) -> None:
    servo, lease, _ = await commanded(rig)
    async with torque_stays_on(rig, servo):
        path = f"/servos/{servo.uid}/parameters"
        rig.sim(servo).conditions.refuse_keys.add("angle_p_gain")
        await asyncio.sleep(0.3)
        values = {"timeout_time": 100, "angle_p_gain": 60, "smoothing": False}
        await rig.call("PATCH", path, {"values": values}, lease=lease)
        assert rig.sim(servo).register(address.TIMEOUT_TIME) == 1000, "restored"
        rig.sim(servo).conditions.refuse_keys.clear()
        await asyncio.sleep(2)
        json(await rig.call("PATCH", path, {"values": values}, lease=lease))
        await asyncio.sleep(0.7)
        await set_timeout(rig, servo, lease, 60_000)
        await asyncio.sleep(0.7)
        json(await rig.call("PUT", "/profiles/quick", {"values": {"timeout_time": 90}}), 201)
        await rig.call("POST", "/profiles/quick/apply", {"uids": [servo.uid]}, lease=lease)
        await asyncio.sleep(2)
        assert servo.raw("timeout_time") == 90


@scene()
async def test_a_lost_response_to_the_change_keeps_torque_on(rig: Rig) -> None:
    """The servo has the new timeout 120 ms before the host knows."""
    servo, lease, _ = await commanded(rig)
    async with torque_stays_on(rig, servo):
        await asyncio.sleep(0.9)
        change = asyncio.create_task(set_timeout(rig, servo, lease, 90))
        await until(lambda: rig.sim(servo).register(address.TIMEOUT_TIME) == 90, every_s=0.00005)
        rig.cable.deafen(100)
        await asyncio.sleep(0.001)
        rig.cable.deafen(0)
        await change
        await asyncio.sleep(1)


@scene(SPEEDY)
async def test_a_commanded_speed_continues_when_the_timeout_is_shortened(rig: Rig) -> None:
    servo, lease, _ = await commanded(rig, 60, "speed")
    async with torque_stays_on(rig, servo):
        await asyncio.sleep(1.3)
        await set_timeout(rig, servo, lease, 100)
        await asyncio.sleep(1)
        assert rig.sim(servo).speed_rpm > 50


@scene()
async def test_a_timeout_that_another_tool_shortened_too_far_is_reported_when_read(rig: Rig) -> None:
    servo, _, _ = await commanded(rig)
    await asyncio.sleep(0.2)
    rig.sim(servo).memory.put(address.TIMEOUT_TIME, 100)
    await asyncio.sleep(0.05)
    json(await rig.call("GET", f"/servos/{servo.uid}/parameters/timeout_time"))
    await asyncio.sleep(0.1)
    (event,) = rig.events("command_ended")
    assert "was not commanded for" in event.text
    assert "timeout (0x27) of 100 ms" in event.text


@scene()
async def test_a_timeout_that_another_tool_shortened_is_observed_once_read(rig: Rig) -> None:
    servo, _, _ = await commanded(rig)
    async with torque_stays_on(rig, servo):
        await asyncio.sleep(0.05)
        rig.sim(servo).memory.put(address.TIMEOUT_TIME, 200)
        json(await rig.call("GET", f"/servos/{servo.uid}/parameters/timeout_time"))
        await asyncio.sleep(2)


async def cautions(rig: Rig, servo: Servo) -> list[dict[str, object]]:
    return json(await rig.call("GET", f"/servos/{servo.uid}/cautions?type=angle&value=12"))


@pytest.mark.parametrize("ms", [10, 59])
@scene(lambda ms: replace(PLAIN, rom={"timeout_time": ms}))
async def test_a_timeout_too_short_to_keep_alive_is_a_caution_and_a_warning(rig: Rig, servo: Servo, ms: int) -> None:
    (caution,) = await cautions(rig, servo)
    assert (caution["level"], caution["code"], caution["confirm"]) == ("warning", "timeout_too_short", None)
    assert caution["params"] == {"timeout_ms": ms, "shortest_ms": 60}
    assert f"times out {ms} ms" in str(caution["text"])
    assert "Set timeout_time to 60 ms or more" in str(caution["text"])
    lease = await rig.lease()
    body = {"type": "angle", "value": 12, "wait": "settled", "timeout_s": 0.5}
    response = json(await rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease))
    assert response["warnings"] == [caution["text"]]


@pytest.mark.parametrize("recipe", [replace(PLAIN, rom={"timeout_time": 60}), HOLDING])
@scene(lambda recipe: recipe)
async def test_a_timeout_that_is_long_enough_or_has_no_action_is_no_caution(rig: Rig, recipe: object) -> None:
    servo, _, response = await commanded(rig)
    assert (await cautions(rig, servo), response["warnings"]) == ([], [])
    await asyncio.sleep(1)
    assert rig.sim(servo).output == 0


@scene()
async def test_late_repeats_lengthen_the_shortest_timeout(rig: Rig) -> None:
    servo, lease, _ = await commanded(rig)
    await set_timeout(rig, servo, lease, 100)
    for _ in range(5):
        await asyncio.sleep(1)
        assert await cautions(rig, servo) == []
    keeping = rig.host.motion.keeping_alive
    assert keeping.shortest_s == 0.06
    keeping._note_lateness(0.08)  # pyright: ignore[reportPrivateUsage]
    (caution,) = await cautions(rig, servo)
    assert caution["params"] == {"timeout_ms": 100, "shortest_ms": 120}
    await asyncio.sleep(61)
    assert await cautions(rig, servo) == [], "only recent lateness counts"
