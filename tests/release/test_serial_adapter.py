"""Six servos behind a real serial port at 115,200 baud, in real time: a pseudo terminal that carries 427 frames/s."""

import asyncio

import pytest

pytest.importorskip("termios", reason="pseudo terminals exist on POSIX only")

from behaviour.rig import CATALOG, PLAIN
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.bus.ports.slcan_lines import line_of
from hornbill.bus.reopening import adapter_port
from hornbill.servo.device.servo import State
from hornbill.servo.host import Host, HostSettings
from hornbill.servo.monitoring.line_budget import FULL, READ_BYTES
from hornbill.servo.monitoring.polling import BUDGET
from hornbill.sim.bench.bench import Bench
from hornbill.sim.bench.recipe import Recipe
from hornbill.store.store import Store
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort
from unit.bus.adapter import FakeAdapter

BAUD = 115_200
SERVOS = 6


def test_six_servos_stay_online_over_a_real_port_at_115200_baud_without_loss() -> None:
    async def main(adapter: FakeAdapter) -> None:
        loop = asyncio.get_running_loop()
        bus = MemoryBus()
        wire = bus.port("adapter")

        def to_computer(frames: list[Frame]) -> None:
            for frame in frames:
                if adapter.is_open:
                    adapter.put(line_of(frame))

        def to_bus(line: bytes) -> None:
            frame = Frame(int(line[1:9], 16), bytes.fromhex(line[10:].decode()))
            loop.call_soon_threadsafe(wire.send, [frame])

        wire.listen(to_computer)
        adapter.on_sent = to_bus
        bench = Bench(bus.port, CATALOG, 1)
        for n in range(1, SERVOS + 1):
            bench.add(Recipe(PLAIN.model, PLAIN.firmware, servo_id=n, node_id=10 + n))
        await bench.start()
        store = Store("sqlite://")

        async def open_port(address: str, bitrate: int) -> CanPort:
            port = adapter_port(address, bitrate)
            await port.open()
            return port

        host = Host(CATALOG, store, open_port, HostSettings(127, bytes(range(16)), (0, 1)))
        try:
            connection = await host.connect(f"slcan:{adapter.channel}", 1_000_000)
            line = connection.port.details.serial_line
            assert line is not None
            assert (line.baud, line.found, line.budget) == (BAUD, True, 426)
            async with asyncio.timeout(30):
                while [one.state for one in host.fleet.all()] != [State.READY] * SERVOS:
                    await asyncio.sleep(0.05)
            statistics = connection.port.statistics
            received, outcomes, began = statistics.line_bytes, host.requests.outcomes.copy(), loop.time()
            for _ in range(50):
                await asyncio.sleep(0.1)
                assert all(servo.online for servo in host.fleet.all())
            took, polled = loop.time() - began, (host.requests.outcomes - outcomes)["poll", "responded"]
            assert (adapter.dropped, statistics.rx_dropped, statistics.errors) == (0, 0, 0)
            assert 0 < polled * READ_BYTES / took <= BUDGET * BAUD / 10 * 1.05
            assert (statistics.line_bytes - received) / took <= FULL * BAUD / 10
        finally:
            await host.close()
            await bench.close()
            store.close()

    with FakeAdapter(baud=BAUD, throttled=True) as adapter:
        asyncio.run(main(adapter))
