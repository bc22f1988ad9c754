"""Ten million invalid frames to a participant: memory afterwards, and frames per second."""

import asyncio
import gc
import logging
import os
import struct
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

from bench.crowd import HOST, NO_FAULT, CannedPort, Crowd
from bench.line import line
from bench.stack import saturated_mix
from hornbill.node.directory import Directory
from hornbill.node.participant import Participant
from hornbill.schema.catalog import Catalog
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorStatus, AllocationMessage, ArrayCommand, NodeStatus
from hornbill.wire.services import SoftwareVersion
from hornbill.wire.types import BY_KEY

FRAMES = 10_000_000
BURST = 1000
FRAME_S = 1 / 7000
"""A full bus, so that incomplete transfers time out as usual."""

_FRAME = struct.Struct("<I8sB3x")
_PAGE = os.sysconf("SC_PAGE_SIZE")


def figures() -> Iterator[dict[str, Any]]:
    """A third of the frames is random in every bit, a third in its data alone, a third are damaged good ones."""
    yield asyncio.run(_endure())


async def _endure() -> dict[str, Any]:
    logging.getLogger("hornbill").setLevel(logging.ERROR)
    now = 1000.0
    port = CannedPort(Crowd(Catalog.load(), 1, NO_FAULT))
    host = Participant(
        port, node_id=HOST, name="org.hornbill", unique_id=bytes(16), software_version=SoftwareVersion(0, 1),
        clock=lambda: now,
    )  # fmt: skip
    received = 0

    def receive(_transfer: object, _message: object) -> None:
        nonlocal received
        received += 1

    Directory().follow(host)
    for message in (NodeStatus, ActuatorStatus, AllocationMessage, ArrayCommand):
        host.subscribe(message, receive)
    host.start()
    spent, samples = 0.0, list[tuple[int, int]]()
    for done, frames in enumerate(_invalid(Random(1)), 1):
        now = frames[-1].at
        began = time.process_time()
        port.sink(frames)
        spent += time.process_time() - began
        if done % (FRAMES // BURST // 20) == 0:
            await asyncio.sleep(0)  # the timers of the participant have their turn
            gc.collect()
            samples.append((_rss(), sys.getallocatedblocks()))
    await host.close()
    counters = host.reassembly_counters
    assert counters.frames == FRAMES
    half = len(samples) // 2
    rss, blocks = (max(row[half:]) - max(row[:half]) for row in zip(*samples, strict=True))
    figures = {
        "frames": FRAMES, "frames_per_s": round(FRAMES / spent), "transfers": counters.transfers, "received": received,
        "bad_crc": counters.bad_crc, "evicted": counters.evicted, "timed_out": counters.timed_out,
        "rss_mb": round(samples[-1][0] / 1e6, 1), "grown_kb": round(rss / 1000, 1), "grown_blocks": blocks,
    }  # fmt: skip
    return line(
        "10 million invalid frames: memory of the second half",
        figures,
        of="grown_kb",
        must=1000,
        aim=300,
        limit="no growth",
    )


def _invalid(chance: Random) -> Iterator[list[Frame]]:
    good = saturated_mix(1)
    known = [
        (priority << 24 | type_id << 16 | HOST << 8 | 0x80 if service else priority << 24 | type_id << 8) | source
        for service, type_id in BY_KEY
        for priority in range(32)
        for source in range(1, 127)
    ]
    at: float = 1000.0
    place: int = 0
    for _ in range(FRAMES // BURST):
        burst: list[Frame] = []
        parts: Iterator[tuple[int, bytes, int]] = _FRAME.iter_unpack(chance.randbytes(_FRAME.size * BURST))
        for word, data, length in parts:
            at += FRAME_S
            match word % 3:
                case 0:
                    burst.append(Frame(word & 0x1FFF_FFFF, data[: length % 9], at))
                case 1:
                    burst.append(Frame(known[word % len(known)], data[: length % 9], at))
                case _:
                    place = (place + 1 + (length % 16 == 0)) % len(good)  # one in sixteen is lost, one in five cut
                    frame = good[place]
                    burst.append(Frame(frame.id, frame.data[: 8 if length < 200 else length % 9], at))
        yield burst


def _rss() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * _PAGE
