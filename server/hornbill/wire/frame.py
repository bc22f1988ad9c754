"""Frame: one classic CAN data frame with a 29-bit identifier; LoggedFrame: a frame of a recording."""

from typing import NamedTuple

from hornbill.units import Instant


class Frame(NamedTuple):
    """One frame of a DroneCAN bus.

    `id` is the 29-bit identifier, `data` its 0..8 bytes, `at` the time of its last bit on the bus
    (seconds; 0.0 for a frame not yet sent).
    """

    id: int
    data: bytes
    at: Instant = 0.0


class LoggedFrame(NamedTuple):
    """One frame of a recording; `frame.at` is its recorded time: seconds since 1970 UTC, or since an unknown start.

    `channel` is the name of the bus in the log; `sent` is true for frames we sent.
    """

    frame: Frame
    channel: str
    sent: bool
