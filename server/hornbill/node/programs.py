"""Names of programs on the bus, from their node name and behaviour."""

from collections.abc import Collection
from typing import Final

MAKERS_PROGRAM: Final = "Futaba's configuration program"

_NAMES: Final = (
    ("org.ardupilot", "ArduPilot"),
    ("org.pixhawk.", "PX4"),
    ("org.missionplanner", "Mission Planner"),
    ("org.dronecan.gui_tool", "DroneCAN GUI Tool"),
    ("org.uavcan.gui_tool", "UAVCAN GUI Tool"),
    ("org.hornbill", "another hornbill"),
)
"""By prefix of the GetNodeInfo name."""

_ARDUPILOT, _PX4 = 10, 1
"""Default node IDs of the autopilots."""


def by_name(name: str | None) -> str | None:
    """The program with this GetNodeInfo name. None if unknown."""
    return None if name is None else next((program for start, program in _NAMES if name.startswith(start)), None)


def by_commands(node_id: int, servo_ids: Collection[int]) -> str | None:
    """The autopilot that commands these servo IDs from this node ID by default. None if unknown.

    ArduPilot numbers its outputs from 1 in ArrayCommand, and PX4 from 0.
    """
    if node_id == _ARDUPILOT and servo_ids and 0 not in servo_ids:
        return "probably ArduPilot"
    return "probably PX4" if node_id == _PX4 and 0 in servo_ids else None
