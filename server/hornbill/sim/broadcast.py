"""Periodic messages of a servo: NodeStatus once a second, Status ten times a second (table 2-2)."""

from collections.abc import Callable
from typing import Final

from hornbill.units import Instant
from hornbill.wire.messages import ActuatorStatus, Mode, NodeHealth, NodeStatus

NODE_STATUS_S: Final = 1.0
STATUS_S: Final = 0.1
_NEVER: Final = float("inf")
_ROUNDING_S: Final = 1e-6
_NOT_USED: Final = 0
"""Force, speed and power rating of Status are "not used" (table 2-22): these servos send 0."""


class Broadcast:
    """The two periodic messages of a servo with a node ID. Call `begin`, then `fire` at `due`."""

    __slots__ = ("_node_status_at", "_send", "_status_at")

    def __init__(self, send: Callable[[NodeStatus | ActuatorStatus], None]) -> None:
        self._send = send
        self._node_status_at: Instant = _NEVER
        self._status_at: Instant = _NEVER

    @property
    def due(self) -> Instant:
        """Time of the next message. Infinity without a node ID."""
        return self._status_at if self._status_at < self._node_status_at else self._node_status_at

    def begin(self, now: Instant) -> None:
        """Start sending, at once."""
        self._node_status_at = self._status_at = now

    def stop(self) -> None:
        """Stop sending."""
        self._node_status_at = self._status_at = _NEVER

    def fire(
        self, now: Instant, node_status: Callable[[Instant], NodeStatus], status: Callable[[], ActuatorStatus]
    ) -> None:
        """Send the messages that are due. After a delay, each is sent once and continues from now."""
        if self._node_status_at <= now:
            self._node_status_at = _next(self._node_status_at, NODE_STATUS_S, now)
            self._send(node_status(now))
        if self._status_at <= now:
            self._status_at = _next(self._status_at, STATUS_S, now)
            self._send(status())


def node_status(uptime_s: float, warnings: int, failures: int, mode: Mode = Mode.OPERATIONAL) -> NodeStatus:
    """Tables 2-17 to 2-19. Notifications do not affect health. A servo without a node ID cannot send it."""
    health = NodeHealth.ERROR if failures else NodeHealth.WARNING if warnings else NodeHealth.OK
    return NodeStatus(int(uptime_s + _ROUNDING_S), health, mode)


def actuator_status(servo_id: int, tenths: int, tenths_per_unit: float) -> ActuatorStatus:
    """Table 2-22. `tenths` is the current angle of 0x08."""
    return ActuatorStatus(servo_id, tenths / tenths_per_unit, _NOT_USED, _NOT_USED, _NOT_USED)


def _next(at: Instant, period: float, now: Instant) -> Instant:
    after = at + period
    return after if after > now else now + period
