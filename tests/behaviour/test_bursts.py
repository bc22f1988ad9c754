"""Synchronised bursts: all or nothing, sent once, and commanded until the lease ends (table 2-20, B21 to B25)."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.actions import move
from behaviour.rig import PLAIN, Rig, json, problem
from behaviour.scene import scene
from hornbill.errors import Busy, Stopped
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.bursts import Setpoint
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.bench.recipe import Recipe
from hornbill.wire.bittime import frame_bits
from hornbill.wire.messages import ArrayCommand, CommandType

FAST = Recipe("BLA21-06U-A0", "1.300", servo_id=9, node_id=30, rom={"speed_torque_control": 1})


def fleet(count: int) -> list[Recipe]:
    return [replace(PLAIN, node_id=10 + n, servo_id=1 + n) for n in range(count)]


def angles(servos: list[Servo], value: float) -> dict[str, object]:
    return {"commands": [{"uid": servo.uid, "type": "angle", "value": value} for servo in servos]}


@scene(*fleet(20))
async def test_twenty_servos_get_their_angles_in_two_messages_with_the_reported_skew(rig: Rig) -> None:
    servos, lease = await rig.ready(20), await rig.lease()
    assert {servo.position_unit.state for servo in servos} == {"assumed"}, "from the first contact"
    rig.bus.history.clear()
    response = json(await rig.call("POST", "/commands", angles(servos, 30), lease=lease))
    assert response["messages"] == 2
    assert {round(part["value"], 1) for part in response["commands"]} == {30.0}
    await asyncio.sleep(1)
    assert [rig.sim(servo).angle_deg for servo in servos] == pytest.approx([30] * 20, abs=1)
    sent = rig.array_commands()
    first, last = (ArrayCommand.decode(one.payload) for one in sent)
    assert first is not None
    assert last is not None
    assert (len(first.commands), len(last.commands)) == (15, 5)
    assert not {c.actuator_id for one in (first, last) for c in one.commands} & {0, 255}
    frames = [frame for name, frame in rig.bus.history if name == "host" and frame.id >> 8 & 0xFFFF == 1010]
    assert len({frame.id for frame in frames}) == 1, "one priority keeps them together and in order"
    ends = [frame.at for frame in frames]  # a message begins with its first frame and ends with its last
    first_began = ends[0] - frame_bits(frames[0]) / 1e6
    last_began = ends[9] - frame_bits(frames[9]) / 1e6
    assert response["start_skew_s"] == pytest.approx(last_began - first_began, rel=0.1)


@scene(*fleet(3))
async def test_one_invalid_command_rejects_the_whole_burst(rig: Rig) -> None:
    servos, lease = await rig.ready(3), await rig.lease()
    rig.sim(servos[1]).memory.put(0x38, 450)
    servos[1].forget("angle_limit_cw")
    body = angles(servos, 60)
    assert problem(await rig.call("POST", "/commands", body, lease=lease), "out_of_range", 422)["maximum"] == 45.0
    problem(await rig.call("POST", "/commands", body), "lease_held", 409)
    twice = {"commands": angles(servos[:1] * 2, 1)["commands"]}
    problem(await rig.call("POST", "/commands", twice, lease=lease), "invalid_value", 422)
    json(await rig.call("POST", f"/servos/{servos[2].uid}/torque", {"mode": "off"}))
    problem(await rig.call("POST", "/commands", angles(servos, 5), lease=lease), "torque_off", 409)
    speed = {"commands": [{"uid": servos[0].uid, "type": "speed", "value": 5}]}
    problem(await rig.call("POST", "/commands", speed, lease=lease), "mode_off", 409)
    json(await rig.call("POST", "/stop"))
    problem(await rig.call("POST", "/commands", angles(servos[:1], 5), lease=lease), "stopped", 423)
    assert rig.array_commands() == []
    assert not [write for write in rig.writes() if write[1] == "0x00"]


@scene(*(replace(PLAIN, node_id=10 + n, servo_id=own) for n, own in enumerate((0, 5, 5))))
async def test_a_servo_id_of_0_or_of_two_servos_is_rejected(rig: Rig) -> None:
    servos, lease = await rig.ready(3), await rig.lease()
    for servo in servos:
        refused = problem(await rig.call("POST", "/commands", angles([servo], 5), lease=lease), "conflict", 409)
        assert refused["key"] == "servo_id"
    assert rig.array_commands() == []


@scene(replace(PLAIN, behaviour=Behaviour(position_unit="radian")))
async def test_a_position_unit_conflict_blocks_angles_until_forced(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    await move(rig, servo, lease)
    await asyncio.sleep(3)
    assert servo.position_unit.state == "conflict"
    refused = await rig.call("POST", "/commands", angles([servo], 30), lease=lease)
    assert "force" in problem(refused, "position_unit_unconfirmed", 409)["detail"]
    assert rig.array_commands() == []
    servo.position_unit.forced = "radian"
    json(await rig.call("POST", "/commands", angles([servo], 30), lease=lease))
    await asyncio.sleep(1)
    assert abs(rig.sim(servo).angle_deg - 30) < 1


@scene(replace(PLAIN, rom={"angle_limit_cw": 36000, "extended_angle": 1}))
async def test_an_angle_beyond_half_a_turn_uses_0x00(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    refused: dict[str, Any] = {}
    for value in (180.1, 600.3, 3000.7):
        body = angles([servo], value) | {"confirm": ["turns"]}
        refused = problem(await rig.call("POST", "/commands", body, lease=lease), "invalid_value", 422)
        assert (refused["minimum"], refused["maximum"]) == (-180, 180)
    stream = json(await rig.call("POST", "/streams", {"uids": [servo.uid]}, lease=lease), 201)["id"]
    put = await rig.call("PUT", f"/streams/{stream}", {"values": {servo.uid: 180.1}}, lease=lease)
    problem(put, "invalid_value", 422)
    await rig.call("DELETE", f"/streams/{stream}", lease=lease)
    advised = refused["detail"].rpartition("POST /api/v1")[2].rstrip(".")
    alone = {"type": "angle", "value": 3000.7, "confirm": ["turns"]}
    assert json(await rig.call("POST", advised, alone, lease=lease))["value"] == 3000.7
    assert rig.array_commands() == []
    assert ("0x00", 30007) in [(name, raw) for _, name, raw in rig.writes()]


@scene(FAST)
async def test_speed_and_torque_are_sent_in_rpm_and_percent(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    for kind, value, number in (("speed", -60, CommandType.SPEED), ("torque", 12, CommandType.FORCE)):
        rig.bus.history.clear()
        body = {"commands": [{"uid": servo.uid, "type": kind, "value": value}]}
        assert json(await rig.call("POST", "/commands", body, lease=lease))["warnings"]
        await asyncio.sleep(0.1)
        found = ArrayCommand.decode(rig.array_commands()[0].payload)
        assert found is not None
        assert (found.commands[0].command_type, found.commands[0].command_value) == (number, value)
        assert servo.raw(f"command_{kind}") == value
        assert servo.raw("command_angle") == 555_555_555


@pytest.mark.parametrize("shows", [True, False])
@pytest.mark.parametrize("feeds", [True, False])
@scene(
    lambda shows, feeds: replace(
        PLAIN, behaviour=Behaviour(array_command_shows=shows, array_command_feeds_timeout=feeds)
    )
)
async def test_a_burst_is_commanded_until_the_lease_expires(rig: Rig, servo: Servo, shows: bool, feeds: bool) -> None:
    expires_at = asyncio.get_running_loop().time() + 8
    lease = await rig.lease(ttl_s=8)
    json(await rig.call("POST", "/commands", angles([servo], 33.3), lease=lease))
    assert rig.host.motion.is_commanded(servo.uid)
    await asyncio.sleep(5)
    assert len(rig.array_commands()) == 1, "a burst is never repeated"
    assert rig.sim(servo).output == 0
    assert abs(rig.sim(servo).angle_deg - 33.3) < 1
    assert not rig.events("command_ended")
    assert abs((servo.raw("command_angle") or 0) - 333) <= 1
    await asyncio.sleep(expires_at + 0.1 - asyncio.get_running_loop().time())
    assert rig.sim(servo).output == 1


@scene(PLAIN)
async def test_a_servo_that_missed_a_burst_is_released_and_not_moved_late(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    json(await rig.call("POST", "/commands", angles([servo], 20), lease=lease))
    await asyncio.sleep(1)
    prepared = await rig.host.bursts.prepare(lease, [Setpoint(servo, "angle", 80.0)])
    rig.bus.loss(100)
    rig.host.bursts.send(lease, prepared)
    await asyncio.sleep(0.05)
    rig.bus.loss(0)
    await asyncio.sleep(3)
    assert "did not receive" in rig.events("command_ended")[0].text
    assert abs(rig.sim(servo).angle_deg - 20) < 1
    assert rig.sim(servo).output == 1, "its own timeout turned it off"


@scene(*fleet(2))
async def test_a_stop_invalidates_a_prepared_burst(rig: Rig) -> None:
    servos, lease = await rig.ready(2), await rig.lease()
    prepared = await rig.host.bursts.prepare(lease, [Setpoint(servo, "angle", 10.0) for servo in servos])
    rig.host.bursts.send(lease, prepared)
    for n in range(50):
        values = {servo.uid: 10.0 + n / 10 for servo in servos}
        prepared = rig.host.bursts.renewed(prepared, values)
        rig.host.bursts.send(lease, prepared)
        await asyncio.sleep(0.02)
    assert [rig.sim(servo).angle_deg for servo in servos] == pytest.approx([14.9] * 2, abs=1)
    assert not [write for write in rig.writes() if write[1] == "0x00"], "the stream itself is enough"
    json(await rig.call("POST", "/stop"))
    with pytest.raises(Stopped):
        rig.host.bursts.send(lease, prepared)
    json(await rig.call("DELETE", "/stop"))
    servos[0].boot_count += 1
    with pytest.raises(Busy):
        rig.host.bursts.send(lease, prepared)
    assert len(rig.array_commands()) == 51
