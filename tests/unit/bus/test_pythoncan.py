"""The tests of PythonCanPort: what its threads do with foreign frames, full adapters and lost ones."""

import asyncio
import errno
import queue
import threading
import time
from collections.abc import Callable
from pathlib import Path

import can
import pytest

from hornbill.bus.address import open_port
from hornbill.bus.ports import pythoncan
from hornbill.bus.ports.pythoncan import PythonCanPort
from hornbill.errors import BusDisconnected
from hornbill.wire.frame import Frame
from hornbill.wire.port import PortState


class Adapter(can.BusABC):
    """A python-can bus whose every move the test decides."""

    def __init__(self) -> None:
        super().__init__(channel="test")
        self.channel_info = "test"
        self.incoming: queue.Queue[can.Message | Exception] = queue.Queue()
        self.sent: list[tuple[int, bytes]] = []
        self.refuse: Exception | None = None
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
        self.gate.wait(5)
        if self.refuse is not None:
            raise self.refuse
        self.sent.append((msg.arbitration_id, bytes(msg.data)))


def opened(adapter: can.BusABC, address: str = "virtual:test") -> PythonCanPort:
    return PythonCanPort(adapter, address=address, bitrate=1_000_000)


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(5):
        while not condition():
            await asyncio.sleep(0.002)


def test_a_burst_wakes_the_loop_once() -> None:
    async def main() -> None:
        adapter = Adapter()
        port = opened(adapter)
        batches: list[list[Frame]] = []
        port.listen(batches.append)
        for number in range(200):
            adapter.incoming.put(can.Message(arbitration_id=number, data=b""))
        while port.statistics.rx_frames < 200:
            time.sleep(0.002)  # noqa: ASYNC251 - the loop is to be busy
        await asyncio.sleep(0.01)
        assert [[frame.id for frame in batch] for batch in batches] == [list(range(200))]
        await port.close()

    asyncio.run(main())


def test_a_loop_that_is_busy_for_too_long_loses_the_newest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pythoncan, "RX_LIMIT", 10)

    async def main() -> None:
        adapter = Adapter()
        port = opened(adapter)
        heard: list[Frame] = []
        port.listen(heard.extend)
        for number in range(15):
            adapter.incoming.put(can.Message(arbitration_id=number, data=b""))
        while port.statistics.rx_dropped < 5:
            time.sleep(0.002)  # noqa: ASYNC251 - the loop is to be busy
        await asyncio.sleep(0.01)
        assert [frame.id for frame in heard] == list(range(10))
        await port.close()

    asyncio.run(main())


def test_foreign_frames_are_counted_and_neither_they_nor_our_own_are_delivered() -> None:
    async def main() -> None:
        adapter = Adapter()
        port = opened(adapter)
        heard: list[Frame] = []
        port.listen(heard.extend)
        for message in (
            can.Message(arbitration_id=1, is_extended_id=False, data=b""),
            can.Message(arbitration_id=2, is_remote_frame=True),
            can.Message(arbitration_id=3, is_fd=True, data=bytes(12)),
            can.Message(is_error_frame=True),
            can.Message(arbitration_id=5, is_rx=False, data=b"echo"),
            can.Message(arbitration_id=4, data=b"ours"),
        ):
            adapter.incoming.put(message)
        await until(lambda: heard)
        assert [(frame.id, frame.data) for frame in heard] == [(4, b"ours")]
        seen = port.statistics
        assert (seen.ignored, seen.errors, seen.error_frames, seen.rx_frames, seen.rx_dropped) == (3, 1, 1, 1, 0)
        await port.close()

    asyncio.run(main())


def test_wall_clock_stamps_become_loop_time_and_others_are_replaced() -> None:
    async def main() -> None:
        adapter = Adapter()
        port = opened(adapter)
        heard: list[Frame] = []
        port.listen(heard.extend)
        loop = asyncio.get_running_loop()
        began = loop.time()
        for stamp in (time.time() - 0.25, 12.5, 0.0, time.time() + 3600):
            adapter.incoming.put(can.Message(timestamp=stamp, arbitration_id=1))
        await until(lambda: len(heard) == 4)
        old, *others = (frame.at for frame in heard)
        assert old == pytest.approx(began - 0.25, abs=0.15)
        assert all(began <= at <= loop.time() for at in others)
        await port.close()

    asyncio.run(main())


def test_an_urgent_frame_overtakes_what_is_queued() -> None:
    async def main() -> None:
        adapter = Adapter()
        adapter.gate.clear()
        port = opened(adapter)
        port.send([Frame(0x1000, bytes([number])) for number in range(50)])
        await asyncio.sleep(0.01)
        port.send([Frame(0x10, b"stop")])
        adapter.gate.set()
        await until(lambda: len(adapter.sent) == 51)
        assert adapter.sent[1] == (0x10, b"stop")  # the first was with the adapter already
        assert [data for number, data in adapter.sent if number == 0x1000] == [bytes([n]) for n in range(50)]
        await port.close()

    asyncio.run(main())


def test_a_full_kernel_queue_delays_and_can_still_be_overtaken() -> None:
    async def main() -> None:
        adapter = Adapter()
        adapter.refuse = can.CanOperationError("Failed to transmit", errno.ENOBUFS)
        port = opened(adapter)
        port.send([Frame(0x1000, b"a"), Frame(0x1000, b"b")])
        await asyncio.sleep(0.01)
        port.send([Frame(0x10, b"stop")])
        adapter.refuse = None
        await until(lambda: len(adapter.sent) == 3)
        assert adapter.sent == [(0x10, b"stop"), (0x1000, b"a"), (0x1000, b"b")]
        assert port.statistics.errors == 0
        await port.close()

    asyncio.run(main())


def test_a_refused_frame_is_counted_and_the_next_one_goes() -> None:
    async def main() -> None:
        adapter = Adapter()
        adapter.refuse = can.CanOperationError("Transmit buffer full")
        port = opened(adapter)
        port.send([Frame(1, b"")])
        await until(lambda: port.statistics.errors == 1)
        adapter.refuse = None
        port.send([Frame(2, b"")])
        await until(lambda: adapter.sent)
        assert adapter.sent == [(2, b"")]
        assert port.state is PortState.ACTIVE
        await port.close()

    asyncio.run(main())


def test_a_stale_frame_never_leaves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pythoncan, "STALE_S", 0.2)

    async def main() -> None:
        adapter = Adapter()
        adapter.gate.clear()
        port = opened(adapter)
        port.send([Frame(1, b"at once"), Frame(2, b"old")])
        await asyncio.sleep(0.25)
        port.send([Frame(3, b"fresh")])
        adapter.gate.set()
        await until(lambda: len(adapter.sent) == 2)
        assert [data for _, data in adapter.sent] == [b"at once", b"fresh"]
        assert port.statistics.errors == 1
        await port.close()

    asyncio.run(main())


@pytest.mark.parametrize("error", [can.CanOperationError("gone", errno.ENETDOWN), OSError("gone")])
def test_a_receive_thread_that_fails_means_the_bus_is_lost(error: Exception) -> None:
    async def main() -> None:
        adapter = Adapter()
        adapter.gate.clear()
        port = opened(adapter)
        port.send([Frame(1, b"first"), Frame(2, b"second")])
        await asyncio.sleep(0.01)
        adapter.incoming.put(error)
        await until(lambda: port.state is PortState.LOST)
        with pytest.raises(BusDisconnected, match="was lost"):
            port.send([Frame(3, b"")])
        adapter.gate.set()
        await port.close()
        assert adapter.sent == [(1, b"first")]
        assert port.state is PortState.DISCONNECTED

    asyncio.run(main())


def test_a_send_thread_that_fails_means_the_bus_is_lost() -> None:
    async def main() -> None:
        adapter = Adapter()
        adapter.refuse = OSError("write failed")
        port = opened(adapter)
        port.send([Frame(1, b"")])
        await until(lambda: port.state is PortState.LOST)
        await port.close()

    asyncio.run(main())


def test_a_few_garbled_messages_are_counted_and_a_stream_of_them_is_the_end() -> None:
    async def main() -> None:
        adapter = Adapter()
        port = opened(adapter)
        wrapped = can.CanOperationError("Could not read from serial device")
        wrapped.__cause__ = UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid")
        for item in (ValueError("invalid literal"), wrapped, can.Message(arbitration_id=5)):
            adapter.incoming.put(item)
        await until(lambda: port.statistics.rx_frames == 1)
        assert (port.state, port.statistics.errors) == (PortState.ACTIVE, 2)
        for _ in range(101):
            adapter.incoming.put(IndexError("string index out of range"))
        await until(lambda: port.state is PortState.LOST)
        await port.close()

    asyncio.run(main())


@pytest.mark.parametrize("interface", ["socketcan", "gs_usb"])
def test_error_frames_tell_the_state_and_are_counted_by_kind(interface: str) -> None:
    async def main() -> None:
        adapter = Adapter()
        port = opened(adapter, f"{interface}:can0")

        async def tell(identifier: int, data: bytes, state: PortState) -> None:
            adapter.incoming.put(can.Message(arbitration_id=identifier, is_error_frame=True, data=data))
            adapter.incoming.put(can.Message(arbitration_id=1))
            heard = port.statistics.rx_frames
            await until(lambda: port.statistics.rx_frames == heard + 1)
            assert port.state is state
            assert (port.trouble is None) == (state is PortState.ACTIVE)

        await tell(0x004, b"\0\x20", PortState.PASSIVE)
        await tell(0x040, b"", PortState.BUS_OFF)
        await tell(0x040, b"", PortState.BUS_OFF)
        assert "bit rate (1000000 bit/s)" in str(port.trouble)
        await tell(0x100, b"", PortState.ACTIVE)
        await tell(0x004, b"\0\x10", PortState.PASSIVE)
        await tell(0x020, b"", PortState.PASSIVE)
        await tell(0x004, b"\0\x08", PortState.ACTIVE)
        await tell(0x002, b"", PortState.ACTIVE)
        await tell(0x004, b"\0\x01", PortState.ACTIVE)
        seen = port.statistics
        assert (seen.bus_offs, seen.unacknowledged, seen.error_frames, seen.errors, seen.rx_dropped) == (1, 1, 7, 7, 1)
        await port.close()

    asyncio.run(main())


def test_error_frames_of_other_interfaces_are_counted_and_not_read() -> None:
    async def main() -> None:
        adapter = Adapter()
        port = opened(adapter, "pcan:PCAN_USBBUS1")
        adapter.incoming.put(can.Message(arbitration_id=0x060, is_error_frame=True))
        await until(lambda: port.statistics.error_frames == 1)
        assert (port.state, port.statistics.unacknowledged) == (PortState.ACTIVE, 0)
        await port.close()

    asyncio.run(main())


def test_a_lost_bus_says_why_and_counters_go_on_in_the_port_after_it() -> None:
    async def main() -> None:
        adapter = Adapter()
        port = opened(adapter, "pcan:PCAN_USBBUS1")
        assert port.trouble is None
        adapter.incoming.put(can.Message(arbitration_id=1))
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

    asyncio.run(main())


def test_frames_that_come_close_by_one_another_wake_an_idle_loop_a_few_times_only() -> None:
    async def main() -> None:
        adapter = Adapter()
        port = opened(adapter)
        batches: list[int] = []
        port.listen(lambda frames: batches.append(len(frames)))

        def send() -> None:
            for number in range(1000):
                adapter.incoming.put(can.Message(arbitration_id=number))
                time.sleep(5e-5)

        await asyncio.to_thread(send)
        await until(lambda: sum(batches) == 1000)
        assert len(batches) < 700
        await port.close()

    asyncio.run(main())


def test_the_threads_end_when_the_loop_ended_without_closing() -> None:
    adapter = Adapter()

    async def main() -> PythonCanPort:
        return opened(adapter)

    port = asyncio.run(main())
    adapter.incoming.put(can.Message(arbitration_id=1))
    for thread in port._threads:  # pyright: ignore[reportPrivateUsage]
        thread.join(5)
        assert not thread.is_alive()


def test_a_driver_that_hangs_does_not_hang_the_loop(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(pythoncan, "_CLOSE_S", 0.02)

    async def main() -> None:
        adapter = Adapter()
        adapter.gate.clear()
        port = opened(adapter)
        port.send([Frame(1, b"")])
        await asyncio.sleep(0.01)
        await port.close()
        assert "did not close" in caplog.text
        adapter.gate.set()
        monkeypatch.setattr(pythoncan, "_CLOSE_S", 5)
        await port.close()

    asyncio.run(main())


def test_fifty_openings_leave_no_thread_and_no_descriptor() -> None:
    async def use(number: int) -> None:
        port = await open_port(f"virtual:leak-{number}")
        port.listen(lambda frames: None)
        port.send([Frame(1, b"")])
        await port.close()

    async def main() -> None:
        descriptors = Path("/proc/self/fd")
        await use(0)
        threads = set(threading.enumerate())
        before = len(list(descriptors.iterdir())) if descriptors.is_dir() else 0  # noqa: ASYNC240
        for _ in range(5):
            await asyncio.gather(*(use(number) for number in range(10)))
        assert set(threading.enumerate()) <= threads
        after = len(list(descriptors.iterdir())) if descriptors.is_dir() else 0  # noqa: ASYNC240
        assert after == before

    asyncio.run(main())
