"""Owns CanPort: what a participant needs from an adapter, and nothing more."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from hornbill.wire.frame import Frame


class PortState(StrEnum):
    """The adapter's state, in the words of `GET /bus`."""

    DISCONNECTED = "disconnected"
    CONNECTING = "connecting"
    ACTIVE = "active"
    PASSIVE = "passive"
    BUS_OFF = "bus_off"
    LOST = "lost"


@dataclass(slots=True)
class PortStatistics:
    """Counters since the port was opened. `busy_s` is bus time our own and foreign frames took, in seconds."""

    rx_frames: int = 0
    tx_frames: int = 0
    rx_dropped: int = 0
    errors: int = 0
    busy_s: float = 0.0


FrameSink = Callable[[list[Frame]], None]
"""Called on the event loop with every frame received since the last call, in bus order."""


class CanPort(Protocol):
    """One place on a CAN bus. All methods are called on the event loop; none blocks.

    `address` is `INTERFACE:CHANNEL`. A port never raises for what happens on the bus: it shows in `state`.
    """

    address: str
    bitrate: int
    statistics: PortStatistics

    @property
    def state(self) -> PortState:
        """What the adapter says of itself now."""
        ...

    def listen(self, sink: FrameSink) -> None:
        """Deliver received frames to `sink` from now on. A port has one sink; the last call wins."""
        ...

    def send(self, frames: Sequence[Frame]) -> None:
        """Queue frames; they leave in the order of bus arbitration (lowest identifier first, equal ones in turn).

        Raises BusDisconnected when the port is closed or lost, and ValueError for a frame no CAN
        controller could send.
        """
        ...

    async def close(self) -> None:
        """Stop delivering, drop what is queued, free the adapter. Closing twice is harmless."""
        ...
