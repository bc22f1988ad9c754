"""Cautions before a move: turns, continuous rotation, lost turns, hold, PWM (B34, B71, B74, B85, B88)."""

import asyncio
from dataclasses import replace

from behaviour.actions import power_cycle, torque
from behaviour.rig import PLAIN, Response, Rig, Socket, json, problem, until
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo, State
from hornbill.sim.bench.recipe import Recipe

WIDE = replace(PLAIN, rom={"angle_limit_cw": 36000, "angle_limit_ccw": -36000, "extended_angle": 1, "soft_start": 0})
SPEEDY = Recipe("BLA21-12U-A0", "1.300", servo_id=2, node_id=12, rom={"speed_torque_control": 1})


async def move(rig: Rig, servo: Servo, lease: str, value: float, *confirm: str, kind: str = "angle") -> Response:
    body = {"type": kind, "value": value, "confirm": list(confirm)}
    return await rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease)


async def cautions(rig: Rig, servo: Servo, value: float, kind: str = "angle") -> list[dict[str, object]]:
    return json(await rig.call("GET", f"/servos/{servo.uid}/cautions?type={kind}&value={value}"))


async def restart(rig: Rig, servo: Servo) -> None:
    boot_count = servo.boot_count
    await power_cycle(rig, servo.uid, 0.4)
    await until(lambda: servo.boot_count > boot_count and servo.state is State.READY, 20)


@scene(WIDE)
async def test_a_move_of_more_than_a_turn_needs_confirmation(rig: Rig, servo: Servo) -> None:
    lease, socket = await rig.lease(), Socket(rig.app)
    json(await move(rig, servo, lease, 300))
    await asyncio.sleep(3)
    refused = problem(await move(rig, servo, lease, 1200), "needs_confirmation", 409)
    assert refused["confirm"] == "turns"
    assert "2.5 turns clockwise" in refused["detail"]
    command: dict[str, object] = {"uid": servo.uid, "type": "angle", "value": 1200}
    socket.send(type="command", lease=lease, commands=[command])
    assert (await socket.receive("error"))["code"] == "needs_confirmation"
    assert abs(rig.sim(servo).angle_deg - 300) < 1
    response = json(await move(rig, servo, lease, 1200, "turns"))
    assert "2.5 turns" in response["warnings"][0]
    problem(await move(rig, servo, lease, 0), "needs_confirmation", 409)
    socket.send(type="command", lease=lease, commands=[command | {"value": -400, "confirm": ["turns"]}])
    await asyncio.sleep(1)
    assert rig.writes()[-1][1:] == ("0x00", -4000)


@scene(SPEEDY)
async def test_continuous_rotation_is_a_warning(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    assert json(await move(rig, servo, lease, 0, kind="speed"))["warnings"] == []
    for kind in ("speed", "torque"):
        (warning,) = json(await move(rig, servo, lease, 20, kind=kind))["warnings"]
        assert "rotates continuously" in warning


@scene(WIDE)
async def test_after_lost_turns_the_next_far_move_needs_confirmation(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    for value in (270, 20):
        json(await move(rig, servo, lease, value))
        await asyncio.sleep(8)
    await restart(rig, servo)
    assert not rig.events("turns_lost"), "within half a turn none is lost"
    assert await cautions(rig, servo, 170) == []
    await torque(rig, servo, "on", lease)
    json(await move(rig, servo, lease, 270))
    await asyncio.sleep(3)
    await restart(rig, servo)
    shown = json(await rig.call("GET", f"/servos/{servo.uid}/parameters/current_angle"))["value"]
    assert abs(shown + 90) < 1, "270° returns as -90°"
    assert rig.events("turns_lost")
    await torque(rig, servo, "on", lease)
    assert [one["confirm"] for one in await cautions(rig, servo, 200)] == ["turn_count"]
    refused = problem(await move(rig, servo, lease, 200), "needs_confirmation", 409)
    assert refused["confirm"] == "turn_count"
    assert "270" in refused["detail"]
    json(await move(rig, servo, lease, -85))
    problem(await move(rig, servo, lease, 200), "needs_confirmation", 409)
    json(await move(rig, servo, lease, 200, "turn_count"))
    assert await cautions(rig, servo, 0) == []


@scene(Recipe("BLA21-06U-AB", "1.300", servo_id=1, node_id=11, rom={"timeout_action": 0, "speed_torque_control": 1}))
async def test_hold_and_pwm_are_warned_of_before_and_with_the_command(rig: Rig, servo: Servo) -> None:
    found = await cautions(rig, servo, 20, "speed")
    assert [(one["level"], one["confirm"]) for one in found] == [
        ("warning", None), ("failure", None), ("warning", None),
    ]  # fmt: skip
    assert "indefinitely" in str(found[1]["text"])
    assert "PWM" in str(found[2]["text"])
    assert rig.writes() == [], "reading cautions moves nothing"
    lease = await rig.lease()
    response = json(await move(rig, servo, lease, 20, kind="speed"))
    assert response["warnings"] == [one["text"] for one in found]
    await asyncio.sleep(3)
    assert rig.sim(servo).speed_rpm > 10
    assert len([1 for _, name, _ in rig.writes() if name == "0x01"]) > 5, "or PWM would take over"


@scene(replace(PLAIN, rom={"timeout_action": 0}))
async def test_with_hold_and_without_pwm_the_command_is_not_repeated(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    json(await move(rig, servo, lease, 20))
    await asyncio.sleep(5)
    assert [raw for _, name, raw in rig.writes() if name == "0x00"] == [200]
    assert rig.sim(servo).output == 0
