"""Protection as the host shows it: at a limit output stays on, beyond it and during a failure it is off (4.7, 4.12)."""

import asyncio
from dataclasses import replace

import pytest

from behaviour.rig import PLAIN, Rig, json
from behaviour.scene import scene
from hornbill.schema.catalog import Catalog
from hornbill.servo.device.servo import Servo, State

WITHOUT_OUTPUT = [bit.key for bit in Catalog.load().faults if bit.output_off and bit.level == "failure"]

WARM = replace(PLAIN, rom={"temperature_limit_upper": 60, "soft_start": 0, "timeout_action": 0})


@scene(WARM)
async def test_at_its_limit_a_servo_is_ready_and_moves_and_beyond_it_is_protected(rig: Rig, servo: Servo) -> None:
    lease = await rig.lease()
    path = f"/servos/{servo.uid}"
    rig.sim(servo).conditions.temperature_c = 60.0
    await asyncio.sleep(4)
    assert servo.raw("fault_warning") == 1 << 8
    assert (servo.state, servo.output_state.state, rig.sim(servo).output) == (State.READY, "on", 0)
    json(await rig.call("POST", f"{path}/command", {"type": "angle", "value": 10, "wait": "settled"}, lease=lease))
    rig.sim(servo).conditions.temperature_c = 61.0
    await asyncio.sleep(6)
    assert (servo.state, servo.output_state.reason, rig.sim(servo).output) == (State.PROTECTED, "protection", 1)


@pytest.mark.parametrize("failure", WITHOUT_OUTPUT)
@scene(WARM)
async def test_output_is_shown_off_during_each_failure_that_switches_it_off(
    rig: Rig, servo: Servo, failure: str
) -> None:
    path = f"/servos/{servo.uid}/parameters/angle_p_gain"
    assert json(await rig.call("GET", path))["in_effect"] is True
    rig.sim(servo).faults.inject(failure, True)
    await asyncio.sleep(6)
    assert (servo.output_state.reason, rig.sim(servo).output) == ("protection", 1)
    shown = json(await rig.call("GET", path))
    assert (shown["in_effect"], shown["why"]["code"]) == (False, "motor_failure")
    rig.sim(servo).faults.inject(failure, False)
    await asyncio.sleep(6)
    assert servo.output_state.reason == "configured"
