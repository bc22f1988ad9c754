"""A CanPort that records sent frames and delivers given ones, guarded or not."""

from collections.abc import Sequence

from hornbill.errors import BusDisconnected, PortError
from hornbill.node.guard import GuardedPort
from hornbill.node.role import ConnectionRole
from hornbill.wire.frame import Frame
from hornbill.wire.port import PLAIN, FrameSink, PortState, PortStatistics


class RecordingPort:
    """`sent` grows by every frame; `deliver` hands frames to the listener."""

    def __init__(self) -> None:
        self.address = "recording:0"
        self.bitrate = 1_000_000
        self.statistics = PortStatistics()
        self.state = PortState.ACTIVE
        self.sample_point: float | None = None
        self.trouble: PortError | None = None
        self.retry_in_s: float | None = None
        self.details = PLAIN
        self.sent: list[Frame] = []
        self.calls: list[list[Frame]] = []
        self.closed = False
        self._sink: FrameSink | None = None

    def listen(self, sink: FrameSink) -> None:
        """Store the sink."""
        self._sink = sink

    def send(self, frames: Sequence[Frame]) -> None:
        """Record the frames. Raises BusDisconnected unless the state is active."""
        if self.state is not PortState.ACTIVE:
            raise BusDisconnected(f"{self.address} is {self.state}. Connect it.", cause=None)
        self.calls.append(list(frames))
        self.sent.extend(frames)

    async def close(self) -> None:
        """Mark the port as closed."""
        self.closed = True
        self.state = PortState.DISCONNECTED

    def deliver(self, frames: Sequence[Frame]) -> None:
        """Deliver frames in one batch."""
        assert self._sink is not None
        self._sink(list(frames))


WRITABLE = frozenset({"0x20", "0x2A", "0x38", "0x12"})


def port(
    *, allow_broadcast: bool = False, writable: frozenset[str] = WRITABLE, role: ConnectionRole = ConnectionRole.HOST
) -> tuple[GuardedPort, RecordingPort]:
    """A guarded port and its inner port."""
    inner = RecordingPort()
    return GuardedPort(inner, writable=writable, allow_broadcast=allow_broadcast, role=role), inner
