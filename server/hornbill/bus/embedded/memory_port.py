"""One node's CAN controller on the embedded bus."""

from collections.abc import Sequence
from typing import Protocol

from hornbill.bus.transmit import QUEUE_LIMIT, TransmitQueue, check
from hornbill.errors import BusDisconnected, PortError
from hornbill.wire.frame import Frame
from hornbill.wire.port import PLAIN, FrameSink, PortState, PortStatistics

_PASSIVE_ABOVE = 127
_BUS_OFF_ABOVE = 255
_FAILURE = 8
_HEARD_AGAIN = 120
"""Where the receive error counter of a passive controller goes on from with a good frame (ISO 11898-1: 119 to 127)."""


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

    Its state follows the error counters of a CAN controller (ISO 11898-1, fault confinement): transmit, 8 up
    for a transmission that failed, 1 down for one that succeeded; receive, 1 up for an error heard (8 for who
    hears it first), 1 down for a good frame. Passive when either is above 127, bus-off when transmit is above 255.
    """

    def __init__(self, wire: Wire, name: str, bitrate: int, limit: int = QUEUE_LIMIT, *, fits: bool = True) -> None:
        """`fits`: whether `bitrate` is that of the bus. One that does not fit understands nobody, nor anybody it."""
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
        """What a controller in this state needs; None while it works."""
        match self.state:
            case PortState.BUS_OFF:
                return PortError(
                    f"{self.address} is off the bus after too many errors. Restart it.",
                    cause="bus_off", address=self.address,
                )  # fmt: skip
            case PortState.PASSIVE:
                return PortError(
                    f"{self.address} hears no acknowledgement or too many errors. Check wiring and power of the bus.",
                    cause="too_many_errors", address=self.address,
                )  # fmt: skip
            case _:
                return None

    @property
    def state(self) -> PortState:
        """Active, passive or bus-off by the error counters; disconnected once closed."""
        if not self._open:
            return PortState.DISCONNECTED
        if self._error_count > _BUS_OFF_ABOVE:
            return PortState.BUS_OFF
        worse = max(self._error_count, self.receive_errors)
        return PortState.PASSIVE if worse > _PASSIVE_ABOVE else PortState.ACTIVE

    @property
    def taking_part(self) -> bool:
        """Whether this controller watches the bus, and may send."""
        return self._open and self._error_count <= _BUS_OFF_ABOVE

    @property
    def hears(self) -> bool:
        """Whether this controller understands frames, and acknowledges them."""
        return self.fits and self._open and self._error_count <= _BUS_OFF_ABOVE

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
        self.sink = sink

    def send(self, frames: Sequence[Frame]) -> None:
        """Queue `frames`. In bus-off they are dropped, each counted as an error.

        Raises BusDisconnected when the port is closed, ValueError for an impossible frame.
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
        """Leave the bus; a frame already on the wire ends as it would have."""
        if self._open:
            self._wire.leave(self)
            self._open = False
            self.sink = None
            self.queue.clear()
            self.inbox.clear()

    # What the bus calls.

    def heard_well(self, frames: int) -> None:
        """So many frames came without an error."""
        if frames:
            before = _HEARD_AGAIN if self.receive_errors > _PASSIVE_ABOVE else self.receive_errors
            self.receive_errors = max(0, before - frames)

    def misheard(self, times: int = 1, *, first: bool = False) -> None:
        """So many errors were on the wire; `first`: this controller saw them before all others."""
        self.statistics.errors += times
        self.statistics.error_frames += times
        self.receive_errors = min(_BUS_OFF_ABOVE, self.receive_errors + times * (_FAILURE if first else 1))

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
        self.statistics.error_frames += 1
        self.statistics.unacknowledged += not acknowledged
        if acknowledged or self._error_count <= _PASSIVE_ABOVE:
            self._error_count += _FAILURE
        if self._error_count > _BUS_OFF_ABOVE:
            self.go_bus_off()

    def go_bus_off(self) -> None:
        """Take no part any more; what is queued is dropped, each frame counted as an error."""
        self._error_count = _BUS_OFF_ABOVE + 1
        self.statistics.bus_offs += 1
        self.statistics.errors += self.queue.clear()

    def recover(self) -> None:
        """Start again with error counters of zero, as after a restart of the controller."""
        self._error_count = self.receive_errors = 0
