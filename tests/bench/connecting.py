"""Connecting and disconnecting the embedded bus, in real time, with six servos streaming: wall time of each cycle."""

import asyncio
import statistics
import time
from collections.abc import Iterator
from typing import Any

from behaviour.rig import CATALOG, Cable
from bench.line import line
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.servo.host import Host, HostSettings
from hornbill.sim.bench.bench import Bench
from hornbill.sim.bench.demo import demo_fleet
from hornbill.store.store import Store
from hornbill.wire.port import CanPort

CYCLES = 200


def figures() -> Iterator[dict[str, Any]]:
    """Milliseconds of a connect and a disconnect, each cycle with received frames in between."""

    async def cycles() -> list[float]:
        bus = MemoryBus()
        cable = Cable(bus)
        store = Store("sqlite://")

        async def open_port(address: str, bitrate: int) -> CanPort:
            port = cable.port(address, bitrate)
            await port.open()
            return port

        host = Host(CATALOG, store, open_port, HostSettings(127, bytes(range(16)), (0, 1)))
        bench = Bench(bus.port, CATALOG)
        for recipe in demo_fleet(CATALOG, 6, 1):
            bench.add(recipe)
        await bench.start()
        took: list[float] = []
        for _ in range(CYCLES):
            began = time.perf_counter()
            connection = await host.connect("memory:host", 1_000_000)
            connected = time.perf_counter() - began
            await asyncio.sleep(0.002)
            assert connection.port.statistics.tx_frames > 0
            began = time.perf_counter()
            await host.disconnect()
            took.append((connected + time.perf_counter() - began) * 1000)
        await host.close()
        await bench.close()
        store.close()
        return took

    took = sorted(asyncio.run(cycles()))
    figures = {
        "cycles": len(took), "ms_median": round(statistics.median(took), 3),
        "ms_p99": round(took[int(len(took) * 0.99)], 3), "ms_max": round(took[-1], 3),
    }  # fmt: skip
    yield line("connect and disconnect", figures, must=50, aim=20, of="ms_max", limit="half the period of a Status")
