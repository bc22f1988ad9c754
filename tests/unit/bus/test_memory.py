"""MemoryBus in virtual time: arbitration, bit times, delivery, load, loss, bus-off, noise and other bit rates."""

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.bus.embedded.memory_port import MemoryPort
from hornbill.errors import BusDisconnected
from hornbill.wire.bittime import NOISE_BITS, frame_bits
from hornbill.wire.frame import Frame
from hornbill.wire.port import PortState
from jumping_clock import START, Deadlock, run

BIT = 1e-6


def received_by(port: MemoryPort) -> list[bytes]:
    received: list[bytes] = []
    port.listen(lambda frames: received.extend(frame.data for frame in frames))
    return received


def arbitrated(sent: list[tuple[float, str, Frame]]) -> list[tuple[str, Frame]]:
    """What a bus carries of frames queued at these bit times: whenever it is idle, the lowest identifier wins."""
    carried: list[tuple[str, Frame]] = []
    idle_at, waiting = 0.0, sorted(sent, key=lambda each: each[0])
    while waiting:
        idle_at = max(idle_at, waiting[0][0])
        winner = min((each for each in waiting if each[0] <= idle_at), key=lambda each: each[2].id)
        waiting.remove(winner)
        idle_at += frame_bits(winner[2])
        carried.append((winner[1], winner[2]._replace(at=START + (idle_at - 3) * BIT)))
    return carried


queued = st.tuples(st.integers(0, 600), st.integers(0, 5), st.binary(max_size=8))


@given(st.lists(queued, max_size=12))
def test_the_lowest_queued_identifier_wins_whenever_the_bus_is_idle(queued: list[tuple[int, int, bytes]]) -> None:
    # Fractions of a bit, so that no frame is queued just as another ends: floats would decide who is first.
    instants = sorted({at for at, _, _ in queued})
    sent = sorted((at + instants.index(at) / 16, "abc"[number % 3], Frame(number, data)) for at, number, data in queued)

    async def main() -> None:
        bus, loop = MemoryBus(history=100), asyncio.get_running_loop()
        ports = {name: bus.port(name) for name in "abcd"}
        arrived: list[Frame] = []
        ports["d"].listen(lambda frames: arrived.extend(frame for frame in frames if frame.at == loop.time()))
        for at, name, frame in sent:  # those of one instant in successive iterations of the loop
            await asyncio.sleep(START + at * BIT - loop.time())
            ports[name].send([frame])
        await asyncio.sleep(1)
        expected = arbitrated(sent)
        assert [(name, frame[:2]) for name, frame in bus.history] == [(name, frame[:2]) for name, frame in expected]
        ends = [frame.at for _, frame in expected]
        assert [frame.at for frame in arrived] == pytest.approx(ends, abs=1e-9), "each is delivered with its last bit"

    run(main())


async def test_an_immediate_response_follows_after_the_interframe_space(
    bus: MemoryBus, a: MemoryPort, b: MemoryPort
) -> None:
    b.listen(lambda frames: b.send([Frame(0, b"")]))
    a.send([Frame(9, b"?")])
    await asyncio.sleep(1)
    (_, request), (_, response) = bus.history
    assert response.at - request.at == pytest.approx(frame_bits(response) * BIT, abs=1e-12)


async def test_load_is_the_busy_share_of_the_last_second(bus: MemoryBus, a: MemoryPort, b: MemoryPort) -> None:
    assert bus.load() == 0
    frame = Frame(0x155, b"\x55" * 8)
    for _ in range(500):
        a.send([frame])
        await asyncio.sleep(0.002)
    assert bus.load() == pytest.approx(500 * frame_bits(frame) * BIT, rel=0.01)
    await asyncio.sleep(0.5)
    assert bus.load() == pytest.approx(250 * frame_bits(frame) * BIT, rel=0.01)
    await asyncio.sleep(0.5)
    assert bus.load() == 0


def test_a_slower_bus_takes_longer() -> None:
    async def main(bitrate: int) -> float:
        bus = MemoryBus(bitrate=bitrate, history=1)
        a, _ = bus.port("a"), bus.port("b")
        assert a.bitrate == bitrate
        a.send([Frame(1, b"")])
        await asyncio.sleep(1)
        return bus.history[0][1].at - START

    assert run(main(125_000)) == pytest.approx(8 * run(main(1_000_000)))


async def test_a_fast_bus_has_no_bit_times_but_arbitration() -> None:
    bus = MemoryBus(fast=True, history=10)
    a, b = bus.port("a"), bus.port("b")
    b.listen(lambda frames: b.send([Frame(1, b"!")]) if frames[-1].id == 7 else None)
    a.send([Frame(7, b""), Frame(3, b"")])
    for _ in range(6):
        await asyncio.sleep(0)
    assert [frame for _, frame in bus.history] == [
        Frame(3, b"", START), Frame(7, b"", START), Frame(1, b"!", START),
    ]  # fmt: skip
    assert bus.load() == 0


async def test_a_full_queue_drops_the_least_urgent_and_counts_it() -> None:
    bus = MemoryBus(queue_limit=4, history=10)
    a, _ = bus.port("a"), bus.port("b")
    a.send([Frame(9, bytes([n])) for n in range(6)] + [Frame(1, b"stop")])
    assert a.statistics.errors == 3
    await asyncio.sleep(1)
    assert [frame.data for _, frame in bus.history] == [b"stop", b"\0", b"\1", b"\2"]


async def test_a_closed_port_is_disconnected_and_its_name_reusable(
    bus: MemoryBus, a: MemoryPort, b: MemoryPort
) -> None:
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
    assert [frame.id for _, frame in bus.history] == [1]  # already on the wire
    assert b.statistics.rx_frames == 1
    assert bus.port("a").address == "memory:a"


async def test_a_raising_sink_does_not_affect_other_ports(a: MemoryPort, b: MemoryPort, c: MemoryPort) -> None:
    received: list[Frame] = []
    raised: list[object] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: raised.append(context["exception"]))
    b.listen(lambda frames: print(frames[9]))
    c.listen(received.extend)
    a.send([Frame(1, b""), Frame(2, b"")])
    await asyncio.sleep(1)
    assert [frame.id for frame in received] == [1, 2]
    assert [type(error) for error in raised] == [IndexError, IndexError]


COUNT = 400


async def stream(port: MemoryPort, count: int = COUNT) -> None:
    port.send([Frame(0x100 + number % 7, number.to_bytes(2, "big")) for number in range(count)])
    await asyncio.sleep(1)


def test_loss_on_the_bus_affects_all_ports_and_repeats_with_its_seed() -> None:
    async def main(seed: int) -> tuple[list[bytes], list[bytes]]:
        bus = MemoryBus()
        a, b, c = (bus.port(name) for name in "abc")
        at_b, at_c = received_by(b), received_by(c)
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


async def test_loss_at_one_port_affects_only_that_port_and_can_be_ended(
    bus: MemoryBus, a: MemoryPort, b: MemoryPort, c: MemoryPort
) -> None:
    bus.loss(50, port=b)
    await stream(a)
    assert 0.4 < b.statistics.rx_dropped / COUNT < 0.6
    assert c.statistics.rx_frames == COUNT
    bus.loss(0, port=b)
    before = b.statistics.rx_frames
    await stream(a)
    assert b.statistics.rx_frames == before + COUNT


@pytest.mark.parametrize("pct", [-1, 100.5])
def test_a_share_outside_0_to_100_is_refused(pct: float) -> None:
    bus = MemoryBus()
    with pytest.raises(ValueError, match=r"outside 0 to 100 %"):
        bus.loss(pct)
    with pytest.raises(ValueError, match=r"outside 0 to 100 %"):
        bus.corruption(pct)


def test_corrupted_frames_are_repeated_in_order_and_cost_time() -> None:
    async def main(pct: float) -> tuple[list[bytes], float, int]:
        bus = MemoryBus()
        a, b, c = (bus.port(name) for name in "abc")
        received = received_by(b)
        bus.corruption(pct)
        await stream(a)
        counted = {count for port in (a, b, c) for count in (port.statistics.errors, port.statistics.error_frames)}
        assert (counted, a.statistics.unacknowledged) == ({a.statistics.errors}, 0)
        assert a.statistics.tx_frames == b.statistics.rx_frames == COUNT
        assert a.state is PortState.ACTIVE
        return received, a.statistics.busy_s, a.statistics.errors

    clean, quick, no_errors = run(main(0))
    repeated, slow, errors = run(main(5))
    assert no_errors == 0
    assert repeated == clean
    assert 0 < errors < COUNT * 0.1
    assert slow > quick * (1 + errors / COUNT)


@pytest.mark.parametrize("fast", [False, True])
async def test_a_sender_whose_frames_all_fail_goes_bus_off_and_recovers_on_request(fast: bool) -> None:
    bus = MemoryBus(fast=fast)
    a, b = bus.port("a"), bus.port("b")
    bus.corruption(100)
    await stream(a, 10)
    assert a.state is PortState.BUS_OFF
    assert b.state is PortState.ACTIVE
    assert b.statistics.errors == 32  # 8 up for each failure, off above 255
    assert (a.statistics.bus_offs, a.statistics.unacknowledged) == (1, 0)
    bus.corruption(0)
    received = received_by(b)
    a.send([Frame(1, b"lost")])
    bus.recover(a)
    assert a.state is PortState.ACTIVE
    a.send([Frame(1, b"sent")])
    await asyncio.sleep(1)
    assert received == [b"sent"]


async def test_a_port_in_bus_off_neither_sends_nor_receives(
    bus: MemoryBus, a: MemoryPort, b: MemoryPort, c: MemoryPort
) -> None:
    a.send([Frame(1, b""), Frame(2, b"")])
    await asyncio.sleep(1e-6)  # the first is on the wire
    bus.bus_off(a)
    b.send([Frame(3, b"")])
    await asyncio.sleep(1)
    assert [frame.id for _, frame in bus.history] == [1, 3]
    assert a.state is PortState.BUS_OFF
    assert a.statistics.rx_frames == 0
    assert a.statistics.errors == 1


async def test_a_mute_port_receives_and_its_frames_vanish(bus: MemoryBus, a: MemoryPort, b: MemoryPort) -> None:
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


@pytest.mark.parametrize("fast", [False, True])
async def test_alone_on_the_bus_a_port_turns_passive_and_keeps_its_frames(fast: bool) -> None:
    bus = MemoryBus(fast=fast)
    loop = asyncio.get_running_loop()
    a = bus.port("a")
    a.send([Frame(2, b""), Frame(1, b"")])
    await asyncio.sleep(3600)
    assert a.state is PortState.PASSIVE
    assert a.statistics.errors == a.statistics.error_frames == a.statistics.unacknowledged == 16
    assert (a.statistics.tx_frames, a.statistics.bus_offs) == (0, 0)
    b = bus.port("b")
    received: list[Frame] = []
    b.listen(received.extend)
    joined = loop.time()
    await asyncio.sleep(1)
    assert [frame.id for frame in received] == [1, 2]
    assert all(joined <= frame.at < joined + 0.001 for frame in received)
    assert a.statistics.tx_frames == 2
    await stream(a)
    assert a.state is PortState.ACTIVE


async def test_two_ports_with_one_identifier_count_errors_and_both_transmit(
    bus: MemoryBus, a: MemoryPort, b: MemoryPort, c: MemoryPort
) -> None:
    a.send([Frame(7, b"a1"), Frame(7, b"a2")])
    b.send([Frame(7, b"b1")])
    await asyncio.sleep(1)
    assert sorted(frame.data for _, frame in bus.history) == [b"a1", b"a2", b"b1"]
    assert a.statistics.errors == b.statistics.errors > 0
    assert c.statistics.errors == 0


async def test_missing_acknowledgements_never_lead_to_bus_off(bus: MemoryBus, a: MemoryPort) -> None:
    a.send([Frame(1, b"")])
    await asyncio.sleep(1)
    for _ in range(40):  # present when the frame begins, and gone when it ends
        b = bus.port("b")
        await asyncio.sleep(10e-6)
        await b.close()
        await asyncio.sleep(0.001)
    assert a.statistics.errors == a.statistics.unacknowledged == 16 + 40
    assert a.state is PortState.PASSIVE


# Noise, and a controller at another bit rate.


async def send_every_ms(port: MemoryPort, count: int) -> None:
    for number in range(count):
        port.send([Frame(0x100, number.to_bytes(2, "big"))])
        await asyncio.sleep(0.001)


@pytest.mark.parametrize("fast", [False, True])
async def test_in_noise_no_frame_arrives_a_sender_is_bus_off_after_32_tries_and_listeners_turn_passive(
    fast: bool,
) -> None:
    bus = MemoryBus(fast=fast, history=10)
    a, b, c = (bus.port(name) for name in "abc")
    received = received_by(b)
    bus.noise()
    a.send([Frame(1, b"lost"), Frame(2, b"")])
    await asyncio.sleep(1)
    assert received == list(bus.history) == []
    assert (a.state, b.state, c.state) == (PortState.BUS_OFF, PortState.PASSIVE, PortState.PASSIVE)
    seen = a.statistics
    assert (seen.error_frames, seen.errors, seen.bus_offs) == (32, 32 + 2, 1)  # two frames were dropped
    assert (seen.unacknowledged, seen.tx_frames) == (0, 0)
    assert b.statistics.error_frames == c.statistics.error_frames == b.statistics.errors
    assert b.statistics.error_frames == pytest.approx(1 / (NOISE_BITS * BIT), rel=0.02)
    assert (b.statistics.bus_offs, b.statistics.rx_frames) == (0, 0)
    bus.noise(False)
    bus.recover()
    assert {port.state for port in (a, b, c)} == {PortState.ACTIVE}
    a.send([Frame(3, b"again")])
    await asyncio.sleep(0.1)
    assert received == [b"again"]


async def test_noise_destroys_the_current_frame_which_is_repeated_afterwards(
    bus: MemoryBus, a: MemoryPort, b: MemoryPort
) -> None:
    received = received_by(b)
    a.send([Frame(1, b"again")])
    await asyncio.sleep(40 * BIT)
    bus.noise()
    await asyncio.sleep(3.5 * NOISE_BITS * BIT)
    bus.noise(False)
    ended = asyncio.get_running_loop().time()
    await asyncio.sleep(0.1)
    assert received == [b"again"]
    (_, frame), *_ = bus.history
    assert frame.at - ended == pytest.approx(frame_bits(frame) * BIT, abs=NOISE_BITS * BIT)
    assert 2 <= a.statistics.error_frames <= 5
    assert a.state is b.state is PortState.ACTIVE
    sent = asyncio.get_running_loop().time()
    a.send([frame])
    await asyncio.sleep(0.1)
    assert bus.history[-1][1].at == pytest.approx(sent + (frame_bits(frame) - 3) * BIT, abs=1e-9), "exact again"


async def test_a_passive_listener_turns_active_with_the_first_valid_frame(
    bus: MemoryBus, a: MemoryPort, b: MemoryPort
) -> None:
    bus.noise()
    await asyncio.sleep(0.1)
    bus.noise(False)
    assert a.state is b.state is PortState.PASSIVE
    a.send([Frame(1, b"")])
    await asyncio.sleep(0.01)
    assert b.state is PortState.ACTIVE
    assert a.state is PortState.PASSIVE  # it has received nothing yet
    b.send([Frame(1, b"")])
    await asyncio.sleep(0.01)
    assert a.state is PortState.ACTIVE


def test_noise_keeps_the_bus_busy_and_ends_with_the_last_port() -> None:
    async def main() -> None:
        bus = MemoryBus()
        a = bus.port("a")
        bus.noise()
        await asyncio.sleep(1)
        assert bus.load() == pytest.approx(1, abs=0.02)
        assert a.statistics.busy_s == pytest.approx(1, abs=0.02)
        await a.close()
        loop = asyncio.get_running_loop()
        loop.stuck_after_s = 0.01  # pyright: ignore[reportAttributeAccessIssue] - it is a JumpingLoop
        await loop.create_future()  # nothing is left that could ring

    with pytest.raises(Deadlock):
        run(main())


async def test_a_port_at_another_bit_rate_receives_only_errors_and_turns_passive(
    bus: MemoryBus, a: MemoryPort, b: MemoryPort
) -> None:
    wrong = bus.port("wrong", bitrate=500_000)
    assert wrong.bitrate == 500_000
    at_b, at_wrong = received_by(b), received_by(wrong)
    await send_every_ms(a, 100)
    await asyncio.sleep(0.1)
    assert len(at_b) == 100
    assert at_wrong == []
    assert wrong.state is PortState.PASSIVE
    assert a.state is PortState.ACTIVE
    assert a.statistics.error_frames == b.statistics.error_frames == 16  # the first to detect an error counts 8
    assert wrong.statistics.error_frames == 16 + 100
    assert (wrong.statistics.rx_frames, wrong.statistics.rx_dropped, wrong.statistics.bus_offs) == (0, 0, 0)


async def test_a_port_that_sends_at_another_bit_rate_causes_errors_until_bus_off(
    bus: MemoryBus, a: MemoryPort, b: MemoryPort
) -> None:
    wrong = bus.port("wrong", bitrate=500_000)
    at_b = received_by(b)
    wrong.send([Frame(1, b"what?")])
    await asyncio.sleep(0.1)
    assert wrong.state is PortState.BUS_OFF
    assert at_b == []
    assert a.statistics.error_frames == b.statistics.error_frames == wrong.statistics.error_frames == 32
    assert a.state is b.state is PortState.ACTIVE
    await send_every_ms(a, 10)
    assert len(at_b) == 10


async def test_a_port_at_another_bit_rate_acknowledges_nothing(bus: MemoryBus, a: MemoryPort) -> None:
    wrong = bus.port("wrong", bitrate=125_000)
    a.send([Frame(1, b"")])
    await asyncio.sleep(0.1)
    assert a.statistics.tx_frames == 0
    assert a.statistics.unacknowledged > 100  # another port is present, so it continues
    assert a.state is wrong.state is PortState.PASSIVE
    await wrong.close()
    bus.port("right")
    await asyncio.sleep(0.1)
    assert a.statistics.tx_frames == 1


async def test_a_port_at_another_bit_rate_does_not_keep_a_fast_bus_busy() -> None:
    bus = MemoryBus(fast=True)
    a, wrong = bus.port("a"), bus.port("wrong", bitrate=125_000)
    a.send([Frame(1, b"")])
    await asyncio.sleep(1)
    assert (a.state, wrong.state) == (PortState.PASSIVE, PortState.PASSIVE)
    assert a.statistics.unacknowledged == 16
    received = received_by(bus.port("right"))
    await asyncio.sleep(1)
    assert received == [b""]
