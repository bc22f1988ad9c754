"""The tests of MemoryBus in virtual time: arbitration, bit times, delivery, load."""

import asyncio
from itertools import pairwise
from random import Random

import pytest

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.errors import BusDisconnected
from hornbill.wire.bittime import frame_bits
from hornbill.wire.frame import Frame
from hornbill.wire.port import PortState
from jumping_clock import START, run

BIT = 1e-6


def ms(milliseconds: float) -> float:
    return pytest.approx(milliseconds * 1e-3, rel=0.02)  # pyright: ignore[reportReturnType]


def test_a_frame_arrives_at_the_instant_of_its_last_bit() -> None:
    async def main() -> None:
        bus = MemoryBus()
        a, b, c = (bus.port(name) for name in "abc")
        heard: list[tuple[str, float, list[Frame]]] = []
        loop = asyncio.get_running_loop()
        for port in (a, b, c):
            port.listen(lambda frames, name=port.name: heard.append((name, loop.time(), frames)))
        frame = Frame(0x1801557F, b"\x01\x02\x03")
        a.send([frame])
        await asyncio.sleep(0.01)
        at = START + (frame_bits(frame) - 3) * BIT
        stamped = Frame(frame.id, frame.data, at)
        assert heard == [("b", at, [stamped]), ("c", at, [stamped])]
        assert (a.statistics.tx_frames, a.statistics.rx_frames) == (1, 0)
        assert (b.statistics.tx_frames, b.statistics.rx_frames) == (0, 1)
        for port in (a, b, c):
            assert port.statistics.busy_s == pytest.approx(frame_bits(frame) * BIT)

    run(main())


def test_the_lowest_identifier_wins_whoever_queued_first() -> None:
    async def main() -> None:
        bus = MemoryBus(history=100)
        a, b, c = (bus.port(name) for name in "abc")
        a.send([Frame(30, b"1"), Frame(30, b"2"), Frame(10, b"3")])
        b.send([Frame(20, b"4"), Frame(5, b"5")])
        await asyncio.sleep(0)
        c.send([Frame(25, b"6")])  # the same instant, some turns of the loop later
        await asyncio.sleep(1)
        assert [(name, frame.id, frame.data) for name, frame in bus.history] == [
            ("b", 5, b"5"),
            ("a", 10, b"3"),
            ("b", 20, b"4"),
            ("c", 25, b"6"),
            ("a", 30, b"1"),
            ("a", 30, b"2"),
        ]
        ends = [frame.at for _, frame in bus.history]
        bits = [frame_bits(frame) for _, frame in bus.history]
        assert [b - a for a, b in pairwise(ends)] == pytest.approx([count * BIT for count in bits[1:]], abs=1e-12)

    run(main())


def test_a_frame_on_the_wire_is_not_interrupted() -> None:
    async def main() -> None:
        bus = MemoryBus(history=10)
        a, b, _ = (bus.port(name) for name in "abc")
        a.send([Frame(100, bytes(8)), Frame(100, bytes(8))])
        await asyncio.sleep(1 * BIT)
        b.send([Frame(1, b"")])
        await asyncio.sleep(1)
        assert [name for name, _ in bus.history] == ["a", "b", "a"]

    run(main())


def test_a_late_winner_that_is_shorter_is_delivered_on_time() -> None:
    async def main() -> None:
        bus = MemoryBus()
        a, b, c = (bus.port(name) for name in "abc")
        seen: list[float] = []
        c.listen(lambda frames: seen.append(asyncio.get_running_loop().time()))
        a.send([Frame(100, bytes(8))])  # the alarm is set for this one
        b.send([Frame(1, b"")])
        await asyncio.sleep(1)
        first = (frame_bits(Frame(1, b"")) - 3) * BIT
        assert seen[0] == pytest.approx(START + first, abs=1e-12)

    run(main())


def test_who_answers_at_once_answers_after_the_interframe_space() -> None:
    async def main() -> None:
        bus = MemoryBus(history=2)
        a, b = bus.port("a"), bus.port("b")
        b.listen(lambda frames: b.send([Frame(0, b"")]))
        a.send([Frame(9, b"?")])
        await asyncio.sleep(1)
        (_, asked), (_, answered) = bus.history
        assert answered.at - asked.at == pytest.approx(frame_bits(answered) * BIT, abs=1e-12)

    run(main())


def test_55_reads_by_name_take_29_ms() -> None:
    random = Random(55)

    def answer(index: int) -> list[Frame]:
        value = random.randrange(-1800, 1800).to_bytes(8, "little", signed=True)
        payload = random.randbytes(2) + b"\x01" + value + bytes(3) + b"0x%02X" % index
        identifier, turn = 0x180B_0195 | 24 << 24, index & 31
        return [
            Frame(identifier, payload[:7] + bytes([0x80 | turn])),
            Frame(identifier, payload[7:14] + bytes([0x20 | turn])),
            Frame(identifier, payload[14:] + bytes([0x40 | turn])),
        ]

    async def main() -> float:
        bus = MemoryBus()
        host, servo = bus.port("host"), bus.port("servo")
        loop = asyncio.get_running_loop()
        answered = asyncio.Event()
        index = 0
        servo.listen(lambda frames: servo.send(answer(index)))
        host.listen(lambda frames: answered.set() if frames[-1].data[-1] & 0x40 else None)
        for index in range(55):
            answered.clear()
            host.send([Frame(0x180B_9501 | 24 << 24, b"\0\0" + b"0x%02X" % index + bytes([0xC0 | index & 31]))])
            await answered.wait()
        assert bus.load() == ms(29.4)
        return loop.time() - START

    assert run(main()) == ms(29.4)


def test_load_is_the_busy_share_of_the_last_second() -> None:
    async def main() -> None:
        bus = MemoryBus()
        assert bus.load() == 0
        a, _ = bus.port("a"), bus.port("b")
        frame = Frame(0x155, b"\x55" * 8)
        for _ in range(500):
            a.send([frame])
            await asyncio.sleep(0.002)
        assert bus.load() == pytest.approx(500 * frame_bits(frame) * BIT, rel=0.01)
        await asyncio.sleep(0.5)
        assert bus.load() == pytest.approx(250 * frame_bits(frame) * BIT, rel=0.01)
        await asyncio.sleep(0.5)
        assert bus.load() == 0

    run(main())


def test_a_slower_bus_takes_longer() -> None:
    async def main(bitrate: int) -> float:
        bus = MemoryBus(bitrate=bitrate, history=1)
        a, _ = bus.port("a"), bus.port("b")
        assert a.bitrate == bitrate
        a.send([Frame(1, b"")])
        await asyncio.sleep(1)
        return bus.history[0][1].at - START

    assert run(main(125_000)) == pytest.approx(8 * run(main(1_000_000)))


def test_fast_leaves_out_the_bit_times_but_not_the_order() -> None:
    async def main() -> None:
        bus = MemoryBus(fast=True, history=10)
        a, b = bus.port("a"), bus.port("b")
        b.listen(lambda frames: b.send([Frame(1, b"!")]) if frames[-1].id == 7 else None)
        a.send([Frame(7, b""), Frame(3, b"")])
        for _ in range(6):
            await asyncio.sleep(0)
        assert [frame for _, frame in bus.history] == [
            Frame(3, b"", START),
            Frame(7, b"", START),
            Frame(1, b"!", START),
        ]
        assert bus.load() == 0

    run(main())


def test_a_full_queue_drops_the_least_urgent_and_counts_it() -> None:
    async def main() -> None:
        bus = MemoryBus(queue_limit=4, history=10)
        a, _ = bus.port("a"), bus.port("b")
        a.send([Frame(9, bytes([n])) for n in range(6)] + [Frame(1, b"stop")])
        assert a.statistics.errors == 3
        await asyncio.sleep(1)
        assert [frame.data for _, frame in bus.history] == [b"stop", b"\0", b"\1", b"\2"]

    run(main())


def test_a_closed_port_is_gone_and_its_name_is_free() -> None:
    async def main() -> None:
        bus = MemoryBus(history=10)
        a, b = bus.port("a"), bus.port("b")
        with pytest.raises(ValueError, match="already has an open port 'a'"):
            bus.port("a")
        a.send([Frame(1, b""), Frame(2, b"")])
        await asyncio.sleep(BIT)
        await a.close()
        await a.close()
        assert a.state is PortState.DISCONNECTED
        with pytest.raises(BusDisconnected):
            a.send([])
        await asyncio.sleep(1)
        assert [frame.id for _, frame in bus.history] == [1]  # was on the wire already
        assert b.statistics.rx_frames == 1
        assert bus.port("a").address == "memory:a"

    run(main())


def test_a_sink_that_raises_costs_nobody_else_a_frame() -> None:
    async def main() -> None:
        bus = MemoryBus()
        a, b, c = (bus.port(name) for name in "abc")
        heard: list[Frame] = []
        raised: list[object] = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: raised.append(context["exception"]))
        b.listen(lambda frames: print(frames[9]))
        c.listen(heard.extend)
        a.send([Frame(1, b""), Frame(2, b"")])
        await asyncio.sleep(1)
        assert [frame.id for frame in heard] == [1, 2]
        assert [type(error) for error in raised] == [IndexError, IndexError]

    run(main())
