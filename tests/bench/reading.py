"""Reading every parameter, against what the bus allows: bus time on the clock that jumps, and the host's CPU."""

import asyncio
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from behaviour.rig import PLAIN, Rig, play
from hornbill.servo.identification import read_rows

BUS_LIMIT_PER_READ_S = 534e-6
"""One read by name: 534 bits with real stuffing at 1 Mbit/s."""


def figures() -> Iterator[dict[str, Any]]:
    """All rows of one servo and of sixteen, while they stream."""
    for count in (1, 16):

        async def scene(rig: Rig, count: int = count) -> dict[str, Any]:
            servos = await rig.ready(count)
            await rig.host.polling.close()
            rows = sum(len(servo.registers) for servo in servos)
            loop = asyncio.get_running_loop()
            began, cpu = loop.time(), time.process_time()
            await asyncio.gather(*(read_rows(rig.host.asker, servo) for servo in servos))
            took = loop.time() - began
            limit = rows * BUS_LIMIT_PER_READ_S
            return {
                "bench": f"read every parameter of {count}", "rows": rows, "bus_s": round(took, 4),
                "limit_s": round(limit, 4), "ratio": round(took / limit, 3), "must": 1.4 if count > 1 else 1.3,
                "cpu_s_both_sides": round(time.process_time() - cpu, 3),
            }  # fmt: skip

        yield play(scene, *(replace(PLAIN, node_id=10 + n, servo_id=1 + n) for n in range(count)))
