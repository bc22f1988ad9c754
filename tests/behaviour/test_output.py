"""Output of a servo as session state: on or off, why, by whom, since when (sections 4.7, 4.13, 4.19)."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from behaviour.actions import torque, write
from behaviour.neighbour import Neighbour
from behaviour.rig import PLAIN, Rig, Socket, json, problem, until
from behaviour.scene import scene
from hornbill.servo.device.servo import Servo
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import ActuatorCommand, ArrayCommand, CommandType


async def output(rig: Rig, servo: Servo) -> Any:
    return json(await rig.call("GET", f"/servos/{servo.uid}"))["output"]


async def becomes(
    rig: Rig, servo: Servo, state: str, reason: str, by: str | None = None, within_s: float = 3.0
) -> float:
    """Wait for this output; since when it is so."""
    async with asyncio.timeout(within_s):
        while True:
            found = await output(rig, servo)
            if (found["state"], found["reason"], found["by"]) == (state, reason, by):
                assert found["since"] <= rig.host.base.utc_now() + 1e-3
                return float(found["since"])
            await asyncio.sleep(0.02)


async def stop(rig: Rig, mode: str = "off") -> None:
    json(await rig.call("POST", "/stop?by=Aki", {"mode": mode}))


async def identify(rig: Rig, servo: Servo) -> None:
    """Command a servo, and return it to how it was."""
    json(await rig.call("POST", f"/servos/{servo.uid}/identify?wait=true"))


@scene()
async def test_a_started_servo_is_on_as_configured_also_after_a_restart(rig: Rig, servo: Servo) -> None:
    found = await output(rig, servo)
    assert (found["state"], found["reason"], found["by"]) == ("on", "configured", None)
    assert rig.host.base.utc_now() - 30 < found["since"] <= rig.host.base.utc_now()
    await torque(rig, servo, "off")
    await asyncio.sleep(3)
    before = rig.host.base.utc_now()
    json(await rig.call("POST", f"/servos/{servo.uid}/restart?wait=true"))
    assert await becomes(rig, servo, "on", "configured") >= before


@scene()
async def test_every_cause_is_reported_with_its_author_and_time(rig: Rig, servo: Servo) -> None:
    began = rig.host.base.utc_now()
    await torque(rig, servo, "off")
    assert await becomes(rig, servo, "off", "command", "no lease") >= began
    lease = await rig.lease()
    await torque(rig, servo, "on", lease)
    await becomes(rig, servo, "on", "command", "test")
    await torque(rig, servo, "brake", lease)
    await becomes(rig, servo, "brake", "command", "test")
    await torque(rig, servo, "on", lease)
    await rig.call("DELETE", f"/leases/{lease}")
    since = await becomes(rig, servo, "off", "lease", "test")
    await stop(rig)
    assert (await output(rig, servo))["since"] == since, "it was off already, so stop switched nothing"
    await stop(rig, "brake")
    await becomes(rig, servo, "brake", "stop", "Aki")


@scene()
async def test_an_expired_lease_and_a_lost_bus_are_reported_as_the_end_of_the_lease(rig: Rig, servo: Servo) -> None:
    await torque(rig, servo, "on", await rig.lease(ttl_s=0.5))
    await becomes(rig, servo, "off", "lease", "test")
    await torque(rig, servo, "on", await rig.lease())
    await rig.cable.unplug()
    await asyncio.sleep(0.5)
    rig.cable.plug_in()
    await becomes(rig, servo, "off", "lease", "test", within_s=10)


@pytest.mark.parametrize(("action", "state"), [(1, "off"), (2, "brake")])
@scene()
async def test_the_timeout_of_the_servo_is_reported_when_its_commands_end(
    rig: Rig, servo: Servo, action: int, state: str
) -> None:
    rig.sim(servo).memory.put(0x26, action)
    await identify(rig, servo)
    assert (await output(rig, servo))["state"] == "on"
    assert rig.sim(servo).output == 0
    await becomes(rig, servo, state, "timeout")
    assert rig.sim(servo).output == action
    await torque(rig, servo, "on", await rig.lease())
    assert (await output(rig, servo))["state"] == "on"
    await asyncio.sleep(3)
    assert (await output(rig, servo))["state"] == "on", "commands are repeated under the lease"
    assert rig.sim(servo).output == 0


@scene()
async def test_no_timeout_is_reported_if_the_servo_holds_or_another_tool_commands_it(rig: Rig, servo: Servo) -> None:
    await write(rig, servo, timeout_action="hold")
    await identify(rig, servo)
    await asyncio.sleep(3)
    assert (await output(rig, servo))["state"] == "on"
    await write(rig, servo, timeout_action="off")
    await becomes(rig, servo, "off", "timeout")
    autopilot = Neighbour(rig.bus.port("autopilot"), 90)
    command = ArrayCommand((ActuatorCommand(1, CommandType.POSITION, round(rig.sim(servo).angle_deg) / 100),))
    for number in range(20):
        autopilot.send(Kind.MESSAGE, command, transfer_id=number)
        await asyncio.sleep(0.1)
    assert (await output(rig, servo))["state"] == "on"
    assert rig.sim(servo).output == 0
    await becomes(rig, servo, "off", "timeout")


@scene()
async def test_protection_is_reported_while_it_lasts_and_torque_switched_by_another_tool_without_author(
    rig: Rig, servo: Servo
) -> None:
    rig.sim(servo).conditions.temperature_c = 110.0
    await becomes(rig, servo, "off", "protection")
    assert rig.sim(servo).output == 1
    rig.sim(servo).conditions.temperature_c = 25.0
    await becomes(rig, servo, "on", "configured")
    for raw, state in ((1, "off"), (0, "on")):
        rig.sim(servo).memory.put(0x20, raw)
        await becomes(rig, servo, state, "command")


@scene()
async def test_stop_is_published_at_once_and_remains_the_reason_after_identify_and_a_start(
    rig: Rig, servo: Servo
) -> None:
    socket = Socket(rig.app)
    socket.send(type="subscribe", topics=["servos"])
    await socket.receive("servos")
    await stop(rig)
    async with asyncio.timeout(1):
        found: Any = {"state": None}
        while found["state"] != "off":
            (found,) = [one["output"] for one in (await socket.receive("servos"))["servos"]]
    assert (found["reason"], found["by"]) == ("stop", "Aki")
    await socket.close()
    json(await rig.call("DELETE", "/stop"))
    since = await becomes(rig, servo, "off", "stop", "Aki")
    await identify(rig, servo)
    assert await becomes(rig, servo, "off", "stop", "Aki") == since
    await stop(rig)
    rig.bench.power(servo.uid, False)
    await asyncio.sleep(4)
    assert (await output(rig, servo))["state"] == "unknown"
    rig.bench.power(servo.uid, True)
    await becomes(rig, servo, "off", "stop", "Aki", within_s=10)


@pytest.mark.parametrize("key", ["torque_mode", "timeout_action", "timeout_time"])
@scene(replace(PLAIN, rom={"soft_start": 0, "timeout_action": 1}))
async def test_an_output_is_unknown_while_a_row_that_decides_it_cannot_be_read(
    rig: Rig, servo: Servo, key: str
) -> None:
    path, sim = f"/servos/{servo.uid}/parameters?refresh=true", rig.sim(servo)
    await identify(rig, servo)
    sim.conditions.refuse_keys.add(key)
    assert json(await rig.call("GET", path))["parameters"][key]["stale"]
    await until(lambda: sim.output == 1)
    await until(lambda: servo.output_state.state == "unknown", within_s=0.5)
    sim.conditions.refuse_keys.clear()
    json(await rig.call("GET", path))
    await becomes(rig, servo, "off", "timeout")


@scene(replace(PLAIN, rom={"soft_start": 0, "timeout_action": 1}))
async def test_a_refused_torque_command_does_not_end_a_timeout(rig: Rig, servo: Servo) -> None:
    await identify(rig, servo)
    await becomes(rig, servo, "off", "timeout")
    sim = rig.sim(servo)
    sim.conditions.refuse_keys.add("torque_mode")
    problem(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": "off"}), "refused_by_servo", 502)
    assert (await output(rig, servo))["state"] == "unknown"
    rig.host.torque_off.cancel_all()
    sim.conditions.refuse_keys.clear()
    await becomes(rig, servo, "off", "timeout", within_s=1.5)
    assert sim.output == 1
