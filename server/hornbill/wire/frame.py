"""Owns Frame: one classic CAN data frame with a 29-bit identifier."""

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
