"""PythonCanPort: foreign frames, adapters that are full, fail or hang, and error frames."""

import asyncio
import errno
import queue
import threading
import time
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from types import SimpleNamespace

import can
import pytest

from hornbill.bus.address import open_port
from hornbill.bus.ports import link, pythoncan
from hornbill.bus.ports.pythoncan import PythonCanPort
from hornbill.errors import BusDisconnected
from hornbill.wire.frame import Frame
from hornbill.wire.port import PortState
from unit.bus.waiting import no_leaks, received_by, until

pytestmark = pytest.mark.real_time


class Adapter(can.BusABC):
    """A python-can bus controlled by the test."""

    def __init__(self) -> None:
        super().__init__(channel="test")
        self.channel_info = "test"
        self.incoming: queue.Queue[can.Message | Exception] = queue.Queue()
        self.sent: list[tuple[int, bytes]] = []
        self.refuse: Exception | None = None
        self.sending = False
        """Whether a frame has been passed to it: it is sent when the gate opens."""
        self.gate = threading.Event()
        self.gate.set()

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        try:
            item = self.incoming.get(timeout=timeout)
        except queue.Empty:
            return None, False
        if isinstance(item, Exception):
            raise item
        return item, False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.sending = True
        self.gate.wait(60)
        if self.refuse is not None:
            raise self.refuse
        self.sent.append((msg.arbitration_id, bytes(msg.data)))


def opened(adapter: can.BusABC, address: str = "virtual:test") -> PythonCanPort:
    return PythonCanPort(adapter, address=address, bitrate=1_000_000)


@pytest.fixture
def adapter() -> Adapter:
    return Adapter()


@pytest.fixture
@asynccontextmanager
async def port(adapter: Adapter) -> AsyncGenerator[PythonCanPort]:
    port = opened(adapter)
    yield port
    await port.close()


def incoming(adapter: Adapter, port: PythonCanPort, numbers: range, seen: Callable[[], int]) -> None:
    """Frames arrive while the loop is busy, until `seen` returns their number."""
    for number in numbers:
        adapter.incoming.put(can.Message(arbitration_id=number))
    while seen() < len(numbers):
        time.sleep(0.002)


async def test_a_burst_wakes_a_busy_loop_once_without_the_newest_frames_above_the_limit(
    adapter: Adapter, port: PythonCanPort, monkeypatch: pytest.MonkeyPatch
) -> None:
    batches: list[list[Frame]] = []
    port.listen(batches.append)
    monkeypatch.setattr(pythoncan, "RX_LIMIT", 200)
    incoming(adapter, port, range(205), lambda: port.statistics.rx_frames + port.statistics.rx_dropped)
    assert port.statistics.rx_dropped == 5
    await asyncio.sleep(0.01)
    assert [[frame.id for frame in batch] for batch in batches] == [list(range(200))]


async def test_foreign_frames_and_own_echoes_are_counted_and_not_delivered(
    adapter: Adapter, port: PythonCanPort
) -> None:
    received = received_by(port)
    for message in (
        can.Message(arbitration_id=1, is_extended_id=False, data=b""),
        can.Message(arbitration_id=2, is_remote_frame=True),
        can.Message(arbitration_id=3, is_fd=True, data=bytes(12)),
        can.Message(is_error_frame=True),
        can.Message(arbitration_id=5, is_rx=False, data=b"echo"),
        can.Message(arbitration_id=4, data=b"ours"),
    ):
        adapter.incoming.put(message)
    await until(lambda: received)
    assert [(frame.id, frame.data) for frame in received] == [(4, b"ours")]
    seen = port.statistics
    assert (seen.ignored, seen.errors, seen.error_frames, seen.rx_frames, seen.rx_dropped) == (3, 1, 1, 1, 0)


async def test_wall_clock_stamps_become_loop_time_and_others_are_replaced(
    adapter: Adapter, port: PythonCanPort, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(link, "_OLDEST_S", 600.0)
    received = received_by(port)
    loop = asyncio.get_running_loop()
    began = loop.time()
    age = min(500.0, began / 2)  # the clock of the loop may have started with the machine
    for stamp in (time.time() - age, 12.5, 0.0, time.time() + 3600):
        adapter.incoming.put(can.Message(timestamp=stamp, arbitration_id=1))
    await until(lambda: len(received) == 4)
    old, *others = (frame.at for frame in received)
    assert began - age - 0.01 <= old <= loop.time() - age
    assert all(began <= at <= loop.time() for at in others)


async def test_a_full_kernel_queue_delays_frames_and_can_be_overtaken(adapter: Adapter, port: PythonCanPort) -> None:
    adapter.refuse = can.CanOperationError("Failed to transmit", errno.ENOBUFS)
    port.send([Frame(0x1000, b"a"), Frame(0x1000, b"b")])
    await asyncio.sleep(0.01)
    port.send([Frame(0x10, b"stop")])
    adapter.refuse = None
    await until(lambda: len(adapter.sent) == 3)
    assert adapter.sent == [(0x10, b"stop"), (0x1000, b"a"), (0x1000, b"b")]
    assert port.statistics.errors == 0


async def test_a_refused_frame_is_counted_and_the_next_is_sent_until_a_failed_thread_means_the_bus_is_lost(
    adapter: Adapter, port: PythonCanPort
) -> None:
    adapter.refuse = can.CanOperationError("Transmit buffer full")
    port.send([Frame(1, b"")])
    await until(lambda: port.statistics.errors == 1)
    adapter.refuse = None
    port.send([Frame(2, b"")])
    await until(lambda: adapter.sent)
    assert (adapter.sent, port.state) == ([(2, b"")], PortState.ACTIVE)
    adapter.refuse = OSError("write failed")
    port.send([Frame(1, b"")])
    await until(lambda: port.state is PortState.LOST)


async def test_a_stale_frame_is_never_sent(
    adapter: Adapter, port: PythonCanPort, monkeypatch: pytest.MonkeyPatch
) -> None:
    waited_s = 0.0
    monkeypatch.setattr(pythoncan, "STALE_S", 60.0)
    monkeypatch.setattr(pythoncan, "time", SimpleNamespace(monotonic=lambda: time.monotonic() + waited_s))
    adapter.gate.clear()
    port.send([Frame(1, b"at once"), Frame(2, b"old")])
    await until(lambda: adapter.sending)
    waited_s = 61.0
    port.send([Frame(3, b"fresh")])
    adapter.gate.set()
    await until(lambda: len(adapter.sent) == 2)
    assert [data for _, data in adapter.sent] == [b"at once", b"fresh"]
    assert port.statistics.errors == 1


@pytest.mark.parametrize("error", [can.CanOperationError("gone", errno.ENETDOWN), OSError("gone")])
async def test_a_failed_receive_thread_means_the_bus_is_lost(
    adapter: Adapter, port: PythonCanPort, error: Exception
) -> None:
    adapter.gate.clear()
    port.send([Frame(1, b"first"), Frame(2, b"second")])
    await until(lambda: adapter.sending)
    adapter.incoming.put(error)
    await until(lambda: port.state is PortState.LOST)
    with pytest.raises(BusDisconnected, match="was lost"):
        port.send([Frame(3, b"")])
    adapter.gate.set()
    await port.close()
    assert adapter.sent == [(1, b"first")]
    assert port.state is PortState.DISCONNECTED


async def test_a_few_garbled_messages_are_counted_and_a_stream_of_them_loses_the_bus(
    adapter: Adapter, port: PythonCanPort
) -> None:
    wrapped = can.CanOperationError("Could not read from serial device")
    wrapped.__cause__ = UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid")
    for item in (ValueError("invalid literal"), wrapped, can.Message(arbitration_id=5)):
        adapter.incoming.put(item)
    await until(lambda: port.statistics.rx_frames == 1)
    assert (port.state, port.statistics.errors) == (PortState.ACTIVE, 2)
    for _ in range(101):
        adapter.incoming.put(IndexError("string index out of range"))
    await until(lambda: port.state is PortState.LOST)


@pytest.mark.parametrize("interface", ["socketcan", "gs_usb"])
async def test_error_frames_set_the_state_and_are_counted_by_kind(interface: str) -> None:
    adapter = Adapter()
    port = opened(adapter, f"{interface}:can0")

    async def report(identifier: int, data: bytes, state: PortState) -> None:
        adapter.incoming.put(can.Message(arbitration_id=identifier, is_error_frame=True, data=data))
        adapter.incoming.put(can.Message(arbitration_id=1))
        received = port.statistics.rx_frames
        await until(lambda: port.statistics.rx_frames == received + 1)
        assert port.state is state
        assert (port.trouble is None) == (state is PortState.ACTIVE)

    await report(0x004, b"\0\x20", PortState.PASSIVE)
    await report(0x040, b"", PortState.BUS_OFF)
    await report(0x040, b"", PortState.BUS_OFF)
    assert "bit rate (1000000 bit/s)" in str(port.trouble)
    await report(0x100, b"", PortState.ACTIVE)
    await report(0x004, b"\0\x10", PortState.PASSIVE)
    await report(0x020, b"", PortState.PASSIVE)
    await report(0x004, b"\0\x08", PortState.ACTIVE)
    await report(0x002, b"", PortState.ACTIVE)
    await report(0x004, b"\0\x01", PortState.ACTIVE)
    seen = port.statistics
    assert (seen.bus_offs, seen.unacknowledged, seen.error_frames, seen.errors, seen.rx_dropped) == (1, 1, 7, 7, 1)
    await port.close()


async def test_a_lost_bus_has_a_reason_and_the_next_port_continues_the_counters() -> None:
    adapter = Adapter()
    port = opened(adapter, "pcan:PCAN_USBBUS1")
    adapter.incoming.put(can.Message(arbitration_id=0x060, is_error_frame=True))  # not decoded: not of the kernel
    adapter.incoming.put(can.Message(arbitration_id=1))
    await until(lambda: port.statistics.rx_frames)
    seen = port.statistics
    assert (port.state, port.trouble, seen.error_frames, seen.unacknowledged) == (PortState.ACTIVE, None, 1, 0)
    adapter.incoming.put(can.CanOperationError("The USB device was pulled out."))
    await until(lambda: port.state is PortState.LOST)
    assert str(port.trouble) == (
        "pcan:PCAN_USBBUS1 was lost: The USB device was pulled out. Check the adapter and its cable."
    )
    await port.close()
    assert port.trouble is None
    next_adapter = Adapter()
    again = PythonCanPort(next_adapter, address="pcan:x", bitrate=1_000_000, statistics=port.statistics)
    next_adapter.incoming.put(can.Message(arbitration_id=1))
    await until(lambda: again.statistics.rx_frames == 2)
    again.send([Frame(1, b"")])
    await until(lambda: port.statistics.tx_frames == 1)
    await again.close()


async def test_closely_spaced_frames_wake_an_idle_loop_in_batches(adapter: Adapter, port: PythonCanPort) -> None:
    batches: list[int] = []
    port.listen(lambda frames: batches.append(len(frames)))

    def send() -> None:
        for number in range(1000):
            adapter.incoming.put(can.Message(arbitration_id=number))
            time.sleep(5e-5)

    await asyncio.to_thread(send)
    await until(lambda: sum(batches) == 1000)
    assert len(batches) < 700


def test_threads_end_if_the_loop_ended_without_closing_the_port() -> None:
    adapter = Adapter()

    async def main() -> PythonCanPort:
        return opened(adapter)

    port = asyncio.run(main())
    adapter.incoming.put(can.Message(arbitration_id=1))
    for thread in port._threads:  # pyright: ignore[reportPrivateUsage]
        thread.join(5)
        assert not thread.is_alive()


async def test_a_hanging_driver_does_not_hang_the_loop(
    adapter: Adapter, port: PythonCanPort, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(pythoncan, "_CLOSE_S", 0.02)
    adapter.gate.clear()
    port.send([Frame(1, b"")])
    await until(lambda: adapter.sending)
    await port.close()
    assert "did not close" in caplog.text
    adapter.gate.set()
    monkeypatch.setattr(pythoncan, "_CLOSE_S", 5)


async def test_opening_and_closing_leaves_no_thread_and_no_descriptor() -> None:
    async def use(number: int) -> None:
        port = await open_port(f"virtual:leak-{number}")
        port.listen(lambda frames: None)
        port.send([Frame(1, b"")])
        await port.close()

    await use(0)
    with no_leaks():
        for _ in range(2):
            await asyncio.gather(*(use(number) for number in range(10)))
