"""Connection role: what hornbill may send on a bus that it shares with other programs."""

from enum import StrEnum


class ConnectionRole(StrEnum):
    """Role of hornbill on the connected bus, as in `GET /bus`."""

    HOST = "host"
    """The only program that configures and commands servos. Allocates node IDs."""
    GUEST = "guest"
    """Beside an autopilot: allocates no node IDs, reads little, and moves only servos that no other node commands."""
    OBSERVER = "observer"
    """Sends no frame, not even NodeStatus or Stop."""
