"""The tests of what goes wrong on an embedded bus on request."""

import asyncio

import pytest

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.bus.embedded.memory_port import MemoryPort
from hornbill.wire.frame import Frame
from hornbill.wire.port import PortState
from jumping_clock import run

COUNT = 400


async def stream(port: MemoryPort, count: int = COUNT) -> None:
    port.send([Frame(0x100 + number % 7, number.to_bytes(2, "big")) for number in range(count)])
    await asyncio.sleep(1)


def heard_by(port: MemoryPort) -> list[bytes]:
    heard: list[bytes] = []
    port.listen(lambda frames: heard.extend(frame.data for frame in frames))
    return heard


def test_loss_on_the_bus_hits_everybody_and_repeats_with_its_seed() -> None:
    async def main(seed: int) -> tuple[list[bytes], list[bytes]]:
        bus = MemoryBus()
        a, b, c = (bus.port(name) for name in "abc")
        at_b, at_c = heard_by(b), heard_by(c)
        bus.loss(25, seed=seed)
        await stream(a)
        assert a.statistics.tx_frames == COUNT
        assert b.statistics.rx_dropped + b.statistics.rx_frames == COUNT
        assert 0.15 < b.statistics.rx_dropped / COUNT < 0.35
        return at_b, at_c

    at_b, at_c = run(main(3))
    assert at_b == at_c
    assert run(main(3))[0] == at_b
    assert run(main(4))[0] != at_b


def test_loss_at_one_port_hits_that_port_alone_and_can_be_taken_away() -> None:
    async def main() -> None:
        bus = MemoryBus()
        a, b, c = (bus.port(name) for name in "abc")
        bus.loss(50, port=b)
        await stream(a)
        assert 0.4 < b.statistics.rx_dropped / COUNT < 0.6
        assert c.statistics.rx_frames == COUNT
        bus.loss(0, port=b)
        before = b.statistics.rx_frames
        await stream(a)
        assert b.statistics.rx_frames == before + COUNT

    run(main())


@pytest.mark.parametrize("pct", [-1, 100.5])
def test_a_share_outside_0_to_100_is_refused(pct: float) -> None:
    bus = MemoryBus()
    with pytest.raises(ValueError, match=r"outside 0\.\.100 %"):
        bus.loss(pct)
    with pytest.raises(ValueError, match=r"outside 0\.\.100 %"):
        bus.corruption(pct)


def test_corrupted_frames_are_repeated_in_order_and_cost_time() -> None:
    async def main(pct: float) -> tuple[list[bytes], float, int]:
        bus = MemoryBus()
        a, b, c = (bus.port(name) for name in "abc")
        heard = heard_by(b)
        bus.corruption(pct)
        await stream(a)
        assert b.statistics.errors == c.statistics.errors == a.statistics.errors
        assert (
            b.statistics.error_frames == c.statistics.error_frames == a.statistics.error_frames == a.statistics.errors
        )
        assert a.statistics.unacknowledged == 0
        assert a.statistics.tx_frames == b.statistics.rx_frames == COUNT
        assert a.state is PortState.ACTIVE
        return heard, a.statistics.busy_s, a.statistics.errors

    clean, quick, no_errors = run(main(0))
    repeated, slow, errors = run(main(5))
    assert no_errors == 0
    assert repeated == clean
    assert 0 < errors < COUNT * 0.1
    assert slow > quick * (1 + errors / COUNT)


@pytest.mark.parametrize("fast", [False, True])
def test_a_sender_that_always_fails_goes_bus_off_and_recovers_on_request(fast: bool) -> None:
    async def main() -> None:
        bus = MemoryBus(fast=fast)
        a, b = bus.port("a"), bus.port("b")
        bus.corruption(100)
        await stream(a, 10)
        assert a.state is PortState.BUS_OFF
        assert b.state is PortState.ACTIVE
        assert b.statistics.errors == 32  # 8 up for each failure, off above 255
        assert (a.statistics.bus_offs, a.statistics.unacknowledged) == (1, 0)
        bus.corruption(0)
        heard = heard_by(b)
        a.send([Frame(1, b"lost")])
        bus.recover(a)
        assert a.state is PortState.ACTIVE
        a.send([Frame(1, b"sent")])
        await asyncio.sleep(1)
        assert heard == [b"sent"]

    run(main())


def test_bus_off_neither_sends_nor_hears() -> None:
    async def main() -> None:
        bus = MemoryBus(history=10)
        a, b, _ = (bus.port(name) for name in "abc")
        a.send([Frame(1, b""), Frame(2, b"")])
        await asyncio.sleep(1e-6)  # the first is on the wire
        bus.bus_off(a)
        b.send([Frame(3, b"")])
        await asyncio.sleep(1)
        assert [frame.id for _, frame in bus.history] == [1, 3]
        assert a.state is PortState.BUS_OFF
        assert a.statistics.rx_frames == 0
        assert a.statistics.errors == 1

    run(main())


def test_a_mute_port_hears_and_its_frames_vanish() -> None:
    async def main() -> None:
        bus = MemoryBus(history=10)
        a, b = bus.port("a"), bus.port("b")
        a.send([Frame(1, b"")])
        a.mute = True
        a.send([Frame(2, b"")])
        b.send([Frame(3, b"")])
        await asyncio.sleep(1)
        assert [frame.id for _, frame in bus.history] == [3]
        assert (a.statistics.tx_frames, a.statistics.rx_frames) == (2, 1)
        assert bus.load() < 0.001
        a.mute = False
        a.send([Frame(4, b"")])
        await asyncio.sleep(1)
        assert bus.history[-1][1].id == 4

    run(main())


@pytest.mark.parametrize("fast", [False, True])
def test_alone_on_the_bus_a_port_turns_passive_and_keeps_its_frames(fast: bool) -> None:
    async def main() -> None:
        bus = MemoryBus(fast=fast)
        loop = asyncio.get_running_loop()
        a = bus.port("a")
        a.send([Frame(2, b""), Frame(1, b"")])
        await asyncio.sleep(3600)
        assert a.state is PortState.PASSIVE
        assert a.statistics.errors == a.statistics.error_frames == a.statistics.unacknowledged == 16
        assert (a.statistics.tx_frames, a.statistics.bus_offs) == (0, 0)
        b = bus.port("b")
        heard: list[Frame] = []
        b.listen(heard.extend)
        joined = loop.time()
        await asyncio.sleep(1)
        assert [frame.id for frame in heard] == [1, 2]
        assert all(joined <= frame.at < joined + 0.001 for frame in heard)
        assert a.statistics.tx_frames == 2
        await stream(a)
        assert a.state is PortState.ACTIVE

    run(main())


def test_two_ports_with_one_identifier_count_errors_and_both_get_through() -> None:
    async def main() -> None:
        bus = MemoryBus(history=10)
        a, b, c = (bus.port(name) for name in "abc")
        a.send([Frame(7, b"a1"), Frame(7, b"a2")])
        b.send([Frame(7, b"b1")])
        await asyncio.sleep(1)
        assert sorted(frame.data for _, frame in bus.history) == [b"a1", b"a2", b"b1"]
        assert a.statistics.errors == b.statistics.errors > 0
        assert c.statistics.errors == 0

    run(main())


def test_want_of_an_acknowledgement_alone_never_leads_to_bus_off() -> None:
    async def main() -> None:
        bus = MemoryBus()
        a = bus.port("a")
        a.send([Frame(1, b"")])
        await asyncio.sleep(1)
        for _ in range(40):  # each time somebody is there when the frame begins, and gone when it ends
            b = bus.port("b")
            await asyncio.sleep(10e-6)
            await b.close()
            await asyncio.sleep(0.001)
        assert a.statistics.errors == a.statistics.unacknowledged == 16 + 40
        assert a.state is PortState.PASSIVE

    run(main())
