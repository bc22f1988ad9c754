"""Owns CanPort: what a participant needs from an adapter, and nothing more."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Protocol

from hornbill.wire.frame import Frame

RECORDING: Final = "file:"
"""How the address of a recording begins: a bus that can only be listened to."""

BUNDLE: Final = "bundle:"
"""The same of a recording that also tells what was known of the servos."""

RECORDINGS: Final = (RECORDING, BUNDLE)


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
    """Counters since the port was opened; they go on when it is opened again by itself.

    `busy_s` is bus time our own and foreign frames took, in seconds.
    """

    rx_frames: int = 0
    tx_frames: int = 0
    rx_dropped: int = 0
    """Frames that came faster than they were taken."""
    ignored: int = 0
    """Standard, remote and CAN FD frames: not DroneCAN on classic CAN."""
    errors: int = 0
    """Everything that went wrong: error frames, and frames of ours that could not leave."""
    error_frames: int = 0
    """Errors seen on the wire, whoever sent; few adapters tell."""
    unacknowledged: int = 0
    """Our transmissions nobody acknowledged; few adapters tell."""
    bus_offs: int = 0
    reopened: int = 0
    """How often the adapter was opened again by itself."""
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

    @property
    def sample_point(self) -> float | None:
        """Where in a bit it is sampled, 0..1; None where the adapter does not tell."""
        ...

    @property
    def trouble(self) -> str | None:
        """What is wrong with the adapter and what helps, for people; None while it works."""
        ...

    @property
    def retry_in_s(self) -> float | None:
        """Seconds until it is opened again by itself; None while it works, and for a port that does not."""
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


class NoPort:
    """What stands for the port while no bus is connected."""

    address = ""
    bitrate = 0
    statistics = PortStatistics()
    state = PortState.DISCONNECTED
    sample_point: float | None = None
    trouble: str | None = None
    retry_in_s: float | None = None


NO_PORT = NoPort()
