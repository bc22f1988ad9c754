"""Requests that tests of many subjects send."""

import asyncio
from collections.abc import Iterable
from typing import Any

from behaviour.rig import Rig, json
from hornbill.servo.device.servo import Servo


async def torque(rig: Rig, servo: Servo, mode: str = "on", lease: str | None = None) -> Any:
    """Switch torque; the response."""
    return json(await rig.call("POST", f"/servos/{servo.uid}/torque", {"mode": mode}, lease=lease))


async def move(rig: Rig, servo: Servo, lease: str, angle: float = 20.0, **more: object) -> Any:
    """Command an angle; the response."""
    body = {"type": "angle", "value": angle, **more}
    return json(await rig.call("POST", f"/servos/{servo.uid}/command", body, lease=lease))


async def write(rig: Rig, servo: Servo, lease: str | None = None, **values: object) -> Any:
    """Write parameters to RAM; the response."""
    return json(await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values}, lease=lease))


async def power_cycle(rig: Rig, uid: Any, off_s: float) -> None:
    """Cut the supply of a servo for a while."""
    rig.bench.power(uid, False)
    await asyncio.sleep(off_s)
    rig.bench.power(uid, True)


def by_servo_id(servos: Iterable[Servo]) -> list[Servo]:
    """The servos in the order of their servo IDs."""
    return sorted(servos, key=lambda servo: servo.servo_id or 0)
