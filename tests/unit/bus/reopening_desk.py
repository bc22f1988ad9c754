"""Adapters for the tests of ReopeningPort, controlled by the test."""

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, field

from hornbill.bus.reopening import ReopeningPort
from hornbill.errors import BusDisconnected, PortError, PortOpenFailed
from hornbill.wire.frame import Frame
from hornbill.wire.port import PLAIN, CanPort, FrameSink, PortDetails, PortState, PortStatistics


@dataclass(eq=False)
class Adapter:
    """An open adapter; the test sets its state."""

    statistics: PortStatistics
    close_s: float = 0.0
    address: str = "test:0"
    bitrate: int = 1_000_000
    state: PortState = PortState.ACTIVE
    sample_point: float | None = 0.8
    trouble: PortError | None = None
    retry_in_s: float | None = None
    details: PortDetails = PLAIN
    sink: FrameSink | None = None
    sent: list[Frame] = field(default_factory=list[Frame])
    closing: bool = False
    closed: bool = False

    def listen(self, sink: FrameSink) -> None:
        self.sink = sink

    def send(self, frames: Sequence[Frame]) -> None:
        if self.state in (PortState.LOST, PortState.DISCONNECTED):
            raise BusDisconnected("gone", cause=None)
        self.sent += frames
        self.statistics.tx_frames += len(frames)

    async def close(self) -> None:
        self.closing = True
        await asyncio.sleep(self.close_s)
        self.closed, self.state = True, PortState.DISCONNECTED


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
        self.opened[-1].state, self.opened[-1].trouble = (
            PortState.LOST,
            None if trouble is None else PortError(trouble, cause=None),
        )


def refusal(text: str = "There is no such device.") -> PortOpenFailed:
    return PortOpenFailed(text, cause=None, address="test:0")
