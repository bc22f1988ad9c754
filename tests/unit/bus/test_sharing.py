"""Several nodes behind one adapter receive the bus and each other, and leave one by one."""

import asyncio

import pytest

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.bus.sharing import SharedBus
from hornbill.errors import BusDisconnected
from hornbill.wire.frame import Frame
from hornbill.wire.port import PortState


async def test_every_node_receives_the_bus_and_its_neighbours_but_not_itself(bus: MemoryBus) -> None:
    outside, shared = bus.port("outside"), SharedBus(bus.port("adapter"))
    a, b = shared.port("a"), shared.port("b")
    received: dict[str, list[Frame]] = {"outside": [], "a": [], "b": []}
    for name, port in (("outside", outside), ("a", a), ("b", b)):
        port.listen(received[name].extend)
    await asyncio.sleep(1.5)
    now = asyncio.get_running_loop().time()
    a.send([Frame(1, b"a")])
    b.send([Frame(2, b"b")])
    outside.send([Frame(3, b"o")])
    await asyncio.sleep(0.01)
    ids = {name: sorted(frame.id for frame in frames) for name, frames in received.items()}
    assert ids == {"outside": [1, 2], "a": [2, 3], "b": [1, 3]}
    assert [frame.at for frame in received["b"] if frame.id == 1] == [now], "stamped when it was sent"
    assert (a.statistics.tx_frames, a.statistics.rx_frames) == (1, 2)


async def test_a_closed_node_neither_receives_nor_sends_while_others_continue(bus: MemoryBus) -> None:
    outside, shared = bus.port("outside"), SharedBus(bus.port("adapter"))
    a, b = shared.port("a"), shared.port("b")
    received: list[str] = []
    a.listen(lambda _frames: received.append("a"))
    b.listen(lambda _frames: received.append("b"))
    await a.close()
    outside.send([Frame(3, b"o")])
    await asyncio.sleep(0.01)
    assert received == ["b"]
    assert (a.state, b.state) == (PortState.DISCONNECTED, PortState.ACTIVE)
    with pytest.raises(BusDisconnected):
        a.send([Frame(1, b"")])
    await shared.close()
    assert b.state is PortState.DISCONNECTED
    with pytest.raises(BusDisconnected):
        b.send([Frame(1, b"")])
