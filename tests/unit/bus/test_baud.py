"""Tests of the search for the baud rate: six ways adapters behave, at five rates, and whatever is no adapter.

The far end of a pseudo terminal reads which rate the computer has set: at another one neither understands the other.
"""

import asyncio
import errno
import os
import threading
import time
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest
import serial

pytest.importorskip("termios", reason="pseudo terminals are a matter of POSIX")

from hornbill.bus import address
from hornbill.bus.adapters.serial_ports import UsbAdapter
from hornbill.bus.address import open_port
from hornbill.bus.ports import baud, mavlink, pythoncan, serial_line, slcan
from hornbill.bus.ports.baud import RATES, Sense, sense_of
from hornbill.bus.reopening import adapter_port
from hornbill.errors import PortOpenFailed
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort, PortState
from unit.bus.adapter import BUS_FRAME, FakeAdapter, wait_until

OPEN_S = 4.0
"""Within this an adapter is open, or it is said why not."""

BEHAVIOURS: dict[str, dict[str, Any]] = {
    "answers with CR": {"answers": "lawicel", "bus": True},
    "answers BELL to S8 and works after O": {"answers": "fixed", "bus": True},
    "silent": {"answers": "mute", "bus": True},
    "echoes": {"answers": "echo", "bus": True},
    "streams frames at once": {"answers": "lawicel", "bus": "streaming"},
    "sends noise": {"answers": "lawicel", "bus": True, "noise": True},
}
NOTES = {
    "answers BELL to S8 and works after O": "bit_rate_fixed",
    "silent": "adapter_silent",
    "echoes": "adapter_echoes",
    "sends noise": "line_noise",
}
BAUDS = (1_000_000, 115_200, 2_000_000, 460_800, 57_600)

# MAVLink heartbeats as pymavlink writes them: version 1 and version 2, system 1.
HEARTBEATS = (
    bytes.fromhex("fe09000101000000000002035104037ddd"),
    bytes.fromhex("fd090000000101000000000000000203510403e71e"),
)


class Memory:
    """Baud rates by serial number, as the store keeps them."""

    def __init__(self, **known: int) -> None:
        self.known = known

    def baud(self, serial_number: str) -> int | None:
        return self.known.get(serial_number)

    def remember_baud(self, serial_number: str, baud: int) -> None:
        self.known[serial_number] = baud


async def until(condition: Callable[[], object], within_s: float = 5.0) -> None:
    async with asyncio.timeout(within_s):
        while not condition():
            await asyncio.sleep(0.002)


def with_port(adapter: FakeAdapter, scenario: Callable[[CanPort], Coroutine[Any, Any, None]], **options: Any) -> None:
    async def main() -> None:
        port = await open_port(f"slcan:{adapter.channel}", **options)
        try:
            await scenario(port)
        finally:
            await port.close()

    with adapter:
        asyncio.run(main())


def line_of(port: CanPort) -> Any:
    line = port.details.serial_line
    assert line is not None
    return line


# Adapters.


@pytest.mark.parametrize("rate", BAUDS)
@pytest.mark.parametrize("behaviour", BEHAVIOURS)
def test_every_adapter_is_found_at_its_rate_opened_and_heard_within_four_seconds(behaviour: str, rate: int) -> None:
    before = threading.active_count(), len(os.listdir("/dev/fd"))  # noqa: PTH208
    adapter = FakeAdapter(baud=rate, **BEHAVIOURS[behaviour])
    began = time.monotonic()

    async def scenario(port: CanPort) -> None:
        assert time.monotonic() - began <= OPEN_S
        heard: list[Frame] = []
        port.listen(heard.extend)
        await until(lambda: heard)
        assert heard[0].id == 0x1E08FF05
        assert (line_of(port).baud, line_of(port).found, line_of(port).confirmed) == (rate, True, True)
        assert line_of(port).budget == rate // 270
        codes = [note.code for note in port.details.notes]
        assert codes == ([NOTES[behaviour]] if behaviour in NOTES else [])
        assert (port.state, port.trouble) == (PortState.ACTIVE, None)
        heard.clear()
        port.send([Frame(0x1FAA7F01, b"\x55")])
        await until(lambda: port.statistics.tx_frames == 1)
        await until(lambda: adapter.sent == [b"T1FAA7F01155"])
        await until(lambda: len(heard) > 3)
        assert all(frame.id == 0x1E08FF05 for frame in heard), "what is sent is not heard"

    with_port(adapter, scenario)
    assert (threading.active_count(), len(os.listdir("/dev/fd"))) == before  # noqa: PTH208


def test_the_adapter_of_the_starter_kit_is_opened_and_closed() -> None:
    """1,000,000 baud, and of all commands O and C alone."""
    with FakeAdapter(answers="fixed", bus=True, baud=1_000_000) as adapter:

        async def main() -> None:
            began = time.monotonic()
            port = await open_port(f"slcan:{adapter.channel}")
            assert time.monotonic() - began < 2
            assert adapter.is_open
            assert line_of(port).baud == RATES[0] == 1_000_000
            assert line_of(port).budget == 3703
            await port.close()
            wait_until(lambda: not adapter.is_open)

        asyncio.run(main())


def test_a_rate_in_the_address_is_used_and_no_other_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(baud, "ONE_RATE_S", 0.3)
    monkeypatch.setattr(pythoncan, "NOTHING_S", 0.2)
    adapter = FakeAdapter(baud=115_200, bus=True)

    async def main() -> None:
        port = await open_port(f"slcan:{adapter.channel}@115200")
        assert (line_of(port).baud, line_of(port).found) == (115_200, False)
        await port.close()
        await until(lambda: not adapter.is_open)  # what it still sends would be noise at another rate
        port = await open_port(f"slcan:{adapter.channel}@57600")
        await until(lambda: port.state is PortState.PASSIVE)
        assert f"Remove @57600 to detect the rate: slcan:{adapter.channel}." in str(port.trouble)
        assert port.details.nothing_received
        await port.close()

    adapter.responds = "mute"
    with adapter:
        asyncio.run(main())


@pytest.mark.parametrize("address_of", ["slcan:{}@115200", "slcan:{}"], ids=["at a wrong rate", "at no rate"])
def test_an_adapter_from_which_nothing_comes_is_a_problem_within_four_seconds(address_of: str) -> None:
    before = threading.active_count(), len(os.listdir("/dev/fd"))  # noqa: PTH208
    with FakeAdapter(baud=1_000_000, answers="mute") as adapter:

        async def main() -> None:
            began = time.monotonic()
            port = await open_port(address_of.format(adapter.channel))
            await until(lambda: port.state is PortState.PASSIVE)
            assert time.monotonic() - began <= OPEN_S
            assert port.details.nothing_received
            assert "no data was received" in str(port.trouble)
            await port.close()

        asyncio.run(main())
    wait_until(lambda: (threading.active_count(), len(os.listdir("/dev/fd"))) <= before)  # noqa: PTH208


def test_an_adapter_is_tried_first_at_the_rate_it_was_last_used_at(monkeypatch: pytest.MonkeyPatch) -> None:
    def named(_device: str) -> UsbAdapter:
        return UsbAdapter("A1B2")

    monkeypatch.setattr(address, "usb_of", named)
    memory = Memory()
    adapter = FakeAdapter(baud=57_600)

    async def first(port: CanPort) -> None:
        adapter.say(BUS_FRAME)
        await until(lambda: memory.known)
        assert memory.known == {"A1B2": 57_600}
        assert line_of(port).serial_number == "A1B2"

    with_port(adapter, first, memory=memory)
    again = FakeAdapter(baud=57_600)
    began = time.monotonic()

    async def second(port: CanPort) -> None:
        assert time.monotonic() - began < 1.0, "the search of all rates takes longer"
        assert line_of(port).baud == 57_600

    with_port(again, second, memory=memory)


def test_a_remembered_rate_that_is_wrong_costs_a_search() -> None:
    with FakeAdapter(baud=115_200) as adapter:
        bus = slcan.SlcanBus(adapter.channel, first_baud=460_800)
        assert bus.line_info.baud == 115_200
        bus.shutdown()


def test_a_silent_adapter_on_a_silent_bus_is_found_when_the_bus_wakes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(baud, "SEARCH_S", 0.3)
    monkeypatch.setattr(slcan, "_NEXT_RATE_S", 0.15)
    monkeypatch.setattr(pythoncan, "NOTHING_S", 0.2)
    adapter = FakeAdapter(answers="mute", baud=460_800)

    async def scenario(port: CanPort) -> None:
        assert {note.code for note in port.details.notes} == {"adapter_silent", "baud_unknown"}
        assert not line_of(port).confirmed
        await until(lambda: port.state is PortState.PASSIVE)
        assert "no data was received. Its baud rate is unknown" in str(port.trouble)
        rates = set[int]()
        while len(rates) < 3:
            rates.add(line_of(port).baud)
            await asyncio.sleep(0.01)
        adapter._bus = True  # pyright: ignore[reportPrivateUsage]
        await until(lambda: port.statistics.rx_frames > 3)
        assert (line_of(port).baud, line_of(port).confirmed) == (460_800, True)
        assert {note.code for note in port.details.notes} == {"adapter_silent"}
        assert (port.state, port.trouble) == (PortState.ACTIVE, None)

    with_port(adapter, scenario)


def test_a_silent_adapter_on_a_silent_bus_is_open_in_four_seconds_and_never_called_active(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert pythoncan.NOTHING_S <= OPEN_S
    monkeypatch.setattr(pythoncan, "NOTHING_S", 0.3)
    adapter = FakeAdapter(answers="mute", baud=57_600)
    began = time.monotonic()

    async def scenario(port: CanPort) -> None:
        assert time.monotonic() - began <= OPEN_S
        await until(lambda: port.state is PortState.PASSIVE, pythoncan.NOTHING_S + 1)
        assert "120 Ω at both ends" in str(port.trouble)
        assert f"slcan:{adapter.channel}@BAUD" in str(port.trouble)

    with_port(adapter, scenario)


def test_an_adapter_on_usb_alone_has_no_rate_to_find_and_no_limit() -> None:
    with FakeAdapter() as adapter:
        bus = slcan.SlcanBus(adapter.channel, usb=UsbAdapter("42", native_usb=True))
        assert (bus.line_info.found, bus.line_info.budget, bus.line_info.serial_number) == (False, None, "42")
        bus.shutdown()


@pytest.mark.parametrize("can_be_set", [True, False])
def test_the_latency_timer_of_an_ftdi_chip_is_set_to_1_ms_and_told_where_it_cannot_be(
    can_be_set: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kernel shows the timer of a port in a file, and shortens it for a port in low latency mode."""

    def set_low_latency_mode(_port: object, wanted: bool) -> None:
        assert wanted
        if not can_be_set:
            raise OSError(errno.EPERM, "not permitted")
        timer.write_text("1\n")

    adapter = FakeAdapter(bus=True)
    timer = tmp_path / Path(adapter.channel).name / "device" / "latency_timer"
    timer.parent.mkdir(parents=True)
    timer.write_text("16\n")
    monkeypatch.setattr(serial_line, "TTYS", tmp_path)
    monkeypatch.setattr(serial.Serial, "set_low_latency_mode", set_low_latency_mode)

    async def scenario(port: CanPort) -> None:
        assert line_of(port).latency_ms == (1 if can_be_set else 16)
        notes = {note.code: note.text for note in port.details.notes}
        assert ("latency_timer" in notes) is not can_be_set
        assert can_be_set or "16 ms" in notes["latency_timer"]

    with_port(adapter, scenario)


# What is no adapter, and what ends amid the search.


def refusal(adapter: FakeAdapter, rate: str = "") -> PortOpenFailed:
    """Why it does not open; within four seconds, with nothing left open."""
    before = threading.active_count(), len(os.listdir("/dev/fd"))  # noqa: PTH208
    began = time.monotonic()
    with pytest.raises(PortOpenFailed) as caught:
        asyncio.run(open_port(f"slcan:{adapter.channel}{rate}"))
    assert time.monotonic() - began <= OPEN_S
    wait_until(lambda: (threading.active_count(), len(os.listdir("/dev/fd"))) <= before)  # noqa: PTH208
    return caught.value


def test_a_device_that_sends_what_is_no_slcan_at_any_rate_is_refused() -> None:
    with FakeAdapter(answers="mute", noise=True) as device:
        error = refusal(device)
    assert "bytes that are not slcan at any of 7 baud rates" in error.detail
    assert f"slcan:{device.channel}@BAUD" in str(error.facts["remedy"])


def test_a_wrong_rate_in_the_address_is_refused_with_what_helps() -> None:
    with FakeAdapter(baud=1_000_000, bus=True) as adapter:
        error = refusal(adapter, "@115200")
    assert "bytes that are not slcan at 115200 baud" in error.detail
    assert "Remove @115200" in str(error.facts["remedy"])


@pytest.mark.parametrize("heartbeat", HEARTBEATS, ids=["MAVLink 1", "MAVLink 2"])
@pytest.mark.parametrize("rate", [None, 57_600], ids=["on USB", "57600"])
def test_a_port_that_speaks_mavlink_says_so(heartbeat: bytes, rate: int | None) -> None:
    with FakeAdapter(answers="mute", baud=rate) as device:
        ended = threading.Event()

        def beat() -> None:
            while not ended.wait(0.3 if rate else 1.0):
                device.say(heartbeat)

        beating = threading.Thread(target=beat)
        beating.start()
        time.sleep(0.01)
        try:
            error = refusal_beside(device, beating)
        finally:
            ended.set()
            beating.join()
    assert "sends MAVLink (system 1): an autopilot is on this port" in error.detail
    assert error.facts["cause"] == "mavlink"


def refusal_beside(device: FakeAdapter, _thread: threading.Thread) -> PortOpenFailed:
    began = time.monotonic()
    with pytest.raises(PortOpenFailed) as caught:
        asyncio.run(open_port(f"slcan:{device.channel}"))
    assert time.monotonic() - began <= OPEN_S
    return caught.value


def test_an_adapter_unplugged_during_the_search_is_told_as_that() -> None:
    before = threading.active_count(), len(os.listdir("/dev/fd"))  # noqa: PTH208
    adapter = FakeAdapter(answers="mute")
    pulling = threading.Timer(0.3, adapter.unplug)
    pulling.start()
    began = time.monotonic()
    with pytest.raises(PortOpenFailed, match="It was unplugged, or stopped responding, while it was being opened"):
        asyncio.run(open_port(f"slcan:{adapter.channel}"))
    assert time.monotonic() - began < 2
    pulling.join()
    wait_until(lambda: (threading.active_count(), len(os.listdir("/dev/fd"))) <= before)  # noqa: PTH208


def test_two_adapters_with_one_serial_number_are_each_found_at_their_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    """Copies of a chip often have the same one, so that what is remembered of one is wrong for the other."""

    def named(_device: str) -> UsbAdapter:
        return UsbAdapter("A50285BI")

    monkeypatch.setattr(address, "usb_of", named)
    memory = Memory()
    with FakeAdapter(baud=1_000_000, bus=True) as one, FakeAdapter(baud=57_600, bus=True) as other:

        async def main() -> None:
            for each, rate in ((one, 1_000_000), (other, 57_600), (one, 1_000_000)):
                began = time.monotonic()
                port = await open_port(f"slcan:{each.channel}", memory=memory)
                assert time.monotonic() - began <= OPEN_S
                assert line_of(port).baud == rate
                await until(lambda: memory.known == {"A50285BI": rate})  # noqa: B023
                await port.close()

        asyncio.run(main())


def test_a_search_that_is_no_longer_wanted_ends_at_once() -> None:
    with FakeAdapter(answers="mute") as adapter:
        before = threading.active_count(), len(os.listdir("/dev/fd"))  # noqa: PTH208

        async def main() -> None:
            opening = asyncio.create_task(open_port(f"slcan:{adapter.channel}"))
            await asyncio.sleep(0.2)
            opening.cancel()
            with pytest.raises(asyncio.CancelledError):
                await opening

        asyncio.run(main())
        wait_until(lambda: (threading.active_count(), len(os.listdir("/dev/fd"))) == before, 1.0)  # noqa: PTH208


def test_two_adapters_alike_are_searched_side_by_side_and_each_has_its_rate() -> None:
    with FakeAdapter(baud=1_000_000) as one, FakeAdapter(baud=57_600) as other:

        async def main() -> None:
            ports = await asyncio.gather(*(open_port(f"slcan:{each.channel}") for each in (one, other)))
            assert [line_of(port).baud for port in ports] == [1_000_000, 57_600]
            for port in ports:
                await port.close()

        asyncio.run(main())


def test_the_search_is_repeated_when_the_adapter_is_opened_again() -> None:
    """A port that opens itself again finds the rate anew: it may be another adapter."""
    with FakeAdapter(baud=1_000_000) as one, FakeAdapter(baud=115_200) as other:

        async def main() -> None:
            for each, rate in ((one, 1_000_000), (other, 115_200)):
                port = adapter_port(f"slcan:{each.channel}")
                await port.open()
                assert line_of(port).baud == rate
                await port.close()
                assert port.details.serial_line is None

        asyncio.run(main())


# What bytes say.


@pytest.mark.parametrize(
    ("data", "sense"),
    [
        (b"", Sense.NOTHING),
        (b"\r", Sense.RESPONSE),
        (b"\a\a\r", Sense.RESPONSE),
        (b"V1013\r", Sense.SLCAN),
        (b"\xff\x00V1013\r", Sense.SLCAN),
        (b"CANable b158aa7\r", Sense.RESPONSE),
        (b"\r\rC\rV\r", Sense.ECHO),
        (b"O\r", Sense.ECHO),
        (BUS_FRAME, Sense.SLCAN),
        (b"\x80\xfe" + BUS_FRAME, Sense.SLCAN),
        (b"t1232AABB\r", Sense.SLCAN),
        (b"T1E08FF0580102\r", Sense.RESPONSE),  # shorter than it says
        (b"\xf9", Sense.NOISE),
        (b"V10", Sense.NOISE),
        (HEARTBEATS[0], Sense.NOISE),
    ],
)
def test_the_sense_of_what_is_received(data: bytes, sense: Sense) -> None:
    assert sense_of(data) is sense


@pytest.mark.parametrize("heartbeat", HEARTBEATS)
def test_mavlink_is_known_by_its_checksum(heartbeat: bytes) -> None:
    assert mavlink.system_of(b"\xfe\x09" + heartbeat + b"\xfd") == 1
    damaged = heartbeat[:-1] + bytes([heartbeat[-1] ^ 1])
    assert mavlink.system_of(damaged) is None
    assert mavlink.system_of(heartbeat[:-1]) is None
    assert mavlink.system_of(BUS_FRAME * 20) is None
