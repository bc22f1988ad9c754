"""The types of numbers and names that must not be mixed: identifiers, instants, raw values."""

from typing import NewType, TypeAlias

NodeId = NewType("NodeId", int)
"""A node's number on the bus, 1..127 (0 is anonymous). It changes under us: never a key (table 2-1)."""

ServoId = NewType("ServoId", int)
"""The actuator id of parameter 0x45, 0..254; 0 cannot be addressed by ArrayCommand (section 4.37)."""

Address = NewType("Address", int)
"""A parameter's register, 0x00..0x5F; on the wire it is the four characters `0xNN` (table 2-14)."""

Uid = NewType("Uid", str)
"""A node's 16-byte unique id as 32 lower-case hex digits: the only key of a servo (table 2-6)."""

Raw: TypeAlias = int
"""A parameter's integer on the wire; its unit is in the parameter's row."""

Instant: TypeAlias = float
"""Seconds on the event loop's monotonic clock. Durations are plain float seconds."""
