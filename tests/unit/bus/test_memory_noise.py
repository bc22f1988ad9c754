"""MemoryBus with noise, and with a controller at another bit rate."""

import asyncio

import pytest

from hornbill.bus.embedded.memory import MemoryBus
from hornbill.bus.embedded.memory_port import MemoryPort
from hornbill.wire.bittime import NOISE_BITS, frame_bits
from hornbill.wire.frame import Frame
from hornbill.wire.port import PortState
from jumping_clock import START, Deadlock, run

BIT = 1e-6


def received_by(port: MemoryPort) -> list[bytes]:
    received: list[bytes] = []
    port.listen(lambda frames: received.extend(frame.data for frame in frames))
    return received


async def send_every_ms(port: MemoryPort, count: int) -> None:
    for number in range(count):
        port.send([Frame(0x100, number.to_bytes(2, "big"))])
        await asyncio.sleep(0.001)


@pytest.mark.parametrize("fast", [False, True])
async def test_in_noise_no_frame_arrives_and_listeners_turn_passive_but_never_bus_off(fast: bool) -> None:
    bus = MemoryBus(fast=fast, history=10)
    a, b, c = (bus.port(name) for name in "abc")
    received = received_by(b)
    bus.noise()
    a.send([Frame(1, b"lost")])
    await asyncio.sleep(1)
    assert received == []
    assert list(bus.history) == []
    assert (a.state, b.state, c.state) == (PortState.BUS_OFF, PortState.PASSIVE, PortState.PASSIVE)
    assert b.statistics.error_frames == c.statistics.error_frames
    assert b.statistics.error_frames == pytest.approx(1 / (NOISE_BITS * BIT), rel=0.02)
    assert b.statistics.errors == b.statistics.error_frames
    assert (b.statistics.bus_offs, b.statistics.rx_frames) == (0, 0)


async def test_a_sender_in_noise_is_bus_off_after_32_tries_and_its_frames_are_dropped(
    bus: MemoryBus, a: MemoryPort, b: MemoryPort
) -> None:
    bus.noise()
    a.send([Frame(1, b""), Frame(2, b"")])
    await asyncio.sleep(32 * NOISE_BITS * BIT)
    await asyncio.sleep(0.011)  # noise alone is counted a hundred times a second
    assert a.state is PortState.BUS_OFF
    assert a.statistics.error_frames == 32
    assert a.statistics.errors == 32 + 2
    assert (a.statistics.bus_offs, a.statistics.unacknowledged, a.statistics.tx_frames) == (1, 0, 0)
    assert b.statistics.error_frames > 32  # a port in bus-off counts no errors


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


async def test_recover_ends_bus_off_of_all_ports(bus: MemoryBus, a: MemoryPort, b: MemoryPort, c: MemoryPort) -> None:
    bus.noise()
    for port in (a, b):
        port.send([Frame(1, b"")])
    await asyncio.sleep(0.1)
    assert a.state is b.state is PortState.BUS_OFF
    bus.noise(False)
    bus.recover()
    assert {port.state for port in (a, b, c)} == {PortState.ACTIVE}
    received = received_by(c)
    await send_every_ms(a, 3)
    assert len(received) == 3


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


async def test_bit_times_are_exact_again_after_noise(bus: MemoryBus, a: MemoryPort, b: MemoryPort) -> None:
    bus.noise()
    await asyncio.sleep(0.5)
    bus.noise(False)
    await asyncio.sleep(0.5)
    frame = Frame(0x155, b"\x55")
    a.send([frame])
    await asyncio.sleep(0.1)
    assert bus.history[0][1].at == pytest.approx(START + 1 + (frame_bits(frame) - 3) * BIT, abs=1e-9)
