"""The contract of every CanPort, on the embedded bus, python-can's virtual bus and slcan adapters."""

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable, Generator, Iterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager, contextmanager
from functools import partial
from itertools import count

import pytest

from hornbill.bus.address import open_port
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.errors import BusDisconnected
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort, PortState
from unit.bus.adapter import FakeAdapter
from unit.bus.waiting import received_by, until

Opener = Callable[[str], Awaitable[CanPort]]
"""Opens port `a` or `b` of one bus."""

_channels = count()


@contextmanager
def memory(*, fast: bool = False) -> Generator[Opener]:
    bus = MemoryBus(fast=fast)

    async def open_memory(name: str) -> CanPort:
        return bus.port(name)

    yield open_memory


@contextmanager
def virtual() -> Generator[Opener]:
    address = f"virtual:contract-{next(_channels)}"
    yield lambda _name: open_port(address)


@contextmanager
def slcan() -> Generator[Opener]:
    with FakeAdapter() as one, FakeAdapter() as other:
        one.neighbour, other.neighbour = other, one
        channels = {"a": one.channel, "b": other.channel}
        yield lambda name: open_port(f"slcan:{channels[name]}")


FAST = "memory, fast"


@pytest.fixture(
    params=[
        pytest.param(memory, id="memory in virtual time"),
        pytest.param(partial(memory, fast=True), id=FAST),
        pytest.param(memory, id="memory in real time", marks=pytest.mark.real_time),
        pytest.param(virtual, id="python-can", marks=pytest.mark.real_time),
        pytest.param(slcan, id="slcan", marks=pytest.mark.real_time),
    ]
)
def opener(request: pytest.FixtureRequest) -> Iterator[Opener]:
    with request.param() as opener:
        yield opener


@asynccontextmanager
async def opened(opener: Opener, name: str) -> AsyncGenerator[CanPort]:
    port = await opener(name)
    yield port
    await port.close()


@pytest.fixture
def a(opener: Opener) -> AbstractAsyncContextManager[CanPort]:
    return opened(opener, "a")


@pytest.fixture
def b(opener: Opener) -> AbstractAsyncContextManager[CanPort]:
    return opened(opener, "b")


async def test_frames_arrive_whole_in_order_and_stamped(a: CanPort, b: CanPort) -> None:
    assert (a.state, b.state) == (PortState.ACTIVE, PortState.ACTIVE)
    received: list[Frame] = []
    own = received_by(a)
    b.listen(received.extend)
    sent = [Frame(0x1234567, bytes([number]) * (number % 9)) for number in range(100)]
    loop = asyncio.get_running_loop()
    began = loop.time()
    a.send(sent)
    await until(lambda: len(received) == 100)
    assert [(frame.id, frame.data) for frame in received] == [(frame.id, frame.data) for frame in sent]
    stamps = [frame.at for frame in received]
    assert stamps == sorted(stamps)
    assert began - 0.05 <= stamps[0]
    assert stamps[-1] <= loop.time()
    assert own == []
    await until(lambda: a.statistics.tx_frames == 100)
    assert a.statistics.rx_frames == 0
    assert b.statistics.rx_frames == 100
    assert b.statistics.rx_dropped == b.statistics.errors == 0


async def test_only_the_last_sink_is_called_and_on_the_loop(a: CanPort, b: CanPort) -> None:
    first: list[Frame] = []
    second: list[object] = []
    b.listen(first.extend)
    b.listen(lambda frames: second.append(asyncio.get_running_loop()))
    for number in range(1, 4):  # successive bursts
        a.send([Frame(number, b"")])
        await until(lambda number=number: len(second) == number)
    assert first == []
    assert second == [asyncio.get_running_loop()] * 3


async def test_invalid_frames_are_refused_and_nothing_is_sent(a: CanPort, b: CanPort) -> None:
    received = received_by(b)
    for invalid in (Frame(0x2000_0000, b""), Frame(1, bytes(9))):
        with pytest.raises(ValueError, match=r"29 bits|8 of a CAN frame"):
            a.send([Frame(1, b"first"), invalid])
    a.send([Frame(2, b"second")])
    await until(lambda: received)
    assert [frame.data for frame in received] == [b"second"]


async def test_a_closed_port_sends_and_delivers_nothing(a: CanPort, b: CanPort) -> None:
    received = received_by(a)
    await a.close()
    await a.close()
    assert a.state is PortState.DISCONNECTED
    with pytest.raises(BusDisconnected):
        a.send([Frame(1, b"")])
    b.send([Frame(1, b"")])
    await asyncio.sleep(0.02)
    assert received == []


async def test_busy_time_counts_own_and_foreign_frames(a: CanPort, b: CanPort, request: pytest.FixtureRequest) -> None:
    a.send([Frame(1, bytes(8))] * 10)
    b.send([Frame(2, bytes(8))] * 10)
    await until(lambda: a.statistics.rx_frames == b.statistics.rx_frames == 10)
    await until(lambda: a.statistics.tx_frames == b.statistics.tx_frames == 10)
    assert a.statistics.busy_s == pytest.approx(b.statistics.busy_s)
    if FAST not in request.node.name:
        assert 20 * 131e-6 <= a.statistics.busy_s <= 20 * 160e-6
