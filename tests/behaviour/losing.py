"""Ways to lose and restore a bus, and servos that keep their last command."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace

import pytest

from behaviour.rig import Rig, json
from hornbill.servo.device.servo import Servo
from hornbill.sim.bench.recipe import Recipe

HOLDING = Recipe("BLA21-06U-A0", "1.300", servo_id=1, node_id=11, rom={"timeout_action": 0})
"""It keeps its last command indefinitely."""

THREE = [replace(HOLDING, servo_id=n, node_id=10 + n) for n in (1, 2, 3)]
PAIR = THREE[:2]
"""Servos acknowledge each other's frames while the host is away."""

WITHOUT_ID = replace(HOLDING, servo_id=9, node_id=0)

Loss = Callable[[Rig], Awaitable[object]]


async def unplugged(rig: Rig) -> None:
    await rig.cable.unplug()


async def off_the_bus(rig: Rig) -> None:
    rig.cable.bus_off()


each_loss = pytest.mark.parametrize("lose", [unplugged, off_the_bus])
"""Off the bus, an embedded controller stays so until it is opened again."""


async def back(rig: Rig, within_s: float = 10.0) -> None:
    """Put the adapter back and wait until it is open."""
    rig.cable.plug_in()
    async with asyncio.timeout(within_s):
        while rig.host.watch.gone or json(await rig.call("GET", "/bus"))["state"] != "active":
            await asyncio.sleep(0.01)


async def commanded(rig: Rig, servo: Servo, angle: float = 20.0) -> str:
    """The lease under which a servo has been commanded."""
    lease = await rig.lease()
    json(await rig.call("POST", f"/servos/{servo.uid}/command", {"type": "angle", "value": angle}, lease=lease))
    return lease


def now() -> float:
    return asyncio.get_running_loop().time()
