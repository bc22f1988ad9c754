"""Eight hours of a rig's day on the virtual clock: growth of memory between the first hour and the end."""

import asyncio
import gc
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from behaviour.rig import PLAIN, Rig, json, play
from bench.line import line

HOURS = 8.0
WARM_HOURS = 1.0
"""By then every buffer, log and cache is full: telemetry stores ten minutes."""

CYCLE_S = 30.0
CHANNELS = ["current_angle", "current_torque", "current_voltage"]


def figures() -> Iterator[dict[str, Any]]:
    """Memory of the process after one hour and after eight."""
    hours = float(os.environ.get("SOAK_HOURS", HOURS))
    warm = min(WARM_HOURS, hours / 4)
    with tempfile.TemporaryDirectory() as folder:
        began = time.process_time()
        after_one, after_all, cycles = play(lambda rig: _day(rig, hours, warm), PLAIN, store=folder, fast=True)
        took = time.process_time() - began
    grown = after_all - after_one
    figures = {
        "virtual_hours": hours, "cycles": cycles, "kB_after_warm_up": after_one, "kB_at_the_end": after_all,
        "grown_kB": grown, "grown_pct": round(100 * grown / after_one, 2), "cpu_s": round(took),
    }  # fmt: skip
    yield line(
        "8 h of moving, reading, writing and recording on the virtual clock",
        figures,
        of="grown_pct",
        must=3,
        limit="no growth",
    )


async def _day(rig: Rig, hours: float, warm: float) -> tuple[int, int, int]:
    """Move, wait, read everything, change a row, stop and clear, again and again."""
    (servo,) = await rig.ready()
    path = f"/servos/{servo.uid}"
    loop = asyncio.get_running_loop()
    began, at_warm, cycle = loop.time(), 0, 0
    while (now := loop.time() - began) < hours * 3600:
        if not at_warm and now >= warm * 3600:
            at_warm = _memory(rig)
        cycle += 1
        json(await rig.call("PUT", f"{path}/telemetry", {"channels": CHANNELS, "rate_hz": 5, "ttl_s": 60}))
        lease = await rig.lease(ttl_s=20)
        json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
        wanted = {"type": "angle", "value": 30 if cycle % 2 else -30, "wait": "settled"}
        json(await rig.call("POST", f"{path}/command", wanted, lease=lease))
        if cycle % 10 == 0:
            json(await rig.call("GET", f"{path}/parameters?refresh=true"))
            values = {"values": {"angle_p_gain": 40 + cycle // 10 % 5}}
            json(await rig.call("PATCH", f"{path}/parameters", values, lease=lease))
        if cycle % 20 == 0:
            json(await rig.call("POST", "/stop"))
            json(await rig.call("DELETE", "/stop"))
        json(await rig.call("DELETE", f"/leases/{lease}"))
        rig.changes.clear()
        await asyncio.sleep(CYCLE_S)
    return at_warm, _memory(rig), cycle


def _memory(rig: Rig) -> int:
    """Resident kB of the process, without the records of the test rig."""
    rig.changes.clear()
    rig.bus.history.clear()
    gc.collect()
    if sys.platform == "linux":
        status = Path("/proc/self/status").read_text(encoding="ascii")
        return int(next(one for one in status.splitlines() if one.startswith("VmRSS")).split()[1])
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
