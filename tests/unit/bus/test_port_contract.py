"""The contract every CanPort keeps, tried on the embedded bus, python-can's virtual bus and slcan adapters."""

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import dataclass
from itertools import count
from typing import Any

import pytest

from hornbill.bus.address import open_port
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.errors import BusDisconnected
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort, PortState
from jumping_clock import run
from unit.bus.adapter import FakeAdapter

_channels = count()
_terminals: list[str] = []


@dataclass(frozen=True, slots=True)
class Kind:
    """A way to get two ports on one bus, and the loop they live on."""

    run: Callable[[Coroutine[Any, Any, None]], None]
    pair: Callable[[], Awaitable[tuple[CanPort, CanPort]]]


async def memory_pair(*, fast: bool = False) -> tuple[CanPort, CanPort]:
    bus = MemoryBus(fast=fast)
    return bus.port("a"), bus.port("b")


def on_terminals(scenario: Coroutine[Any, Any, None]) -> None:
    with FakeAdapter() as one, FakeAdapter() as other:
        one.neighbour, other.neighbour = other, one
        _terminals[:] = (one.channel, other.channel)
        asyncio.run(scenario)


async def slcan_pair() -> tuple[CanPort, CanPort]:
    one, other = _terminals
    return await open_port(f"slcan:{one}"), await open_port(f"slcan:{other}")


async def virtual_pair() -> tuple[CanPort, CanPort]:
    address = f"virtual:contract-{next(_channels)}"
    return await open_port(address), await open_port(address)


KINDS = {
    "memory in virtual time": Kind(run, memory_pair),
    "memory, fast": Kind(run, lambda: memory_pair(fast=True)),
    "memory in real time": Kind(asyncio.run, memory_pair),
    "python-can": Kind(asyncio.run, virtual_pair),
    "slcan": Kind(on_terminals, slcan_pair),
}


@pytest.fixture(params=KINDS.values(), ids=list(KINDS))
def kind(request: pytest.FixtureRequest) -> Kind:
    return request.param


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(5):
        while not condition():
            await asyncio.sleep(0.002)


def with_ports(kind: Kind, scenario: Callable[[CanPort, CanPort], Coroutine[Any, Any, None]]) -> None:
    async def main() -> None:
        a, b = await kind.pair()
        try:
            await scenario(a, b)
        finally:
            await a.close()
            await b.close()

    kind.run(main())


def test_frames_arrive_whole_in_order_and_stamped(kind: Kind) -> None:
    async def scenario(a: CanPort, b: CanPort) -> None:
        assert (a.state, b.state) == (PortState.ACTIVE, PortState.ACTIVE)
        heard: list[Frame] = []
        own: list[Frame] = []
        a.listen(own.extend)
        b.listen(heard.extend)
        sent = [Frame(0x1234567, bytes([number]) * (number % 9)) for number in range(100)]
        loop = asyncio.get_running_loop()
        began = loop.time()
        a.send(sent)
        await until(lambda: len(heard) == 100)
        assert [(frame.id, frame.data) for frame in heard] == [(frame.id, frame.data) for frame in sent]
        stamps = [frame.at for frame in heard]
        assert stamps == sorted(stamps)
        assert began - 0.05 <= stamps[0]
        assert stamps[-1] <= loop.time()
        assert own == []
        await until(lambda: a.statistics.tx_frames == 100)
        assert a.statistics.rx_frames == 0
        assert b.statistics.rx_frames == 100
        assert b.statistics.rx_dropped == b.statistics.errors == 0

    with_ports(kind, scenario)


def test_one_burst_after_another_arrives(kind: Kind) -> None:
    async def scenario(a: CanPort, b: CanPort) -> None:
        heard: list[int] = []
        b.listen(lambda frames: heard.extend(frame.id for frame in frames))
        for number in range(5):
            a.send([Frame(number, b"")])
            await until(lambda number=number: heard == list(range(number + 1)))

    with_ports(kind, scenario)


def test_the_last_sink_wins_and_is_called_on_the_loop(kind: Kind) -> None:
    async def scenario(a: CanPort, b: CanPort) -> None:
        first: list[Frame] = []
        second: list[object] = []
        b.listen(first.extend)
        b.listen(lambda frames: second.append(asyncio.get_running_loop()))
        a.send([Frame(1, b"")])
        await until(lambda: second)
        assert first == []
        assert second == [asyncio.get_running_loop()]

    with_ports(kind, scenario)


def test_impossible_frames_are_refused_and_nothing_is_sent(kind: Kind) -> None:
    async def scenario(a: CanPort, b: CanPort) -> None:
        heard: list[Frame] = []
        b.listen(heard.extend)
        for impossible in (Frame(0x2000_0000, b""), Frame(1, bytes(9))):
            with pytest.raises(ValueError, match=r"29 bits|8 of a CAN frame"):
                a.send([Frame(1, b"first"), impossible])
        a.send([Frame(2, b"second")])
        await until(lambda: heard)
        assert [frame.data for frame in heard] == [b"second"]

    with_ports(kind, scenario)


def test_after_closing_nothing_is_sent_or_delivered(kind: Kind) -> None:
    async def scenario(a: CanPort, b: CanPort) -> None:
        heard: list[Frame] = []
        a.listen(heard.extend)
        await a.close()
        await a.close()
        assert a.state is PortState.DISCONNECTED
        with pytest.raises(BusDisconnected):
            a.send([Frame(1, b"")])
        b.send([Frame(1, b"")])
        await asyncio.sleep(0.02)
        assert heard == []

    with_ports(kind, scenario)


def test_busy_time_counts_own_and_foreign_frames(kind: Kind) -> None:
    async def scenario(a: CanPort, b: CanPort) -> None:
        a.send([Frame(1, bytes(8))] * 10)
        b.send([Frame(2, bytes(8))] * 10)
        await until(lambda: a.statistics.rx_frames == b.statistics.rx_frames == 10)
        await until(lambda: a.statistics.tx_frames == b.statistics.tx_frames == 10)
        assert a.statistics.busy_s == pytest.approx(b.statistics.busy_s)
        if kind is not KINDS["memory, fast"]:
            assert 20 * 131e-6 <= a.statistics.busy_s <= 20 * 160e-6

    with_ports(kind, scenario)
