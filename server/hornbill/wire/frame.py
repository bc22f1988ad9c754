"""Frame: one classic CAN data frame with a 29-bit identifier; LoggedFrame: one of a recording."""

from typing import NamedTuple

from hornbill.units import Instant


class Frame(NamedTuple):
    """One frame of a DroneCAN bus.

    `id` is the 29-bit identifier, `data` its 0..8 bytes, `at` the instant its last bit was on the bus
    (seconds; 0.0 for a frame not yet sent).
    """

    id: int
    data: bytes
    at: Instant = 0.0


class LoggedFrame(NamedTuple):
    """One frame of a recording; `frame.at` is its time there: seconds since 1970 UTC, or since some start.

    `channel` is what the log calls the bus; `sent` is true for frames of ours.
    """

    frame: Frame
    channel: str
    sent: bool
