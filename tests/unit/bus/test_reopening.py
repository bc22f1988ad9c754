"""ReopeningPort: loss of the adapter, retries, reopening, closing at any instant, and queued frames."""

import asyncio
import errno
from collections.abc import AsyncGenerator, Sequence
from contextlib import asynccontextmanager

import can
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hornbill.bus.ports.pythoncan import PythonCanPort
from hornbill.bus.reopening import BUS_OFF_S, PAUSES_S, STEADY_S, ReopeningPort
from hornbill.errors import BusDisconnected, PortError, PortOpenFailed
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort, PortState, PortStatistics
from hornbill.wire.services import GetNodeInfoRequest
from jumping_clock import run
from unit.bus.test_pythoncan import Adapter as Scripted
from unit.bus.waiting import received_by, until
from unit.node.peer import participant
from unit.node.recording import RecordingPort


class Adapter(RecordingPort):
    """An open adapter; the test sets its state. Closing takes `close_s`."""

    def __init__(self, statistics: PortStatistics, close_s: float = 0.0) -> None:
        super().__init__()
        self.statistics = statistics
        self.sample_point = 0.8
        self._close_s = close_s

    def send(self, frames: Sequence[Frame]) -> None:
        super().send(frames)
        self.statistics.tx_frames += len(frames)

    async def close(self) -> None:
        await asyncio.sleep(self._close_s)
        await super().close()


class Desk:
    """Opens adapters, or raises `failure` if set; `times` are the instants of the attempts."""

    def __init__(self, *, open_s: float = 0.0, close_s: float = 0.0) -> None:
        self.open_s = open_s
        self.close_s = close_s
        self.failure: Exception | None = None
        self.opened: list[Adapter] = []
        self.times: list[float] = []

    async def open(self, statistics: PortStatistics) -> CanPort:
        self.times.append(asyncio.get_running_loop().time())
        assert all(one.closed for one in self.opened), "an adapter must be closed before it is opened again"
        await asyncio.sleep(self.open_s)
        if self.failure is not None:
            raise self.failure
        self.opened.append(Adapter(statistics, self.close_s))
        return self.opened[-1]

    def port(self) -> ReopeningPort:
        return ReopeningPort(self.open, address="test:0", bitrate=1_000_000)

    def lose(self, trouble: str | None = None) -> None:
        self.opened[-1].state = PortState.LOST
        self.opened[-1].trouble = None if trouble is None else PortError(trouble, cause=None)


def refusal(text: str = "There is no such device.") -> PortOpenFailed:
    return PortOpenFailed(text, cause=None, address="test:0")


@pytest.fixture
def desk() -> Desk:
    return Desk()


@pytest.fixture
@asynccontextmanager
async def port(desk: Desk) -> AsyncGenerator[ReopeningPort]:
    """An open port, closed and checked afterwards."""
    port = desk.port()
    await port.open()
    yield port
    await port.close()
    assert all(one.closed for one in desk.opened)
    assert asyncio.all_tasks() == {asyncio.current_task()}


async def test_an_open_port_forwards_to_its_adapter(desk: Desk, port: ReopeningPort) -> None:
    received = received_by(port)
    port.send([Frame(1, b"a")])
    adapter = desk.opened[0]
    adapter.deliver([Frame(2, b"b")])
    assert (adapter.sent, received) == ([Frame(1, b"a")], [Frame(2, b"b")])
    for state in (PortState.PASSIVE, PortState.ACTIVE):
        adapter.state = state
        await asyncio.sleep(10)
        assert port.state is state
    assert (port.sample_point, port.trouble, port.retry_in_s) == (0.8, None, None)
    assert (len(desk.opened), port.statistics.tx_frames, port.statistics.reopened) == (1, 1, 0)


async def test_a_lost_adapter_is_reported_at_once_and_reopened_after_the_first_pause(
    desk: Desk, port: ReopeningPort
) -> None:
    received = received_by(port)
    port.send([Frame(1, b"")])
    desk.lose("The cable is broken.")
    assert port.state is PortState.LOST
    await asyncio.sleep(0.1)
    assert (port.state, str(port.trouble)) == (PortState.LOST, "The cable is broken.")
    assert port.retry_in_s is not None
    assert 0 < port.retry_in_s <= PAUSES_S[0]
    await asyncio.sleep(0.2)
    assert (port.state, port.trouble, port.retry_in_s) == (PortState.ACTIVE, None, None)
    first, second = desk.opened
    assert first.closed
    assert second.sent == []
    second.deliver([Frame(3, b"")])
    assert received == [Frame(3, b"")]
    port.send([Frame(4, b"")])
    assert (port.statistics.tx_frames, port.statistics.reopened) == (2, 1)
    assert second.statistics is port.statistics


async def test_frames_sent_while_lost_are_never_sent(desk: Desk, port: ReopeningPort) -> None:
    desk.open_s = 0.5
    desk.lose()
    for _ in range(12):
        with pytest.raises(BusDisconnected):
            port.send([Frame(1, b"old")])
        await asyncio.sleep(0.05)
    assert port.state is PortState.CONNECTING
    assert port.retry_in_s == 0
    await asyncio.sleep(1)
    assert port.state is PortState.ACTIVE
    assert [one.sent for one in desk.opened] == [[], []]


async def test_pauses_grow_to_the_last_and_the_reason_is_the_latest(desk: Desk, port: ReopeningPort) -> None:
    desk.failure = refusal("The interface is down.")
    lost_at = asyncio.get_running_loop().time()
    desk.lose("Lost.")
    await asyncio.sleep(0.3)
    assert str(port.trouble) == "The interface is down."
    await asyncio.sleep(20)
    pauses = [after - before for before, after in zip([lost_at, *desk.times[1:]], desk.times[1:], strict=False)]
    expected = [*PAUSES_S, PAUSES_S[-1], PAUSES_S[-1]]
    assert pauses == [pytest.approx(pause, abs=0.06) for pause in expected]
    desk.failure = refusal("It is in use.")
    await asyncio.sleep(5)
    assert str(port.trouble) == "It is in use."


async def test_repeated_losses_lengthen_the_pause_until_the_adapter_is_steady(desk: Desk, port: ReopeningPort) -> None:
    for pause in PAUSES_S:
        desk.lose()
        await asyncio.sleep(pause - 0.01)
        assert port.state is PortState.LOST
        await asyncio.sleep(0.1)
        assert port.state is PortState.ACTIVE
    await asyncio.sleep(STEADY_S)
    await desk.opened[-1].close()  # from outside
    assert port.state is PortState.LOST
    await asyncio.sleep(PAUSES_S[0] + 0.1)
    assert port.state is PortState.ACTIVE, "steady in between"


async def test_a_controller_that_stays_bus_off_is_reopened(desk: Desk, port: ReopeningPort) -> None:
    adapter = desk.opened[0]
    adapter.state, adapter.trouble = PortState.BUS_OFF, PortError("Off the bus.", cause=None)
    with pytest.raises(BusDisconnected):
        port.send([Frame(1, b"")])
    await asyncio.sleep(BUS_OFF_S / 2)
    assert (port.state, str(port.trouble)) == (PortState.BUS_OFF, "Off the bus.")
    adapter.state, adapter.trouble = PortState.ACTIVE, None
    await asyncio.sleep(BUS_OFF_S)
    assert len(desk.opened) == 1, "it recovered automatically"
    adapter.state, adapter.trouble = PortState.BUS_OFF, PortError("Off the bus.", cause=None)
    await asyncio.sleep(BUS_OFF_S + 0.1)
    assert (port.state, str(port.trouble)) == (PortState.LOST, "Off the bus.")
    await asyncio.sleep(0.3)
    assert (port.state, len(desk.opened)) == (PortState.ACTIVE, 2)


async def test_an_exception_in_a_driver_does_not_end_the_retries(
    desk: Desk, port: ReopeningPort, caplog: pytest.LogCaptureFixture
) -> None:
    desk.failure = ZeroDivisionError("a defect")
    desk.lose()
    await asyncio.sleep(0.3)
    assert port.state is PortState.LOST
    assert port.trouble is not None
    assert "a defect" in str(port.trouble)
    desk.failure = None
    await asyncio.sleep(1)
    assert port.state is PortState.ACTIVE
    assert "could not be opened" in caplog.text


@settings(max_examples=60, deadline=None)
@given(
    until_s=st.floats(0, 4),
    open_s=st.sampled_from([0.0, 0.05, 0.7]),
    close_s=st.sampled_from([0.0, 0.03, 0.5]),
    losses=st.lists(st.floats(0.001, 1.5), max_size=4),
    broken=st.booleans(),
    first=st.booleans(),
)
def test_closing_at_any_instant_leaves_nothing_behind(
    until_s: float, open_s: float, close_s: float, losses: list[float], broken: bool, first: bool
) -> None:
    """While it opens for the first time, watches, closes, waits or reopens."""

    async def mishaps(desk: Desk) -> None:
        for pause in losses:
            await asyncio.sleep(pause)
            if desk.opened:
                desk.lose()
            desk.failure = refusal() if broken and desk.failure is None else None

    async def main() -> None:
        desk = Desk(open_s=open_s, close_s=close_s)
        port = desk.port()
        opening = asyncio.create_task(port.open() if first else port.open_with_retries())
        trouble = asyncio.create_task(mishaps(desk))
        await asyncio.sleep(until_s)
        await port.close()
        await port.close()
        assert port.state is PortState.DISCONNECTED
        assert (port.trouble, port.retry_in_s) == (None, None)
        with pytest.raises(BusDisconnected):
            port.send([Frame(1, b"")])
        trouble.cancel()
        await asyncio.gather(opening, trouble, return_exceptions=True)
        attempts = len(desk.times)
        await asyncio.sleep(20)
        assert all(one.closed for one in desk.opened)
        assert len(desk.times) == attempts
        assert asyncio.all_tasks() == {asyncio.current_task()}

    run(main())


# Requests and frames that are under way.


@pytest.mark.parametrize("state", [PortState.LOST, PortState.CONNECTING, PortState.DISCONNECTED])
async def test_requests_fail_at_once_in_every_disconnected_state(state: PortState) -> None:
    adapter = Adapter(PortStatistics())
    adapter.trouble = PortError("Plug it in.", cause=None)
    host = participant(adapter)
    host.start()
    waiting = asyncio.create_task(host.request(1, GetNodeInfoRequest(), timeout=60))
    await asyncio.sleep(0.12)
    adapter.state = state
    began = asyncio.get_running_loop().time()
    with pytest.raises(BusDisconnected, match="Plug it in"):
        await waiting
    assert asyncio.get_running_loop().time() - began <= 0.05
    sent = len(adapter.sent)
    with pytest.raises(BusDisconnected):
        await host.request(1, GetNodeInfoRequest())
    assert len(adapter.sent) == sent
    await host.close()


class Refusing(Scripted):
    """A python-can bus that may refuse frames, and reports error frames."""

    def __init__(self) -> None:
        super().__init__()
        self.refused = 0

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.refused += self.refuse is not None
        super().send(msg, timeout)

    def report(self, classes: int) -> None:
        """Receive an error frame of these classes (linux/can/error.h)."""
        self.incoming.put(can.Message(arbitration_id=classes, is_extended_id=False, is_error_frame=True, data=bytes(8)))


@pytest.mark.real_time
async def test_frames_queued_at_bus_off_are_never_sent() -> None:
    """With real threads: one frame is in the adapter, others are queued behind it."""
    opened: list[Refusing] = []

    async def open_it(statistics: PortStatistics) -> CanPort:
        opened.append(Refusing())
        return PythonCanPort(opened[-1], address="socketcan:x", bitrate=1_000_000, statistics=statistics)

    port = ReopeningPort(open_it, address="socketcan:x", bitrate=1_000_000)
    await port.open()
    adapter = opened[0]
    adapter.refuse = can.CanOperationError("no room", errno.ENOBUFS)
    port.send([Frame(number, b"old") for number in range(20)])
    await until(lambda: adapter.refused)
    adapter.report(0x040)
    await until(lambda: port.state is PortState.BUS_OFF)
    with pytest.raises(BusDisconnected):
        port.send([Frame(0x100, b"old")])
    await until(lambda: port.statistics.errors == 20 + 1)  # every frame dropped, and the error frame
    adapter.refuse = None
    adapter.report(0x100)
    await until(lambda: port.state is PortState.ACTIVE)
    port.send([Frame(0x200, b"new")])
    await until(lambda: port.statistics.tx_frames)
    await asyncio.sleep(0.02)
    assert [data for _, data in adapter.sent] == [b"new"]
    assert port.statistics.errors == 20 + 1
    await port.close()
