"""A guest beside an autopilot that commands 16 servos at 200 Hz: the share of the bus that it takes in addition."""

import asyncio
from collections.abc import Iterator
from typing import Any

from behaviour.rig import Rig, json, play
from behaviour.test_roles import AUTOPILOT, autopilot, connect
from bench.line import line
from hornbill.sim.bench.recipe import Recipe
from hornbill.wire.bittime import frame_bits
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorCommand, ArrayCommand, CommandType

SERVOS, RATE_HZ, SECONDS, BIT_RATE = 16, 200.0, 5.0, 1_000_000
OURS = 127
PER_MESSAGE = 15


def figures() -> Iterator[dict[str, Any]]:
    """Share of the bus while servos are identified, and then with telemetry of all of them requested, %."""
    recipes = [Recipe("BLA21-06U-A0", "1.300", servo_id=one, node_id=one + 20) for one in range(1, SERVOS + 1)]
    yield play(_scene, *recipes, connect=False)


async def _scene(rig: Rig) -> dict[str, Any]:
    ids = range(1, SERVOS + 1)
    commands = [
        ArrayCommand([ActuatorCommand(one, CommandType.UNITLESS, 0.1) for one in ids[start : start + PER_MESSAGE]])
        for start in range(0, SERVOS, PER_MESSAGE)
    ]
    async with autopilot(rig, *commands, rate_hz=RATE_HZ):
        await asyncio.sleep(2)
        before = await _share(rig)
        await connect(rig, "guest")
        identifying = await _share(rig)
        for servo in await rig.ready(SERVOS, within_s=120):
            body = {"channels": ["current_angle", "current_torque"], "rate_hz": 50}
            json(await rig.call("PUT", f"/servos/{servo.uid}/telemetry", body))
        streaming = await _share(rig)
    found = {
        "autopilot_and_servos_pct": round(before[0], 2), "identifying_pct": round(identifying[1], 2),
        "streaming_pct": round(streaming[1], 2), "ratio": round(max(identifying[1], streaming[1]), 2),
    }  # fmt: skip
    name = f"guest beside {SERVOS} servos at {RATE_HZ:.0f} Hz: % of the bus"
    return line(name, found, must=5.0, aim=4.0, limit="what fits on the bus")


async def _share(rig: Rig) -> tuple[float, float]:
    """Bus load in SECONDS, and the part of our frames and of their responses, %."""
    rig.bus.history.clear()
    await asyncio.sleep(SECONDS)
    frames = [frame for _, frame in rig.bus.history]
    assert any(frame.id & 0x7F == AUTOPILOT for frame in frames)
    scale = 100 / (SECONDS * BIT_RATE)
    return sum(map(frame_bits, frames)) * scale, sum(frame_bits(one) for one in frames if _ours(one)) * scale


def _ours(frame: Frame) -> bool:
    """Whether a frame is sent by us, or is a response to us."""
    return frame.id & 0x7F == OURS or (frame.id & 0x80 != 0 and frame.id >> 8 & 0x7F == OURS)
