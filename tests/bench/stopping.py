"""Stop with twenty servos streaming and a full read going on: bus time until all have answered."""

import asyncio
import statistics
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from behaviour.rig import PLAIN, Rig, json, play
from bench.line import line


def figures() -> Iterator[dict[str, Any]]:
    """Milliseconds from the request to the last of twenty answers, over twenty stops."""

    async def scene(rig: Rig) -> dict[str, Any]:
        servos = await rig.ready(20)
        last: list[float] = []
        for _ in range(20):
            paths = [f"/servos/{servo.uid}/parameters?refresh=true" for servo in servos]
            reading = [asyncio.create_task(rig.call("GET", path)) for path in paths]
            await asyncio.sleep(0.05)
            state = json(await rig.call("POST", "/stop"))
            last.append(max(one["ms"] for one in state["servos"]))
            json(await rig.call("DELETE", "/stop"))
            for task in reading:
                json(await task)
        figures = {"stops": len(last), "ms_median": statistics.median(last), "ms_max": max(last)}
        return line("stop reaches 20 servos during full reads", figures, of="ms_max", must=60)

    yield play(scene, *(replace(PLAIN, node_id=10 + n, servo_id=1 + n) for n in range(20)))
