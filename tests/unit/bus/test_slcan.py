"""Tests of slcan adapters: what they answer, refuse, lose and break, on a pseudo terminal."""

import asyncio
import contextlib
import os
import threading
import time
from collections.abc import Callable, Coroutine
from typing import Any

import can
import pytest

from hornbill.bus.adapters.serial_ports import UsbAdapter
from hornbill.bus.address import open_port
from hornbill.bus.ports import baud, serial_line, slcan
from hornbill.bus.ports.slcan import SlcanBus
from hornbill.errors import BusDisconnected, PortOpenFailed
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort, PortState

pytest.importorskip("termios", reason="pseudo terminals are a matter of POSIX")

from unit.bus.adapter import FakeAdapter, wait_until


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Do not wait as long as slow hardware needs for those that never answer."""
    monkeypatch.setattr(slcan, "_RESPONSE_S", 0.05)
    monkeypatch.setattr(slcan, "_RESPONSE_SILENT_S", 0.02)
    monkeypatch.setattr(baud, "SEARCH_S", 0.2)
    monkeypatch.setattr(baud, "ONE_RATE_S", 0.2)


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(5):
        while not condition():
            await asyncio.sleep(0.002)


def with_port(adapter: FakeAdapter, scenario: Callable[[CanPort], Coroutine[Any, Any, None]]) -> None:
    async def main() -> None:
        port = await open_port(f"slcan:{adapter.channel}")
        try:
            await scenario(port)
        finally:
            await port.close()

    with adapter:
        asyncio.run(main())


# Opening.


@pytest.mark.parametrize("answers", ["lawicel", "silent", "mute"])
def test_every_kind_of_adapter_opens_and_is_closed_again(answers: str) -> None:
    with FakeAdapter(answers=answers) as adapter:
        bus = SlcanBus(f"{adapter.channel}@2000000")
        wait_until(lambda: adapter.is_open)
        wait_until(lambda: b"F" in adapter.heard)
        spoken = [command for command in adapter.heard if command]
        assert spoken[:2] == [b"C", b"V"]
        assert spoken[-3:] == [b"S8", b"O", b"F"]
        adapter.say(b"T000000010\r")
        assert bus.receive(1, 0.0).frames[0][:2] == (1, b"")
        bus.shutdown()
        wait_until(lambda: not adapter.is_open)


def test_an_adapter_that_starts_anew_when_opened_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(baud, "SEARCH_S", 2.0)
    with FakeAdapter(boots_for_s=0.3) as adapter:
        SlcanBus(adapter.channel).shutdown()
        wait_until(lambda: adapter.heard[-1] == b"C")
        assert [command for command in adapter.heard if command][-6:] == [b"V", b"C", b"S8", b"O", b"F", b"C"]


def test_the_channel_another_program_left_open_is_closed_first() -> None:
    with FakeAdapter() as adapter:
        adapter.say(b"T000000018AAAA" + b"\rT000000010\r" * 100)
        bus = SlcanBus(adapter.channel)
        assert not bus.receive(0.02, 0.0)
        bus.shutdown()


@pytest.mark.parametrize(
    ("bitrate", "command", "what"),
    [(500_000, b"S6", "the bit rate of 500000 bit/s"), (1_000_000, b"O", "to open")],
)
def test_a_refused_command_is_told_with_what_was_refused(bitrate: int, command: bytes, what: str) -> None:
    with FakeAdapter(refuses=(command,)) as adapter:
        with pytest.raises(PortOpenFailed, match=f"refuses {what}.*{command.decode()}"):
            asyncio.run(open_port(f"slcan:{adapter.channel}", bitrate=bitrate))
        adapter.refuses = ()
        SlcanBus(adapter.channel).shutdown()  # the port was let go


def test_an_adapter_that_refuses_the_bit_rate_of_the_servos_is_used_with_a_note() -> None:
    with FakeAdapter(refuses=(b"S8",)) as adapter:
        bus = SlcanBus(adapter.channel)
        assert [note.code for note in bus.notes] == ["bit_rate_fixed"]
        assert "BELL to S8" in bus.notes[0].text
        wait_until(lambda: adapter.is_open)
        adapter.say(b"T000000010\r")
        assert bus.receive(1, 0.0).frames[0][:2] == (1, b"")
        bus.shutdown()


def test_an_adapter_that_has_nothing_open_to_close_may_refuse_that() -> None:
    with FakeAdapter(refuses=(b"C", b"", b"V", b"F")) as adapter:
        bus = SlcanBus(adapter.channel)
        assert not bus.receive(0.02, 0.0)
        bus.shutdown()


def test_a_bit_rate_slcan_does_not_have_is_told_with_those_it_has() -> None:
    with FakeAdapter() as adapter:
        with pytest.raises(PortOpenFailed, match=r"does not support 300000 bit/s.*10000, 20000, .*1000000"):
            asyncio.run(open_port(f"slcan:{adapter.channel}", bitrate=300_000))
        assert adapter.heard == []


def test_an_adapter_in_use_is_not_opened_a_second_time() -> None:
    with FakeAdapter() as adapter:
        bus = SlcanBus(adapter.channel)
        with pytest.raises(PortOpenFailed, match="is using it"):
            asyncio.run(open_port(f"slcan:{adapter.channel}"))
        bus.shutdown()
        SlcanBus(adapter.channel).shutdown()


def test_an_adapter_that_takes_not_one_byte_is_an_error() -> None:
    with FakeAdapter() as adapter:
        adapter.fill()
        with pytest.raises(PortOpenFailed, match="does not accept any data"):
            asyncio.run(open_port(f"slcan:{adapter.channel}"))


# Receiving.


def test_five_thousand_frames_at_once_arrive_in_order_and_whole() -> None:
    adapter = FakeAdapter()

    async def scenario(port: CanPort) -> None:
        heard: list[Frame] = []
        port.listen(heard.extend)
        text = b"".join(b"T%08X8%016X\r" % (0x1000_0000 | n % 60, n) for n in range(5000))
        await asyncio.to_thread(adapter.say, text)
        await until(lambda: len(heard) == 5000)
        assert [int.from_bytes(frame.data, "big") for frame in heard] == list(range(5000))
        assert [frame.id & 0xFF for frame in heard[:120]] == [n % 60 for n in range(120)]
        stamps = [frame.at for frame in heard]
        assert stamps == sorted(stamps)
        assert (port.statistics.rx_frames, port.statistics.rx_dropped, port.statistics.errors) == (5000, 0, 0)

    with_port(adapter, scenario)


def test_garbage_between_frames_is_counted_and_the_bus_stays_active() -> None:
    adapter = FakeAdapter()

    async def scenario(port: CanPort) -> None:
        heard: list[Frame] = []
        port.listen(heard.extend)
        junk = bytes(range(256)).replace(b"\r", b"").replace(b"\a", b"")
        adapter.say((junk + b"\rT00000001255AA\rt1231FF\r") * 300)
        await until(lambda: len(heard) == 300)
        assert {(frame.id, frame.data) for frame in heard} == {(1, b"\x55\xaa")}
        assert port.state is PortState.ACTIVE
        assert (port.statistics.errors, port.statistics.ignored, port.statistics.error_frames) == (300, 300, 0)

    with_port(adapter, scenario)


# Sending.


def test_frames_are_sent_in_order_and_a_stop_overtakes_them() -> None:
    adapter = FakeAdapter()

    async def scenario(port: CanPort) -> None:
        port.send([Frame(0x1F000001, n.to_bytes(2, "big")) for n in range(400)])
        await until(lambda: len(adapter.sent) > 20)
        port.send([Frame(0x10000001, b"stop")])
        written = port.statistics.tx_frames
        await until(lambda: len(adapter.sent) == 401)
        assert adapter.sent.index(b"T10000001473746F70") <= written + 10
        rest = [sent for sent in adapter.sent if sent != b"T10000001473746F70"]
        assert rest == [b"T1F0000012%04X" % n for n in range(400)]
        assert (port.statistics.tx_frames, port.statistics.errors) == (401, 0)

    with_port(adapter, scenario)


def test_several_frames_leave_in_one_write(monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_no_more_is_written_than_the_bus_can_carry_soon() -> None:
    with FakeAdapter() as adapter:
        bus = SlcanBus(adapter.channel, 10_000)  # 14 ms a frame
        assert bus.transmit([Frame(1, bytes(8))] * 100) == 1
        assert bus.transmit([Frame(1, bytes(8))] * 100) == 0
        time.sleep(0.02)
        assert bus.transmit([Frame(1, bytes(8))] * 100) == 1
        bus.shutdown()


def test_a_refused_frame_is_counted() -> None:
    adapter = FakeAdapter(refuses=(b"T000000010",))

    async def scenario(port: CanPort) -> None:
        port.send([Frame(1, b""), Frame(2, b"")])
        await until(lambda: port.statistics.errors == 1)
        assert port.state is PortState.ACTIVE
        assert adapter.sent == [b"T000000010", b"T000000020"]

    with_port(adapter, scenario)


def test_an_adapter_that_takes_no_more_is_lost_and_what_was_queued_never_leaves() -> None:
    adapter = FakeAdapter()

    async def scenario(port: CanPort) -> None:
        adapter.fill()
        began = time.monotonic()
        port.send([Frame(1, b"old")])
        await until(lambda: port.state is PortState.LOST)
        assert time.monotonic() - began < 3
        assert "no longer sends frames" in str(port.trouble)
        adapter.go_on()
        await asyncio.sleep(0.05)
        assert adapter.sent == []

    with_port(adapter, scenario)


def test_after_half_a_line_nothing_more_is_written(monkeypatch: pytest.MonkeyPatch) -> None:
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
        assert adapter.heard[-1] == b"F"


# Trouble.


@pytest.mark.parametrize("sending", [False, True])
def test_an_adapter_that_is_pulled_out_is_lost_within_a_second(sending: bool) -> None:
    adapter = FakeAdapter()

    async def scenario(port: CanPort) -> None:
        adapter.unplug()
        began = time.monotonic()
        if sending:
            with contextlib.suppress(BusDisconnected):
                port.send([Frame(1, b"")])
        await until(lambda: port.state is PortState.LOST)
        assert time.monotonic() - began < 1
        assert f"slcan:{adapter.channel} was lost: " in str(port.trouble)
        with pytest.raises(BusDisconnected, match="Check the adapter and its cable"):
            port.send([Frame(1, b"")])

    with_port(adapter, scenario)


def test_an_adapter_that_answers_no_more_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slcan, "_POLL_S", 0.02)
    monkeypatch.setattr(slcan, "_SILENT_S", 0.2)
    adapter = FakeAdapter(flags=0)

    async def scenario(port: CanPort) -> None:
        await asyncio.sleep(0.4)
        assert port.state is PortState.ACTIVE
        adapter.stall()
        await until(lambda: port.state is PortState.LOST)
        assert "no longer responds" in str(port.trouble)

    with_port(adapter, scenario)


def test_an_adapter_without_status_flags_may_be_silent_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slcan, "_POLL_S", 0.02)
    monkeypatch.setattr(slcan, "_SILENT_S", 0.04)
    adapter = FakeAdapter()

    async def scenario(port: CanPort) -> None:
        await asyncio.sleep(0.2)
        assert port.state is PortState.ACTIVE
        assert adapter.heard.count(b"F") == 1

    with_port(adapter, scenario)


def test_status_flags_tell_passive_and_active_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slcan, "_POLL_S", 0.02)
    adapter = FakeAdapter(flags=0x80)  # of before it was opened

    async def scenario(port: CanPort) -> None:
        adapter.flags = 0
        await asyncio.sleep(0.05)
        adapter.flags = 0x20
        await until(lambda: port.state is PortState.PASSIVE)
        assert "no node acknowledges" in str(port.trouble)
        adapter.flags = 0
        await until(lambda: port.state is PortState.ACTIVE)
        assert port.trouble is None
        assert port.statistics.error_frames == 1

    with_port(adapter, scenario)


def test_an_adapter_that_refuses_every_frame_is_passive_and_opened_anew() -> None:
    adapter = FakeAdapter()

    async def scenario(port: CanPort) -> None:
        adapter.off_bus = True
        opened, began = adapter.heard.count(b"O"), time.monotonic()
        while port.state is PortState.ACTIVE:
            port.send([Frame(1, b"")])
            await asyncio.sleep(0.02)
        assert 0.3 < time.monotonic() - began < 3
        assert "no node acknowledges" in str(port.trouble)
        await until(lambda: adapter.heard.count(b"O") == opened + 1)
        while port.state is PortState.PASSIVE:
            port.send([Frame(1, b"")])
            await asyncio.sleep(0.02)
        before = adapter.heard[adapter.heard.index(b"O") : len(adapter.heard)]
        assert [command for command in before if command[:1] in b"CSO"] == [b"O", b"C", b"S8", b"O"]
        refused = sum(command[:1] == b"T" for command in before[: before.index(b"C")])
        assert refused - 2 <= port.statistics.errors - port.statistics.error_frames <= refused

    with_port(adapter, scenario)


def test_what_an_adapter_tells_unasked_is_counted() -> None:
    adapter = FakeAdapter()

    async def scenario(port: CanPort) -> None:
        adapter.say(b"e1a\re1a\rsb255000\r")
        await until(lambda: port.state is PortState.BUS_OFF)
        adapter.say(b"sb255000\rsa000000\r")
        await until(lambda: port.state is PortState.ACTIVE)
        seen = port.statistics
        assert (seen.unacknowledged, seen.bus_offs, seen.error_frames, seen.errors) == (2, 1, 4, 4)

    with_port(adapter, scenario)


def test_twenty_openings_leave_no_thread_and_no_descriptor() -> None:
    adapter = FakeAdapter()

    async def main() -> None:
        for _ in range(20):
            await (await open_port(f"slcan:{adapter.channel}")).close()

    with adapter:
        threads, descriptors = threading.active_count(), len(os.listdir("/dev/fd"))  # noqa: PTH208
        asyncio.run(main())
        assert (threading.active_count(), len(os.listdir("/dev/fd"))) == (threads, descriptors)  # noqa: PTH208


# As any python-can bus.


def test_it_is_a_bus_of_python_can() -> None:
    with FakeAdapter(flags=0) as adapter, SlcanBus(adapter.channel) as bus:
        adapter.say(b"T12345678255AA\rT000000010\re1a\r")
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


def test_a_line_without_a_descriptor_works_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    bus = SlcanBus("loop://")  # it says back what it is told: so does every frame that comes
    monkeypatch.setattr(bus, "_own", None)
    assert bus.transmit([Frame(0x12345678, b"\x55")]) == 1
    heard: list[Frame] = []
    for _ in range(100):
        heard += bus.receive(0.05, 0.0).frames
        if heard:
            break
    assert [frame[:2] for frame in heard] == [(0x12345678, b"\x55")]
    bus.shutdown()
