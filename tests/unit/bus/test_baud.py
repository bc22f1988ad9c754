"""Detection of the baud rate: the search in virtual time, and adapters on pseudo terminals.

The other end of a pseudo terminal sees the rate set by the computer. At any other rate both receive invalid bytes.
"""

import asyncio
import errno
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any

import pytest
import serial

pytest.importorskip("termios", reason="pseudo terminals exist on POSIX only")

from hornbill.bus import address
from hornbill.bus.adapters.serial_ports import UsbAdapter
from hornbill.bus.address import open_port
from hornbill.bus.ports import baud, mavlink, pythoncan, serial_line, slcan
from hornbill.bus.ports.baud import MAX_SEARCH_S, ONE_RATE_S, RATES, SEARCH_S, Search, Sense, sense_of
from hornbill.bus.ports.serial_line import SerialStream
from hornbill.bus.reopening import adapter_port
from hornbill.errors import PortOpenFailed
from hornbill.wire.frame import Frame
from hornbill.wire.port import PortState
from unit.bus.adapter import BUS_FRAME, FakeAdapter
from unit.bus.slcan_ports import line_of, opened
from unit.bus.waiting import no_leaks, received_by, until

BEHAVIOURS: dict[str, dict[str, Any]] = {
    "responds with CR": {"responds": "lawicel", "bus": True},
    "refuses S8 and works after O": {"responds": "fixed", "bus": True},
    "silent": {"responds": "mute", "bus": True},
    "echoes": {"responds": "echo", "bus": True},
    "streams frames at once": {"responds": "lawicel", "bus": "streaming"},
    "sends noise": {"responds": "lawicel", "bus": True, "noise": True},
}
NOTES = {
    "refuses S8 and works after O": "bit_rate_fixed",
    "silent": "adapter_silent",
    "echoes": "adapter_echoes",
    "sends noise": "line_noise",
}

# MAVLink heartbeats as pymavlink writes them: version 1 and version 2, system 1.
HEARTBEATS = (
    bytes.fromhex("fe09000101000000000002035104037ddd"),
    bytes.fromhex("fd090000000101000000000000000203510403e71e"),
)


# The search, in virtual time.


@dataclass
class VirtualLine:
    """A serial line to an adapter at `rate`, None for any. See FakeAdapter for `responds`, `bus` and `noise`.

    `deaf_s`: it ignores everything until then. `heartbeat`: sent every `period_s`, from 0.01 s on.
    """

    rate: int | None = None
    responds: str = "lawicel"
    bus: bool | str = False
    noise: bool = False
    deaf_s: float = 0.0
    heartbeat: bytes = b""
    period_s: float = 1.0
    now: float = 0.0
    baud: int = 0
    open: bool = False
    _received: bytes = b""
    _next: int = 0
    _random: Random = field(default_factory=lambda: Random(7))

    def set_baud(self, baud: int) -> bool:
        self.baud, self._received = baud, b""
        return True

    def write(self, data: bytes, within_s: float) -> bool:
        if self.now >= self.deaf_s and self.rate in (None, self.baud):
            if self.responds == "echo":
                self._received += data
            for command in data.split(b"\r")[:-1]:
                self.open = command == b"O" or (self.open and command != b"C")
                self._received += self._response(command)
        return True

    def read(self, timeout_s: float) -> bytes:
        until = self.now + timeout_s
        while not self._received and self.now < until:
            self.now = min(until, max(self.now, self._next * 0.01))
            if self.now >= self._next * 0.01:
                self._next += 1
                self._received = self._unsolicited(self._next)
        data, self._received = self._received, b""
        return data if self.rate in (None, self.baud) else self._random.randbytes(len(data))

    def _response(self, command: bytes) -> bytes:
        if self.responds in ("mute", "echo"):
            return b""
        if self.responds == "fixed" and command not in (b"O", b"C"):
            return b"\a"
        return b"V1013\r" if command == b"V" else b"\r"

    def _unsolicited(self, tick: int) -> bytes:
        data = self._random.randbytes(3).replace(b"\r", b"\xff").replace(b"\a", b"\xff") if self.noise else b""
        if self.bus == "streaming" or (self.bus and self.open):
            data += BUS_FRAME
        return data + (self.heartbeat if tick % round(self.period_s * 100) == 2 else b"")


@pytest.fixture
def search(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Runs a search on a line, without real time."""

    def run(line: VirtualLine, rates: tuple[int, ...] = RATES) -> Any:
        monkeypatch.setattr(baud, "time", SimpleNamespace(monotonic=lambda: line.now))
        monkeypatch.setattr(baud, "SEARCH_S", SEARCH_S)
        return Search(line, "slcan:x").run(rates)  # pyright: ignore[reportArgumentType]

    return run


@pytest.mark.parametrize("rate", [1_000_000, 115_200, 2_000_000, 460_800, 57_600])
@pytest.mark.parametrize("behaviour", BEHAVIOURS)
def test_every_adapter_is_detected_at_its_rate_in_one_round(
    search: Callable[..., Any], behaviour: str, rate: int
) -> None:
    line = VirtualLine(rate, **BEHAVIOURS[behaviour])
    found = search(line)
    assert (found.baud, found.confirmed, line.baud) == (rate, True, rate)
    assert found.echoes is (behaviour == "echoes")
    assert found.responds is (behaviour not in ("silent", "echoes", "streams frames at once"))
    assert bool(found.noise) is (behaviour == "sends noise")
    assert line.now <= 1.4


def test_an_adapter_that_restarts_when_opened_is_detected_in_a_later_round(search: Callable[..., Any]) -> None:
    line = VirtualLine(57_600, deaf_s=2.0)
    found = search(line)
    assert (found.baud, found.confirmed) == (57_600, True)
    assert 2.0 < line.now <= SEARCH_S


@pytest.mark.parametrize(("rates", "limit_s"), [(RATES, SEARCH_S), ((115_200,), ONE_RATE_S)])
def test_a_line_without_data_is_a_guess_after_the_search(
    search: Callable[..., Any], rates: tuple[int, ...], limit_s: float
) -> None:
    line = VirtualLine(9600, responds="mute")
    found = search(line, rates)
    assert (found.baud, found.confirmed, found.responds) == (rates[0], False, False)
    assert limit_s <= line.now <= limit_s + 0.2


@pytest.mark.parametrize("heartbeat", HEARTBEATS, ids=["MAVLink 1", "MAVLink 2"])
@pytest.mark.parametrize(
    ("rate", "period_s"), [(None, 1.0), (57_600, 0.3), (57_600, 1.0)], ids=["on USB", "57600", "57600 once a second"]
)
def test_mavlink_is_reported(search: Callable[..., Any], heartbeat: bytes, rate: int | None, period_s: float) -> None:
    line = VirtualLine(rate, responds="mute", heartbeat=heartbeat, period_s=period_s)
    with pytest.raises(PortOpenFailed, match=r"sends MAVLink \(system 1\): an autopilot is on this port") as caught:
        search(line)
    assert caught.value.facts["cause"] == "mavlink"
    assert "use mavcan:" in caught.value.facts["remedy"]
    assert line.now <= MAX_SEARCH_S


@pytest.mark.parametrize(
    ("line", "rates", "detail", "remedy"),
    [
        (VirtualLine(responds="mute", noise=True), RATES, "at any of 7 baud rates", "slcan:x@BAUD"),
        (VirtualLine(1_000_000, bus="streaming"), (115_200,), "at 115200 baud", "Remove @115200"),
    ],
    ids=["noise", "wrong rate"],
)
def test_bytes_that_are_not_slcan_are_refused(
    search: Callable[..., Any], line: VirtualLine, rates: tuple[int, ...], detail: str, remedy: str
) -> None:
    with pytest.raises(PortOpenFailed, match=f"bytes that are not slcan {detail}") as caught:
        search(line, rates)
    assert remedy in str(caught.value.facts["remedy"])
    assert caught.value.facts["cause"] == "not_slcan"
    assert line.now <= MAX_SEARCH_S + 0.01


# Adapters on pseudo terminals.


class Memory:
    """Baud rates by serial number, as the store keeps them."""

    def __init__(self) -> None:
        self.known: dict[str, int] = {}

    def baud(self, serial_number: str) -> int | None:
        return self.known.get(serial_number)

    def remember_baud(self, serial_number: str, baud: int) -> None:
        self.known[serial_number] = baud


@pytest.fixture(autouse=True)
def tried(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The rates set, in order. Nothing an adapter sent at one rate arrives at the next."""
    rates: list[int] = []
    set_baud = SerialStream.set_baud

    def set_and_record(line: SerialStream, rate: int) -> bool:
        rates.append(rate)
        with FakeAdapter.rates:
            return set_baud(line, rate)

    monkeypatch.setattr(SerialStream, "set_baud", set_and_record)
    monkeypatch.setattr(baud, "SEARCH_S", 20.0)  # a search that succeeds ends before
    return rates


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten the waits of a search that finds nothing."""
    monkeypatch.setattr(baud, "SEARCH_S", 0.3)
    monkeypatch.setattr(baud, "ONE_RATE_S", 0.3)
    monkeypatch.setattr(pythoncan, "NOTHING_S", 0.2)


@pytest.mark.real_time
@pytest.mark.parametrize("behaviour", BEHAVIOURS)
async def test_every_adapter_is_opened_receives_sends_and_is_closed(
    behaviour: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(baud, "_OPEN_S", 5.0)  # its rate is tried first, and frames end the wait
    with no_leaks():
        async with opened(FakeAdapter(baud=RATES[0], **BEHAVIOURS[behaviour])) as (adapter, port):
            received = received_by(port)
            await until(lambda: received)
            line = line_of(port)
            assert (line.baud, line.found, line.confirmed, line.budget) == (RATES[0], True, True, RATES[0] // 270)
            codes = [note.code for note in port.details.notes]
            assert codes == ([NOTES[behaviour]] if behaviour in NOTES else [])
            assert (port.state, port.trouble) == (PortState.ACTIVE, None)
            received.clear()
            port.send([Frame(0x1FAA7F01, b"\x55")])
            await until(lambda: port.statistics.tx_frames == 1)
            await until(lambda: adapter.sent == [b"T1FAA7F01155"])
            await until(lambda: len(received) > 3)
            assert all(frame.id == 0x1E08FF05 for frame in received), "sent frames are not received"


@pytest.mark.real_time
async def test_a_rate_in_the_address_is_the_only_one_tried(quick: None, tried: list[int]) -> None:
    async with opened(FakeAdapter(responds="mute", bus=True, baud=115_200), "@115200") as (_, port):
        assert (line_of(port).baud, line_of(port).found) == (115_200, False)
    assert set(tried) == {115_200}


@pytest.mark.real_time
@pytest.mark.parametrize(
    ("baud_option", "remedy"),
    [("@57600", "Remove @57600 to detect the rate: slcan:{}."), ("", "120 Ω at both ends")],
)
async def test_an_adapter_without_data_is_passive_and_never_active(quick: None, baud_option: str, remedy: str) -> None:
    with no_leaks():
        async with opened(FakeAdapter(responds="mute", baud=115_200), baud_option) as (adapter, port):
            await until(lambda: port.state is PortState.PASSIVE)
            assert port.details.nothing_received
            assert "no data was received" in str(port.trouble)
            assert remedy.format(adapter.channel) in str(port.trouble)


@pytest.mark.real_time
async def test_the_rate_of_a_silent_adapter_is_detected_when_frames_arrive(
    quick: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slcan, "_NEXT_RATE_S", 0.15)
    async with opened(FakeAdapter(responds="mute", baud=460_800)) as (adapter, port):
        assert {note.code for note in port.details.notes} == {"adapter_silent", "baud_unknown"}
        assert not line_of(port).confirmed
        await until(lambda: port.state is PortState.PASSIVE)
        assert "no data was received. Its baud rate is unknown" in str(port.trouble)
        rates = set[int]()
        while len(rates) < 3:
            rates.add(line_of(port).baud)
            await asyncio.sleep(0.01)
        adapter.bus = True
        await until(lambda: port.statistics.rx_frames > 3)
        assert (line_of(port).baud, line_of(port).confirmed) == (460_800, True)
        assert {note.code for note in port.details.notes} == {"adapter_silent"}
        assert (port.state, port.trouble) == (PortState.ACTIVE, None)


def test_an_adapter_with_native_usb_has_no_rate_and_no_limit() -> None:
    with FakeAdapter() as adapter:
        bus = slcan.SlcanBus(adapter.channel, usb=UsbAdapter("42", native_usb=True))
        assert (bus.line_info.found, bus.line_info.budget, bus.line_info.serial_number) == (False, None, "42")
        bus.shutdown()


@pytest.mark.real_time
@pytest.mark.parametrize("can_be_set", [True, False])
async def test_the_latency_timer_of_an_ftdi_chip_is_set_to_1_ms_or_noted(
    can_be_set: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Linux shows the timer of a port in a file, and shortens it for a port in low latency mode."""

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
    async with opened(adapter) as (_, port):
        assert line_of(port).latency_ms == (1 if can_be_set else 16)
        notes = {note.code: note.text for note in port.details.notes}
        assert ("latency_timer" in notes) is not can_be_set
        assert can_be_set or "16 ms" in notes["latency_timer"]


@pytest.mark.real_time
async def test_an_adapter_unplugged_during_the_search_is_reported() -> None:
    with no_leaks():
        adapter = FakeAdapter(responds="mute")
        unplugging = threading.Timer(0.1, adapter.unplug)
        unplugging.start()
        with pytest.raises(PortOpenFailed, match="It was unplugged, or stopped responding, while it was being opened"):
            await open_port(f"slcan:{adapter.channel}")
        unplugging.join()


@pytest.mark.real_time
async def test_a_cancelled_search_ends(tried: list[int]) -> None:
    with FakeAdapter(responds="mute") as adapter, no_leaks():
        opening = asyncio.create_task(open_port(f"slcan:{adapter.channel}"))
        await until(lambda: tried)
        opening.cancel()
        with pytest.raises(asyncio.CancelledError):
            await opening


@pytest.mark.real_time
async def test_an_adapter_is_tried_first_at_the_last_rate_of_its_serial_number(
    monkeypatch: pytest.MonkeyPatch, tried: list[int]
) -> None:
    """Copies of a chip often share one, so the remembered rate of one is wrong for the other."""

    def usb_of(_device: str) -> UsbAdapter:
        return UsbAdapter("A50285BI")

    monkeypatch.setattr(address, "usb_of", usb_of)
    memory = Memory()
    with FakeAdapter(baud=1_000_000, bus=True) as one, FakeAdapter(baud=115_200, bus=True) as other:
        for adapter, rate, first in (
            (one, 1_000_000, 1_000_000), (other, 115_200, 1_000_000), (other, 115_200, 115_200),
        ):  # fmt: skip
            tried.clear()
            port = await open_port(f"slcan:{adapter.channel}", memory=memory)
            assert (line_of(port).baud, line_of(port).serial_number, tried[0]) == (rate, "A50285BI", first)
            await until(lambda rate=rate: memory.known == {"A50285BI": rate})
            await port.close()


@pytest.mark.real_time
async def test_adapters_are_searched_in_parallel_and_again_when_reopened() -> None:
    with FakeAdapter(baud=1_000_000) as one, FakeAdapter(baud=115_200) as other:
        for _ in range(2):
            ports = [adapter_port(f"slcan:{each.channel}") for each in (one, other)]
            await asyncio.gather(*(port.open() for port in ports))
            assert [line_of(port).baud for port in ports] == [1_000_000, 115_200]
            for port in ports:
                await port.close()
                assert port.details.serial_line is None


# Meaning of received bytes.


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
def test_the_sense_of_received_bytes(data: bytes, sense: Sense) -> None:
    assert sense_of(data) is sense


@pytest.mark.parametrize("heartbeat", HEARTBEATS)
def test_mavlink_is_recognised_by_its_checksum(heartbeat: bytes) -> None:
    assert mavlink.system_of(b"\xfe\x09" + heartbeat + b"\xfd") == 1
    damaged = heartbeat[:-1] + bytes([heartbeat[-1] ^ 1])
    assert mavlink.system_of(damaged) is None
    assert mavlink.system_of(heartbeat[:-1]) is None
    assert mavlink.system_of(BUS_FRAME * 20) is None
