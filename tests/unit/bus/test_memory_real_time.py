"""MemoryBus in real time: exact timestamps and few wake-ups."""

import asyncio
from itertools import pairwise

import pytest

from hornbill.bus.embedded.memory import COALESCE_S, MemoryBus
from hornbill.bus.embedded.memory_port import MemoryPort
from hornbill.wire.bittime import frame_bits
from hornbill.wire.frame import Frame

pytestmark = pytest.mark.real_time


async def test_a_burst_has_exact_timestamps_and_is_delivered_in_batches(a: MemoryPort, b: MemoryPort) -> None:
    loop = asyncio.get_running_loop()
    batches: list[tuple[float, list[Frame]]] = []
    b.listen(lambda frames: batches.append((loop.time(), frames)))
    sent = [Frame(0x18000000 + number, number.to_bytes(8, "big")) for number in range(300)]
    before = loop.time()
    a.send(sent)
    after = loop.time()
    turns = [after]
    while b.statistics.rx_frames < 300:
        await asyncio.sleep(0.002)
        turns.append(loop.time())
    stall = max(later - earlier for earlier, later in pairwise(turns))
    received = [frame for _, batch in batches for frame in batch]
    assert [(frame.id, frame.data) for frame in received] == [(frame.id, frame.data) for frame in sent]
    first = (frame_bits(sent[0]) - 3) * 1e-6
    assert before + first <= received[0].at <= after + first
    for earlier, later in pairwise(received):
        assert later.at - earlier.at == pytest.approx(frame_bits(later) * 1e-6, abs=1e-9)
    limit = 2 * stall + 3 * COALESCE_S  # of the delay: the loop may stall before the timer is due, and after
    assert all(frame.at <= when <= frame.at + limit for when, batch in batches for frame in batch)
    assert len(batches) <= (loop.time() - before) / COALESCE_S + 1


async def test_a_frame_queued_late_competes_late_even_if_the_loop_was_busy(
    bus: MemoryBus, a: MemoryPort, b: MemoryPort
) -> None:
    loop = asyncio.get_running_loop()
    a.send([Frame(100, bytes(8)) for _ in range(30)])
    began = loop.time()
    while loop.time() < began + 0.0015:
        pass  # the loop is busy, the bus is not
    queued = loop.time()
    b.send([Frame(1, b"")])
    sent = loop.time()
    while a.statistics.tx_frames + b.statistics.tx_frames < 31:
        await asyncio.sleep(0.002)
    urgent = next(frame for _, frame in bus.history if frame.id == 1)
    bits = frame_bits(Frame(100, bytes(8))) + frame_bits(urgent)
    assert queued < urgent.at <= sent + bits * 1e-6
    assert sum(frame.at < queued for _, frame in bus.history) >= 8
