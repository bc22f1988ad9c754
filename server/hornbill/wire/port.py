"""CanPort: what a participant needs from an adapter, and nothing more; PortWrapper: a port in front of another."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import lru_cache
from typing import Any, Final, Protocol

from hornbill.errors import BusDisconnected, PortError
from hornbill.wire.frame import Frame

LOG_SCHEME: Final = "file:"
"""How the address of a recording begins: a bus that can only be listened to."""

RECORDING_SCHEME: Final = "recording:"
"""The same of a recording that also tells what was known of the servos."""

REPLAYS: Final = (LOG_SCHEME, RECORDING_SCHEME)


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
    line_bytes: int = 0
    """Bytes that came over the serial line of a serial adapter."""


@dataclass(frozen=True, slots=True)
class Note:
    """Something unusual about an adapter that works: a code and its values for programs, a sentence for people."""

    code: str
    text: str
    params: Mapping[str, str | int | float] = field(default_factory=dict[str, "str | int | float"])


@dataclass(frozen=True, slots=True)
class SerialLineInfo:
    """The serial line between the computer and a serial adapter, 8 data bits without parity."""

    baud: int
    """Bit/s of the line."""
    found: bool = False
    """Whether the rate was found by trying rather than given in the address."""
    confirmed: bool = True
    """Whether anything well-formed was received at this rate."""
    native_usb: bool = False
    """Whether the adapter is on USB without a serial line in between: the rate has no effect and is no limit."""
    serial_number: str | None = None
    """USB serial number of the adapter; None if it has none."""
    latency_ms: int | None = None
    """Latency timer of an FTDI chip, ms; None for other chips and where the system does not report it."""

    BITS_PER_BYTE = 10
    FRAME_BYTES = 27
    """Of a full extended frame as slcan writes it."""

    @property
    def bytes_per_s(self) -> float | None:
        """What the line carries in each direction; None without a limit."""
        return None if self.native_usb else self.baud / self.BITS_PER_BYTE

    @property
    def budget(self) -> int | None:
        """Full extended frames per second that the line carries in each direction; None without a limit."""
        return None if self.bytes_per_s is None else int(self.bytes_per_s / self.FRAME_BYTES)


def line_bytes(frame: Frame) -> int:
    """Bytes of an extended frame on a serial line, as slcan writes it."""
    return 11 + 2 * len(frame.data)


@dataclass(frozen=True, slots=True)
class PortDetails:
    """What is known of an adapter beyond its state."""

    serial_line: SerialLineInfo | None = None
    notes: tuple[Note, ...] = ()
    frame_gap_s: float = 0.0
    """Pause between the frames of one transfer."""
    nothing_received: bool = False
    """Whether the adapter has been open for a while and no frame was ever received."""


PLAIN: Final = PortDetails()
"""The details of a port that has none."""

_FRAME_GAP: Final = re.compile(r"\?frame_gap_ms=([^?]*)$")


def split_frame_gap(address: str) -> tuple[str, str | None]:
    """An address without its option `?frame_gap_ms=…`, and what that says; None without one."""
    found = _FRAME_GAP.search(address)
    return (address, None) if found is None else (address[: found.start()].strip(), found[1].strip())


def same_device(one: str, other: str) -> bool:
    """Whether two addresses name one adapter: options and the baud rate after @ make no difference."""
    return _device(one) == _device(other)


def _device(address: str) -> str:
    return re.sub(r"@\d+$", "", split_frame_gap(address)[0])


@lru_cache(maxsize=16)
def channel_name(address: str) -> str:
    """What a log calls the channel: "can0" of `socketcan:can0`, "ttyACM0" of `slcan:/dev/ttyACM0`."""
    last = re.split(r"[:/\\]", address.partition("?")[0])[-1]
    return re.sub(r"\W+", "_", last, flags=re.ASCII) or "bus"


def not_connected(address: str, trouble: PortError | None) -> BusDisconnected:
    """The refusal of whatever would be sent to a port that is lost or closed."""
    if trouble is None:
        text = f"{address} is not connected. Connect a bus and try again."
        return BusDisconnected(text, cause="bus_not_connected", address=address)
    facts: dict[str, Any] = {"cause": "bus_not_connected", "address": address, **trouble.facts}
    return BusDisconnected(f"{address} is not connected. {trouble.detail}", **facts)


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
    def trouble(self) -> PortError | None:
        """What is wrong with the adapter and what helps, for people; None while it works."""
        ...

    @property
    def retry_in_s(self) -> float | None:
        """Seconds until it is opened again by itself; None while it works, and for a port that does not."""
        ...

    @property
    def details(self) -> PortDetails:
        """What else is known of the adapter."""
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


class PortWrapper:
    """A port in front of another one, with the facts of the one behind.

    What passes is for each wrapper to say: `listen`, `send` and `close` are never handed on by themselves.
    """

    def __init__(self, behind: CanPort) -> None:
        self.address = behind.address
        self.bitrate = behind.bitrate
        self.statistics = behind.statistics
        self._behind = behind

    @property
    def state(self) -> PortState:
        """State of the port behind."""
        return self._behind.state

    @property
    def sample_point(self) -> float | None:
        """Sample point of the port behind."""
        return self._behind.sample_point

    @property
    def trouble(self) -> PortError | None:
        """Trouble of the port behind."""
        return self._behind.trouble

    @property
    def retry_in_s(self) -> float | None:
        """Seconds until the port behind is opened again."""
        return self._behind.retry_in_s

    @property
    def details(self) -> PortDetails:
        """Details of the port behind."""
        return self._behind.details


class NoPort:
    """What stands for the port while no bus is connected."""

    address = ""
    bitrate = 0
    statistics = PortStatistics()
    state = PortState.DISCONNECTED
    sample_point: float | None = None
    trouble: PortError | None = None
    retry_in_s: float | None = None
    details = PLAIN


NO_PORT = NoPort()
