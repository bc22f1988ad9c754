"""CAN controller of one node on the embedded bus."""

from collections.abc import Sequence
from typing import Protocol

from hornbill.bus.transmit import QUEUE_LIMIT, TransmitQueue, check
from hornbill.errors import BusDisconnected, PortError
from hornbill.wire.frame import Frame
from hornbill.wire.port import PLAIN, FrameSink, PortState, PortStatistics

_PASSIVE_ABOVE = 127
_BUS_OFF_ABOVE = 255
_FAILURE = 8
_RECOVERED = 120
"""Receive error counter of a passive controller after a good frame (ISO 11898-1: 119 to 127)."""


class Wire(Protocol):
    """The bus of a controller."""

    def offer(self, port: "MemoryPort", frames: Sequence[Frame]) -> None:
        """Queue `frames` for arbitration from now on."""
        ...

    def withdraw(self, port: "MemoryPort") -> None:
        """Remove the queued frames of the port from arbitration."""
        ...

    def leave(self, port: "MemoryPort") -> None:
        """Remove the port from the bus."""
        ...


class MemoryPort:
    """A CanPort of a MemoryBus, created by `MemoryBus.port`.

    Its state follows the error counters of a CAN controller (ISO 11898-1, fault confinement). Transmit: +8 for a
    failed transmission, −1 for a successful one. Receive: +1 for an error (+8 for the first node to detect it), −1
    for a good frame. Passive if either is above 127, bus-off if transmit is above 255.
    """

    def __init__(self, wire: Wire, name: str, bitrate: int, limit: int = QUEUE_LIMIT, *, fits: bool = True) -> None:
        """`fits`: whether `bitrate` is that of the bus. If not, the port cannot exchange frames with others."""
        self.name = name
        self.fits = fits
        self.address = f"memory:{name}"
        self.bitrate = bitrate
        self.statistics = PortStatistics()
        self.queue = TransmitQueue(limit)
        self.inbox: list[Frame] = []
        """Frames received and not yet delivered to `sink`."""
        self.sink: FrameSink | None = None
        self._wire = wire
        self._error_count = 0
        self.receive_errors = 0
        """The receive error counter."""
        self._open = True
        self._mute = False
        self.sample_point: float | None = None
        self.retry_in_s: float | None = None
        self.details = PLAIN

    @property
    def trouble(self) -> PortError | None:
        """Problem and remedy in the current state. None while it works."""
        match self.state:
            case PortState.BUS_OFF:
                return PortError(
                    f"{self.address} is in bus-off after too many errors. Restart it.",
                    cause="bus_off", address=self.address,
                )  # fmt: skip
            case PortState.PASSIVE:
                return PortError(
                    f"{self.address} sees too many errors or no acknowledgement. Check wiring and power of the bus.",
                    cause="too_many_errors", address=self.address,
                )  # fmt: skip
            case _:
                return None

    @property
    def state(self) -> PortState:
        """ACTIVE, PASSIVE or BUS_OFF by the error counters. DISCONNECTED once closed."""
        if not self._open:
            return PortState.DISCONNECTED
        if self._error_count > _BUS_OFF_ABOVE:
            return PortState.BUS_OFF
        worse = max(self._error_count, self.receive_errors)
        return PortState.PASSIVE if worse > _PASSIVE_ABOVE else PortState.ACTIVE

    @property
    def taking_part(self) -> bool:
        """Whether this controller monitors the bus and may send."""
        return self._open and self._error_count <= _BUS_OFF_ABOVE

    @property
    def receives(self) -> bool:
        """Whether this controller receives and acknowledges frames."""
        return self.fits and self._open and self._error_count <= _BUS_OFF_ABOVE

    @property
    def mute(self) -> bool:
        """If true, frames are dropped before the wire, but counted as sent."""
        return self._mute

    @mute.setter
    def mute(self, value: bool) -> None:
        self._mute = value
        if value:
            self._wire.withdraw(self)
            self.statistics.tx_frames += self.queue.clear()

    def listen(self, sink: FrameSink) -> None:
        """Deliver received frames to `sink`. Frames received before the first call are lost."""
        self.sink = sink

    def send(self, frames: Sequence[Frame]) -> None:
        """Queue `frames`. In bus-off they are dropped, each counted as an error.

        Raises BusDisconnected if the port is closed, and ValueError for an invalid frame.
        """
        if not self._open:
            raise BusDisconnected(
                f"The port {self.address} is closed. Connect the bus again.", cause="port_closed", address=self.address
            )
        check(frames)
        if not self.taking_part:
            self.statistics.errors += len(frames)
        elif self._mute:
            self.statistics.tx_frames += len(frames)
        elif frames:
            self._wire.offer(self, frames)

    async def close(self) -> None:
        """Leave the bus. A frame already on the wire is completed."""
        if self._open:
            self._wire.leave(self)
            self._open = False
            self.sink = None
            self.queue.clear()
            self.inbox.clear()

    # Called by the bus.

    def count_received(self, frames: int) -> None:
        """Count frames received without an error."""
        if frames:
            before = _RECOVERED if self.receive_errors > _PASSIVE_ABOVE else self.receive_errors
            self.receive_errors = max(0, before - frames)

    def count_error(self, times: int = 1, *, first: bool = False) -> None:
        """Count errors on the bus. `first`: this controller detected them before all others."""
        self.statistics.errors += times
        self.statistics.error_frames += times
        self.receive_errors = min(_BUS_OFF_ABOVE, self.receive_errors + times * (_FAILURE if first else 1))

    def succeeded(self) -> None:
        """Count an acknowledged frame of this port."""
        self.statistics.tx_frames += 1
        if 0 < self._error_count <= _BUS_OFF_ABOVE:
            self._error_count -= 1

    def failed(self, *, acknowledged: bool) -> None:
        """Count a frame of this port that was destroyed or not acknowledged.

        A missing acknowledgement makes a controller passive, never bus-off (ISO 11898-1, fault confinement).
        """
        self.statistics.errors += 1
        self.statistics.error_frames += 1
        self.statistics.unacknowledged += not acknowledged
        if acknowledged or self._error_count <= _PASSIVE_ABOVE:
            self._error_count += _FAILURE
        if self._error_count > _BUS_OFF_ABOVE:
            self.go_bus_off()

    def go_bus_off(self) -> None:
        """Enter bus-off. Queued frames are dropped and counted as errors."""
        self._error_count = _BUS_OFF_ABOVE + 1
        self.statistics.bus_offs += 1
        self.statistics.errors += self.queue.clear()

    def recover(self) -> None:
        """Reset the error counters, as after a restart of the controller."""
        self._error_count = self.receive_errors = 0
