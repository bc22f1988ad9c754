"""Types of numbers and names that must not be mixed: identifiers, times, raw values; and the text of serial numbers."""

from typing import NewType, TypeAlias

NodeId = NewType("NodeId", int)
"""Node ID, 1 to 127 (0 is anonymous). It may change at any time, so it is never used as a key (table 2-1)."""

ServoId = NewType("ServoId", int)
"""Servo ID (actuator ID, parameter 0x45), 0 to 254. ArrayCommand cannot address 0 (section 4.37)."""

Address = NewType("Address", int)
"""Register address of a parameter, 0x00 to 0x5F; on the wire the four characters `0xNN` (table 2-14)."""

Uid = NewType("Uid", str)
"""Unique ID of a node, 16 bytes as 32 lower-case hex digits: the only key of a servo (table 2-6)."""

Raw: TypeAlias = int
"""Integer value of a parameter on the wire, in the unit of the row."""

Instant: TypeAlias = float
"""Time on the event loop's monotonic clock, s. Durations are plain floats, s."""


def serial_text(model_number: int, product_number: int) -> str:
    """Serial number as printed on a servo: model number, hyphen, product number (section 4.41)."""
    return f"{model_number}-{product_number:06d}"
