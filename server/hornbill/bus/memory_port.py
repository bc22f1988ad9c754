"""Owns MemoryPort: one node's CAN controller on the embedded bus."""

from collections.abc import Sequence
from typing import Protocol

from hornbill.bus.transmit import QUEUE_LIMIT, TransmitQueue, check
from hornbill.errors import BusDisconnected
from hornbill.wire.frame import Frame
from hornbill.wire.port import FrameSink, PortState, PortStatistics

_PASSIVE_ABOVE = 127
_BUS_OFF_ABOVE = 255
_FAILURE = 8


class Wire(Protocol):
    """What a controller asks of the bus it sits on."""

    def offer(self, port: "MemoryPort", frames: Sequence[Frame]) -> None:
        """Let `frames` take part in arbitration from this instant on."""
        ...

    def withdraw(self, port: "MemoryPort") -> None:
        """Let what the port has queued take part no longer."""
        ...

    def leave(self, port: "MemoryPort") -> None:
        """Take the port off the bus."""
        ...


class MemoryPort:
    """A CanPort of a MemoryBus; made by `MemoryBus.port`.

    Its state follows the transmit error counter of a CAN controller: 8 up for a transmission that
    failed, 1 down for one that succeeded; passive above 127, bus-off above 255.
    """

    def __init__(self, wire: Wire, name: str, bitrate: int, limit: int = QUEUE_LIMIT) -> None:
        self.name = name
        self.address = f"memory:{name}"
        self.bitrate = bitrate
        self.statistics = PortStatistics()
        self.queue = TransmitQueue(limit)
        self.inbox: list[Frame] = []
        self._wire = wire
        self._sink: FrameSink | None = None
        self._error_count = 0
        self._open = True
        self._mute = False
        self.sample_point: float | None = None
        self.retry_in_s: float | None = None

    @property
    def trouble(self) -> str | None:
        """What a controller in this state needs; None while it works."""
        match self.state:
            case PortState.BUS_OFF:
                return f"{self.address} is off the bus after too many errors. Restart it."
            case PortState.PASSIVE:
                return f"{self.address} hears no acknowledgement or too many errors. Check wiring and power of the bus."
            case _:
                return None

    @property
    def state(self) -> PortState:
        """Active, passive or bus-off by the error counter; disconnected once closed."""
        if not self._open:
            return PortState.DISCONNECTED
        if self._error_count > _BUS_OFF_ABOVE:
            return PortState.BUS_OFF
        return PortState.PASSIVE if self._error_count > _PASSIVE_ABOVE else PortState.ACTIVE

    @property
    def taking_part(self) -> bool:
        """Whether this controller hears and acknowledges frames."""
        return self._open and self._error_count <= _BUS_OFF_ABOVE

    @property
    def mute(self) -> bool:
        """While true, frames sent here vanish before the wire, although the port counts them as sent."""
        return self._mute

    @mute.setter
    def mute(self, value: bool) -> None:
        self._mute = value
        if value:
            self._wire.withdraw(self)
            self.statistics.tx_frames += self.queue.clear()

    def listen(self, sink: FrameSink) -> None:
        """Deliver received frames to `sink`; what came before the first call is gone."""
        self._sink = sink

    def send(self, frames: Sequence[Frame]) -> None:
        """Queue `frames`. In bus-off they are dropped, each counted as an error.

        Raises BusDisconnected when the port is closed, ValueError for an impossible frame.
        """
        if not self._open:
            raise BusDisconnected(f"The port {self.address} is closed. Connect the bus again.")
        check(frames)
        if not self.taking_part:
            self.statistics.errors += len(frames)
        elif self._mute:
            self.statistics.tx_frames += len(frames)
        elif frames:
            self._wire.offer(self, frames)

    async def close(self) -> None:
        """Leave the bus; a frame already on the wire ends as it would have."""
        if self._open:
            self._wire.leave(self)
            self._open = False
            self._sink = None
            self.queue.clear()
            self.inbox.clear()

    # What the bus calls.

    def hand_over(self) -> None:
        """Give the frames in the inbox to the sink."""
        frames, self.inbox = self.inbox, []
        if self._sink is not None:
            self._sink(frames)

    def succeeded(self) -> None:
        """A frame of this port was acknowledged."""
        self.statistics.tx_frames += 1
        if 0 < self._error_count <= _BUS_OFF_ABOVE:
            self._error_count -= 1

    def failed(self, *, acknowledged: bool) -> None:
        """A frame of this port was destroyed, or nobody acknowledged it.

        Want of an acknowledgement makes a controller passive, never bus-off (ISO 11898-1, fault confinement).
        """
        self.statistics.errors += 1
        if acknowledged or self._error_count <= _PASSIVE_ABOVE:
            self._error_count += _FAILURE
        if self._error_count > _BUS_OFF_ABOVE:
            self.go_bus_off()

    def go_bus_off(self) -> None:
        """Take no part any more; what is queued is dropped, each frame counted as an error."""
        self._error_count = _BUS_OFF_ABOVE + 1
        self.statistics.errors += self.queue.clear()

    def recover(self) -> None:
        """Start again with an error count of zero, as after a restart of the controller."""
        self._error_count = 0
