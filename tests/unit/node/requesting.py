"""Helpers of the tests of requests: a host and a peer on one bus, and a read request."""

import asyncio
from collections.abc import Callable

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.node.participant import Participant
from hornbill.wire.services import EMPTY, GetSetRequest
from unit.node.peer import Peer, participant


def read(name: str) -> GetSetRequest:
    """A request to read one register."""
    return GetSetRequest(0, EMPTY, name)


def pair(
    *, delay: Callable[[int], float] = lambda _: 0.0, drop: Callable[[int], bool] = lambda _: False, copies: int = 1
) -> tuple[MemoryBus, Participant, Peer]:
    """A started host, and a peer with node ID 42 (see Peer)."""
    bus = MemoryBus()
    host = participant(bus.port("host"))
    peer = Peer(bus.port("peer"), 42, delay=delay, drop=drop, copies=copies)
    host.start()
    return bus, host, peer


def now() -> float:
    """The current instant of the loop."""
    return asyncio.get_running_loop().time()


async def turns(count: int = 3) -> None:
    """Run the loop for `count` iterations, without time passing."""
    for _ in range(count):
        await asyncio.sleep(0)
