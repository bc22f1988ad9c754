"""Slcan adapters on a pseudo terminal: opening, receiving, sending, and their failures."""

import asyncio
import contextlib
import os
import threading
import time
from types import SimpleNamespace

import can
import pytest

from hornbill.bus.adapters.serial_ports import UsbAdapter
from hornbill.bus.address import open_port
from hornbill.bus.ports import baud, serial_line, slcan
from hornbill.bus.ports.serial_line import SerialStream
from hornbill.bus.ports.slcan import SlcanBus
from hornbill.errors import BusDisconnected, PortOpenFailed
from hornbill.wire.frame import Frame
from hornbill.wire.port import PortState

pytest.importorskip("termios", reason="pseudo terminals exist on POSIX only")

from unit.bus.adapter import FakeAdapter, wait_until
from unit.bus.slcan_ports import opened
from unit.bus.waiting import LIMIT_S, received_by, until

pytestmark = pytest.mark.real_time


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten the waits for adapters that never respond."""
    monkeypatch.setattr(slcan, "_RESPONSE_SILENT_S", 0.02)
    monkeypatch.setattr(baud, "SEARCH_S", 0.2)
    monkeypatch.setattr(baud, "ONE_RATE_S", 0.2)


# Opening.


@pytest.mark.parametrize("responds", ["lawicel", "silent", "mute"])
def test_every_kind_of_adapter_opens_and_closes(responds: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if responds == "silent":
        monkeypatch.setattr(slcan, "_RESPONSE_S", 0.05)
    with FakeAdapter(responds=responds) as adapter:
        bus = SlcanBus(f"{adapter.channel}@2000000")
        wait_until(lambda: adapter.is_open and b"F" in adapter.received)
        commands = [command for command in adapter.received if command]
        assert commands[:2] == [b"C", b"V"]
        assert commands[-3:] == [b"S8", b"O", b"F"]
        adapter.send(b"T000000010\r")
        assert bus.receive(5, 0.0).frames[0][:2] == (1, b"")
        bus.shutdown()
        wait_until(lambda: not adapter.is_open)


def test_a_channel_left_open_by_another_program_is_closed_first() -> None:
    with FakeAdapter() as adapter:
        adapter.send(b"T000000018AAAA" + b"\rT000000010\r" * 100)
        bus = SlcanBus(adapter.channel)
        assert not bus.receive(0.02, 0.0)
        bus.shutdown()


@pytest.mark.parametrize(
    ("bitrate", "command", "what"),
    [(500_000, b"S6", "the bit rate of 500000 bit/s"), (1_000_000, b"O", "to open")],
)
async def test_an_open_command_that_is_refused_is_reported(bitrate: int, command: bytes, what: str) -> None:
    with FakeAdapter(refuses=(command,)) as adapter:
        with pytest.raises(PortOpenFailed, match=f"refuses {what}.*{command.decode()}"):
            await open_port(f"slcan:{adapter.channel}", bitrate=bitrate)
        adapter.refuses = ()
        SlcanBus(adapter.channel).shutdown()  # the device was released


@pytest.mark.parametrize(
    ("refuses", "codes"), [((b"S8",), ["bit_rate_fixed"]), ((b"C", b"", b"V", b"F"), [])], ids=["bit rate", "closing"]
)
def test_an_adapter_that_refuses_the_servos_bit_rate_or_to_close_a_closed_channel_is_used(
    refuses: tuple[bytes, ...], codes: list[str]
) -> None:
    with FakeAdapter(refuses=refuses) as adapter:
        bus = SlcanBus(adapter.channel)
        assert [note.code for note in bus.notes] == codes
        assert not codes or "BELL to S8" in bus.notes[0].text
        wait_until(lambda: adapter.is_open)
        adapter.send(b"T000000010\r")
        assert bus.receive(1, 0.0).frames[0][:2] == (1, b"")
        bus.shutdown()


async def test_an_adapter_that_cannot_be_opened_is_refused_with_the_reason() -> None:
    with FakeAdapter() as adapter:
        with pytest.raises(PortOpenFailed, match=r"does not support 300000 bit/s.*10000, 20000, .*1000000"):
            await open_port(f"slcan:{adapter.channel}", bitrate=300_000)
        assert adapter.received == []
        bus = SlcanBus(adapter.channel)
        with pytest.raises(PortOpenFailed, match="is using it"):
            await open_port(f"slcan:{adapter.channel}")
        bus.shutdown()
        SlcanBus(adapter.channel).shutdown()
        adapter.fill()
        with pytest.raises(PortOpenFailed, match="does not accept any data"):
            await open_port(f"slcan:{adapter.channel}")


# Receiving.


async def test_two_thousand_frames_at_once_arrive_complete_and_in_order() -> None:
    async with opened() as (adapter, port):
        received = received_by(port)
        text = b"".join(b"T%08X8%016X\r" % (0x1000_0000 | n % 60, n) for n in range(2000))
        await asyncio.to_thread(adapter.send, text)
        await until(lambda: len(received) == 2000)
        assert [int.from_bytes(frame.data, "big") for frame in received] == list(range(2000))
        assert [frame.id & 0xFF for frame in received[:120]] == [n % 60 for n in range(120)]
        stamps = [frame.at for frame in received]
        assert stamps == sorted(stamps)
        assert (port.statistics.rx_frames, port.statistics.rx_dropped, port.statistics.errors) == (2000, 0, 0)


async def test_invalid_data_between_frames_is_counted_and_the_bus_stays_active() -> None:
    async with opened() as (adapter, port):
        received = received_by(port)
        junk = bytes(range(256)).replace(b"\r", b"").replace(b"\a", b"")
        adapter.send((junk + b"\rT00000001255AA\rt1231FF\r") * 300)
        await until(lambda: len(received) == 300)
        assert {(frame.id, frame.data) for frame in received} == {(1, b"\x55\xaa")}
        assert port.state is PortState.ACTIVE
        assert (port.statistics.errors, port.statistics.ignored, port.statistics.error_frames) == (300, 300, 0)


# Sending.


async def test_frames_are_sent_in_order_and_a_stop_overtakes_them() -> None:
    async with opened() as (adapter, port):
        port.send([Frame(0x1F000001, n.to_bytes(2, "big")) for n in range(400)])
        await until(lambda: len(adapter.sent) > 20)
        port.send([Frame(0x10000001, b"stop")])
        written = port.statistics.tx_frames
        await until(lambda: len(adapter.sent) == 401)
        assert adapter.sent.index(b"T10000001473746F70") <= written + 10
        rest = [sent for sent in adapter.sent if sent != b"T10000001473746F70"]
        assert rest == [b"T1F0000012%04X" % n for n in range(400)]
        await until(lambda: port.statistics.tx_frames == 401)
        assert port.statistics.errors == 0


def test_several_frames_are_sent_in_one_write(monkeypatch: pytest.MonkeyPatch) -> None:
    with FakeAdapter() as adapter:
        bus = SlcanBus(adapter.channel, usb=UsbAdapter(native_usb=True))
        written: list[int] = []
        write, line = os.write, bus.fileno()

        def watched(descriptor: int, data: bytes) -> int:
            if descriptor == line:
                written.append(bytes(data).count(b"\r"))
            return write(descriptor, data)

        monkeypatch.setattr(serial_line.os, "write", watched)
        taken = bus.transmit([Frame(1, bytes(8))] * 100)
        assert written == [taken]
        assert 5 < taken <= 10
        wait_until(lambda: len(adapter.sent) == taken)
        bus.shutdown()


def test_no_more_is_written_than_the_bus_can_soon_transmit(monkeypatch: pytest.MonkeyPatch) -> None:
    with FakeAdapter() as adapter:
        bus = SlcanBus(adapter.channel, 10_000)  # 14 ms a frame
        now = time.monotonic()
        monkeypatch.setattr(slcan, "time", SimpleNamespace(monotonic=lambda: now, sleep=time.sleep))
        assert bus.transmit([Frame(1, bytes(8))] * 100) == 1
        assert bus.transmit([Frame(1, bytes(8))] * 100) == 0
        now += 0.02
        assert bus.transmit([Frame(1, bytes(8))] * 100) == 1
        bus.shutdown()


async def test_a_stuck_adapter_is_lost_and_queued_frames_are_never_sent() -> None:
    async with opened() as (adapter, port):
        adapter.fill()
        port.send([Frame(1, b"old")])
        await until(lambda: port.state is PortState.LOST)
        assert "no longer sends frames" in str(port.trouble)
        adapter.resume()
        await asyncio.sleep(0.05)
        assert adapter.sent == []


def test_after_a_partial_line_nothing_more_is_written(monkeypatch: pytest.MonkeyPatch) -> None:
    with FakeAdapter() as adapter:
        bus = SlcanBus(adapter.channel)
        monkeypatch.setattr(slcan, "_WRITE_S", 0.02)
        write, line, room = os.write, bus.fileno(), [7]

        def cramped(descriptor: int, data: bytes) -> int:
            if descriptor != line:
                return write(descriptor, data)
            if not room[0]:
                raise BlockingIOError
            taken = write(descriptor, data[: room[0]])
            room[0] -= taken
            return taken

        monkeypatch.setattr(serial_line.os, "write", cramped)
        with pytest.raises(OSError, match="only part of a line"):
            bus.transmit([Frame(1, b"moves")])
        room[0] = 1000
        with pytest.raises(OSError, match="only part of a line"):
            bus.transmit([Frame(2, b"")])
        bus.shutdown()
        time.sleep(0.02)
        assert adapter.received[-1] == b"F"


# Trouble.


@pytest.mark.parametrize("sending", [False, True])
async def test_an_unplugged_adapter_is_lost(sending: bool) -> None:
    async with opened() as (adapter, port):
        adapter.unplug()
        if sending:
            with contextlib.suppress(BusDisconnected):
                port.send([Frame(1, b"")])
        await until(lambda: port.state is PortState.LOST)
        assert f"slcan:{adapter.channel} was lost: " in str(port.trouble)
        with pytest.raises(BusDisconnected, match="Check the adapter and its cable"):
            port.send([Frame(1, b"")])


async def test_an_adapter_with_status_flags_that_stops_responding_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slcan, "_POLL_S", 0.02)
    monkeypatch.setattr(slcan, "_SILENT_S", 60.0)
    async with opened(FakeAdapter(flags=0)) as (adapter, port):
        await until(lambda: adapter.received.count(b"F") > 5)
        assert port.state is PortState.ACTIVE
        adapter.stall()
        monkeypatch.setattr(slcan, "_SILENT_S", 0.05)
        await until(lambda: port.state is PortState.LOST)
        assert "no longer responds" in str(port.trouble)


async def test_an_adapter_without_status_flags_may_stay_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slcan, "_POLL_S", 0.02)
    monkeypatch.setattr(slcan, "_SILENT_S", 0.04)
    async with opened() as (adapter, port):
        await asyncio.sleep(0.2)
        assert port.state is PortState.ACTIVE
        assert adapter.received.count(b"F") == 1


async def test_status_flags_set_passive_and_active(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slcan, "_POLL_S", 0.02)
    async with opened(FakeAdapter(flags=0x80)) as (adapter, port):  # flags of the time before opening
        adapter.flags = 0
        await asyncio.sleep(0.05)
        adapter.flags = 0x20
        await until(lambda: port.state is PortState.PASSIVE)
        assert "no node acknowledges" in str(port.trouble)
        adapter.flags = 0
        await until(lambda: port.state is PortState.ACTIVE)
        assert port.trouble is None
        assert port.statistics.error_frames == 1


async def test_an_adapter_that_refuses_every_frame_is_passive_and_reopened(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slcan, "_POLL_S", 60.0)  # reopened once
    # On a busy machine the responses to O and F may be late, and a late BELL to F would count as a refused frame.
    async with opened(FakeAdapter(flags=0)) as (adapter, port):
        await until(lambda: adapter.opened)
        seen = threading.Event()
        adapter.on_open = lambda: seen.wait(LIMIT_S)  # once reopened it is passive no longer
        adapter.off_bus = True
        opens = adapter.received.count(b"O")
        async with asyncio.timeout(LIMIT_S):  # a busy machine may report first that nothing was received
            while "no node acknowledges" not in str(port.trouble):
                port.send([Frame(1, b"")])
                await asyncio.sleep(0.02)
        await until(lambda: adapter.received.count(b"O") == opens + 1)
        seen.set()
        while port.state is PortState.PASSIVE:
            port.send([Frame(1, b"")])
            await asyncio.sleep(0.02)
        before = adapter.received[adapter.received.index(b"O") : len(adapter.received)]
        assert [command for command in before if command[:1] in b"CSO"] == [b"O", b"C", b"S8", b"O"]
        refused = sum(command[:1] == b"T" for command in before[: before.index(b"C")])
        assert refused - 2 <= port.statistics.errors - port.statistics.error_frames <= refused


async def test_unsolicited_reports_set_the_state_and_are_counted() -> None:
    async with opened() as (adapter, port):
        adapter.send(b"e1a\re1a\rsb252000\r")
        await until(lambda: port.state is PortState.BUS_OFF)
        adapter.send(b"sb252000\rsa000000\r")
        await until(lambda: port.state is PortState.ACTIVE)
        seen = port.statistics
        assert (seen.unacknowledged, seen.bus_offs, seen.error_frames, seen.errors) == (2, 1, 4, 4)


# As a python-can bus.


def test_it_is_a_python_can_bus() -> None:
    with FakeAdapter(flags=0) as adapter, SlcanBus(adapter.channel) as bus:
        adapter.send(b"T12345678255AA\rT000000010\re1a\r")
        messages = [bus.recv(1) for _ in range(3)]
        assert [message and message.arbitration_id for message in messages] == [0xA8, 0x12345678, 1]
        assert messages[0] is not None
        assert messages[0].is_error_frame
        assert bus.recv(0) is None
        bus.send(can.Message(arbitration_id=7, data=b"\x01"), timeout=1)
        for other in (can.Message(is_extended_id=False), can.Message(is_remote_frame=True), can.Message(is_fd=True)):
            with pytest.raises(can.CanOperationError, match="extended data frames"):
                bus.send(other)
        wait_until(lambda: adapter.sent == [b"T00000007101"])


def test_a_line_without_a_descriptor_works(monkeypatch: pytest.MonkeyPatch) -> None:
    bus = SlcanBus("loop://")  # a loopback
    monkeypatch.setattr(bus, "_own", None)
    assert bus.transmit([Frame(0x12345678, b"\x55")]) == 1
    received: list[Frame] = []
    for _ in range(100):
        received += bus.receive(0.05, 0.0).frames
        if received:
            break
    assert [frame[:2] for frame in received] == [(0x12345678, b"\x55")]
    bus.shutdown()


def test_a_system_that_does_not_report_unsent_bytes_has_no_backlog(monkeypatch: pytest.MonkeyPatch) -> None:
    line = SerialStream("loop://", 115_200)
    monkeypatch.setattr(line, "_port", object())
    assert line.backlog() == 0
