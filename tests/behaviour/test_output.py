"""Output of a servo as session state: on or off, why, by whom, since when (sections 4.7, 4.13, 4.19)."""

import asyncio
from typing import Any

import pytest

from behaviour.neighbour import Neighbour
from behaviour.rig import Rig, Socket, json
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import ActuatorCommand, ArrayCommand, CommandType


async def output(rig: Rig, servo: Servo) -> Any:
    return json(await rig.call("GET", f"/servos/{servo.uid}"))["output"]


async def becomes(rig: Rig, servo: Servo, state: str, reason: str, by: str | None, within_s: float = 3.0) -> float:
    """Wait for this output; since when it is so."""
    async with asyncio.timeout(within_s):
        while True:
            found = await output(rig, servo)
            if (found["state"], found["reason"], found["by"]) == (state, reason, by):
                assert found["since"] <= rig.host.base.utc_now() + 1e-3
                return float(found["since"])
            await asyncio.sleep(0.02)


@scene()
async def test_a_servo_that_has_just_started_is_on_as_configured(rig: Rig, servo: Servo) -> None:
    found = await output(rig, servo)
    assert (found["state"], found["reason"], found["by"]) == ("on", "configured", None)
    assert rig.host.base.utc_now() - 30 < found["since"] <= rig.host.base.utc_now()


@scene()
async def test_every_way_to_switch_an_output_is_told_with_its_reason_author_and_time(rig: Rig, servo: Servo) -> None:
    path = f"/servos/{servo.uid}/torque"
    began = rig.host.base.utc_now()
    json(await rig.call("POST", path, {"mode": "off"}))
    assert await becomes(rig, servo, "off", "command", "no lease") >= began
    lease = await rig.lease()
    json(await rig.call("POST", path, {"mode": "on"}, lease=lease))
    await becomes(rig, servo, "on", "command", "test")
    json(await rig.call("POST", path, {"mode": "brake"}, lease=lease))
    await becomes(rig, servo, "brake", "command", "test")
    json(await rig.call("POST", path, {"mode": "on"}, lease=lease))
    await rig.call("DELETE", f"/leases/{lease}")
    since = await becomes(rig, servo, "off", "lease", "test")
    json(await rig.call("POST", "/stop?by=Aki", {"mode": "off"}))
    assert (await output(rig, servo))["since"] == since, "it was off already: stop switched nothing"
    json(await rig.call("POST", "/stop?by=Aki", {"mode": "brake"}))
    await becomes(rig, servo, "brake", "stop", "Aki")


@scene()
async def test_an_expired_lease_and_a_lost_bus_are_told_as_the_end_of_the_lease(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease(ttl_s=0.5)
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    await becomes(rig, servo, "off", "lease", "test")
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    await rig.cable.unplug()
    await asyncio.sleep(0.5)
    rig.cable.plug_in()
    await becomes(rig, servo, "off", "lease", "test", within_s=10)


@scene()
async def test_a_stop_that_meets_a_servo_at_its_start_is_told_as_the_stop(rig: Rig, servo: Servo) -> None:
    json(await rig.call("POST", "/stop?by=Aki"))
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(4)
    assert (await output(rig, servo))["state"] == "unknown"
    rig.bench.power(servo.uid, True)
    await becomes(rig, servo, "off", "stop", "Aki", within_s=10)


@scene()
async def test_another_tool_that_switches_it_is_nobody_known(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).memory.put(0x20, 1)
    await becomes(rig, servo, "off", "command", None)
    rig.sim(servo).memory.put(0x20, 0)
    await becomes(rig, servo, "on", "command", None)


@scene()
async def test_a_restart_makes_it_as_configured_again(rig: Rig, servo: Servo) -> None:
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}))
    await asyncio.sleep(3)
    before = rig.host.base.utc_now()
    json(await rig.call("POST", f"/servos/{servo.uid}/restart?wait=true"))
    assert await becomes(rig, servo, "on", "configured", None) >= before


@pytest.mark.parametrize(("action", "state"), [(1, "off"), (2, "brake")])
@scene()
async def test_the_servos_own_time_out_is_told_when_nobody_commands_it_any_more(
    rig: Rig, servo: Servo, action: int, state: str
) -> None:
    rig.sim(servo).memory.put(0x26, action)
    json(await rig.call("POST", f"/servos/{servo.uid}/identify?wait=true"))  # commands it, and hands it back
    assert (await output(rig, servo))["state"] == "on"
    assert rig.sim(servo).output == 0
    await becomes(rig, servo, state, "timeout", None)
    assert rig.sim(servo).output == action
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "on"}, lease=lease))
    assert (await output(rig, servo))["state"] == "on"
    await asyncio.sleep(3)
    assert (await output(rig, servo))["state"] == "on", "it is kept alive under the lease"
    assert rig.sim(servo).output == 0


@scene()
async def test_there_is_no_time_out_where_it_holds_nor_while_another_tool_commands(rig: Rig, servo: Servo) -> None:
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"timeout_action": "hold"}}))
    json(await rig.call("POST", f"/servos/{servo.uid}/identify?wait=true"))
    await asyncio.sleep(3)
    assert (await output(rig, servo))["state"] == "on"
    json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": {"timeout_action": "off"}}))
    await becomes(rig, servo, "off", "timeout", None)
    pilot = Neighbour(rig.bus.port("pilot"), 90)
    here = round(rig.sim(servo).angle_deg) / 100
    for number in range(20):
        told = ArrayCommand((ActuatorCommand(1, CommandType.POSITION, here),))
        pilot.say(Kind.MESSAGE, told, transfer_id=number)
        await asyncio.sleep(0.1)
    assert (await output(rig, servo))["state"] == "on"
    assert rig.sim(servo).output == 0
    await becomes(rig, servo, "off", "timeout", None)


@scene()
async def test_protection_is_told_for_as_long_as_it_lasts(rig: Rig, servo: Servo) -> None:
    rig.sim(servo).conditions.temperature_c = 110.0
    await becomes(rig, servo, "off", "protection", None)
    assert rig.sim(servo).output == 1
    rig.sim(servo).conditions.temperature_c = 25.0
    await becomes(rig, servo, "on", "configured", None)


@scene()
async def test_an_identified_servo_is_off_for_the_reason_it_was_off_for_before(rig: Rig, servo: Servo) -> None:
    json(await rig.call("POST", "/stop?by=Aki"))
    json(await rig.call("DELETE", "/stop"))
    since = await becomes(rig, servo, "off", "stop", "Aki")
    json(await rig.call("POST", f"/servos/{servo.uid}/identify?wait=true"))
    assert await becomes(rig, servo, "off", "stop", "Aki") == since


@scene()
async def test_a_socket_is_told_at_once(rig: Rig, servo: Servo) -> None:
    socket = Socket(rig.app)
    socket.say(type="subscribe", topics=["servos"])
    await socket.hear("servos")
    json(await rig.call("POST", "/stop?by=Aki"))
    async with asyncio.timeout(1):
        while True:
            told = await socket.hear("servos")
            found = [one["output"] for one in told["servos"] if one["uid"] == servo.uid]
            if found and found[0]["state"] == "off":
                break
    assert (found[0]["reason"], found[0]["by"]) == ("stop", "Aki")
    await socket.close()
