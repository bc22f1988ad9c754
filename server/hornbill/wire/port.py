"""CanPort: the interface of an adapter; PortWrapper: a port that wraps another."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import lru_cache
from typing import Any, Final, Protocol

from hornbill.errors import BusDisconnected, PortError
from hornbill.wire.frame import Frame

LOG_SCHEME: Final = "file:"
"""Address prefix of a recording: a receive-only bus."""

RECORDING_SCHEME: Final = "recording:"
"""Address prefix of a recording that includes the state of the servos."""

REPLAYS: Final = (LOG_SCHEME, RECORDING_SCHEME)


class PortState(StrEnum):
    """State of the adapter, as in `GET /bus`."""

    DISCONNECTED = "disconnected"
    CONNECTING = "connecting"
    ACTIVE = "active"
    PASSIVE = "passive"
    BUS_OFF = "bus_off"
    LOST = "lost"


@dataclass(slots=True)
class PortStatistics:
    """Counters since the port was opened. They continue over automatic reconnects.

    `busy_s` is the bus time taken by all frames, own and foreign, in seconds.
    """

    rx_frames: int = 0
    tx_frames: int = 0
    rx_dropped: int = 0
    """Frames lost to RX overruns."""
    ignored: int = 0
    """Standard, remote and CAN FD frames, which are not DroneCAN on classic CAN."""
    errors: int = 0
    """All errors: error frames, and frames that could not be sent."""
    error_frames: int = 0
    """Errors on the bus, whatever the sender. Few adapters report them."""
    unacknowledged: int = 0
    """Our transmissions that no node acknowledged. Few adapters report them."""
    bus_offs: int = 0
    reopened: int = 0
    """Number of automatic reconnects."""
    busy_s: float = 0.0
    line_bytes: int = 0
    """Bytes received on the serial line of a serial adapter."""


@dataclass(frozen=True, slots=True)
class Note:
    """A remark on a working adapter: a code and its values for programs, and a sentence for users."""

    code: str
    text: str
    params: Mapping[str, str | int | float] = field(default_factory=dict[str, "str | int | float"])


@dataclass(frozen=True, slots=True)
class SerialLineInfo:
    """The serial line between the computer and a serial adapter, 8 data bits without parity."""

    baud: int
    """Bit/s of the line."""
    found: bool = False
    """Whether the rate was detected rather than given in the address."""
    confirmed: bool = True
    """Whether anything well-formed was received at this rate."""
    native_usb: bool = False
    """Whether the adapter is on USB without a serial line in between: the rate has no effect and is no limit."""
    serial_number: str | None = None
    """USB serial number of the adapter; None if it has none."""
    latency_ms: int | None = None
    """Latency timer of an FTDI chip, ms; None for other chips and where the system does not report it."""
    frame_bytes: int = 27
    """Bytes of a full extended frame on the line. 27 in slcan."""

    BITS_PER_BYTE = 10
    FRAME_BYTES = 27
    """Bytes of a full extended frame in slcan."""

    @property
    def bytes_per_s(self) -> float | None:
        """Capacity of the line in each direction. None without a limit."""
        return None if self.native_usb else self.baud / self.BITS_PER_BYTE

    @property
    def budget(self) -> int | None:
        """Capacity of the line in each direction, full extended frames/s. None without a limit."""
        return None if self.bytes_per_s is None else int(self.bytes_per_s / self.frame_bytes)

    @property
    def slcan_bytes_per_s(self) -> float | None:
        """Capacity in bytes of slcan: less than `bytes_per_s` if frames take more bytes than there."""
        return None if self.bytes_per_s is None else self.bytes_per_s * self.FRAME_BYTES / self.frame_bytes


def line_bytes(frame: Frame) -> int:
    """Bytes of an extended frame in slcan."""
    return 11 + 2 * len(frame.data)


@dataclass(frozen=True, slots=True)
class PortDetails:
    """Properties of an adapter besides its state."""

    serial_line: SerialLineInfo | None = None
    notes: tuple[Note, ...] = ()
    frame_gap_s: float = 0.0
    """Pause between the frames of one transfer."""
    listen_only: bool = False
    """Whether the adapter neither sends nor acknowledges frames."""
    nothing_received: bool = False
    """Whether the adapter has been open for some time without receiving a frame."""
    round_trip_s: float = 0.0
    """Measured time to an adapter that is reached through others, and back, s. 0 for one of this computer."""


PLAIN: Final = PortDetails()
"""Details of a port without any."""

_FRAME_GAP: Final = re.compile(r"\?frame_gap_ms=([^?]*)$")


def split_frame_gap(address: str) -> tuple[str, str | None]:
    """Split the option `?frame_gap_ms=…` off an address. The second value is None without one."""
    found = _FRAME_GAP.search(address)
    return (address, None) if found is None else (address[: found.start()].strip(), found[1].strip())


def same_device(one: str, other: str) -> bool:
    """Whether two addresses name the same adapter. Options and the baud rate after @ are ignored."""
    return _device(one) == _device(other)


def _device(address: str) -> str:
    return re.sub(r"@\d+$", "", split_frame_gap(address)[0])


@lru_cache(maxsize=16)
def channel_name(address: str) -> str:
    """Channel name in logs: "can0" for `socketcan:can0`, "ttyACM0" for `slcan:/dev/ttyACM0`."""
    last = re.split(r"[:/\\]", address.partition("?")[0])[-1]
    return re.sub(r"\W+", "_", last, flags=re.ASCII) or "bus"


def not_connected(address: str, trouble: PortError | None) -> BusDisconnected:
    """The error for sending on a lost or closed port."""
    if trouble is None:
        text = f"{address} is not connected. Connect a bus and try again."
        return BusDisconnected(text, cause="bus_not_connected", address=address)
    facts: dict[str, Any] = {"cause": "bus_not_connected", "address": address, **trouble.facts}
    return BusDisconnected(f"{address} is not connected. {trouble.detail}", **facts)


FrameSink = Callable[[list[Frame]], None]
"""Called on the event loop with the frames received since the last call, in bus order."""


class CanPort(Protocol):
    """One connection to a CAN bus. All methods are called on the event loop; none blocks.

    `address` is `INTERFACE:CHANNEL`. Events on the bus never raise: they appear in `state`.
    """

    address: str
    bitrate: int
    statistics: PortStatistics

    @property
    def state(self) -> PortState:
        """Current state of the adapter."""
        ...

    @property
    def sample_point(self) -> float | None:
        """Sample point within a bit, 0..1. None if the adapter does not report it."""
        ...

    @property
    def trouble(self) -> PortError | None:
        """Problem of the adapter and its remedy. None while it works."""
        ...

    @property
    def retry_in_s(self) -> float | None:
        """Time until the next automatic reconnect, s. None while it works, and for a port that does not reconnect."""
        ...

    @property
    def details(self) -> PortDetails:
        """Further properties of the adapter."""
        ...

    def listen(self, sink: FrameSink) -> None:
        """Deliver received frames to `sink`. A port has one sink; a later call replaces it."""
        ...

    def send(self, frames: Sequence[Frame]) -> None:
        """Queue frames. They are sent in order of arbitration (lowest identifier first, equal ones in order).

        Raises BusDisconnected if the port is closed or lost, and ValueError for an invalid frame.
        """
        ...

    async def close(self) -> None:
        """Stop delivering, drop queued frames and release the adapter. Idempotent."""
        ...


class PortWrapper:
    """A port that wraps another and has its properties.

    Each wrapper implements `listen`, `send` and `close`: none is forwarded automatically.
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
        """Time until the port behind reconnects, s."""
        return self._behind.retry_in_s

    @property
    def details(self) -> PortDetails:
        """Details of the port behind."""
        return self._behind.details


class NoPort:
    """Placeholder for the port while no bus is connected."""

    address = ""
    bitrate = 0
    statistics = PortStatistics()
    state = PortState.DISCONNECTED
    sample_point: float | None = None
    trouble: PortError | None = None
    retry_in_s: float | None = None
    details = PLAIN


NO_PORT = NoPort()
