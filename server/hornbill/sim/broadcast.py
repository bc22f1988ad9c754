"""What a servo says unasked: NodeStatus once a second, its angle ten times a second (table 2-2)."""

from collections.abc import Callable
from typing import Final

from hornbill.units import Instant
from hornbill.wire.messages import ActuatorStatus, Mode, NodeHealth, NodeStatus

NODE_STATUS_S: Final = 1.0
STATUS_S: Final = 0.1
_NEVER: Final = float("inf")
_ROUNDING_S: Final = 1e-6
_REPORTED_NOWHERE: Final = 0
"""Force, speed and power rating of Status are "not used" (table 2-22): these servos leave them 0."""


class Broadcast:
    """The two periodic messages of a servo with a node id. Begin it, then call `fire` at `due`."""

    __slots__ = ("_node_status_at", "_say", "_status_at")

    def __init__(self, say: Callable[[NodeStatus | ActuatorStatus], None]) -> None:
        self._say = say
        self._node_status_at: Instant = _NEVER
        self._status_at: Instant = _NEVER

    @property
    def due(self) -> Instant:
        """When the next message goes out; infinity without a node id."""
        return min(self._node_status_at, self._status_at)

    def begin(self, now: Instant) -> None:
        """A node id is there: say so at once."""
        self._node_status_at = self._status_at = now

    def stop(self) -> None:
        """Say nothing more."""
        self._node_status_at = self._status_at = _NEVER

    def fire(
        self, now: Instant, node_status: Callable[[Instant], NodeStatus], status: Callable[[], ActuatorStatus]
    ) -> None:
        """Send what is due. A servo that was kept from it sends once and goes on from now."""
        if self._node_status_at <= now:
            self._node_status_at = _next(self._node_status_at, NODE_STATUS_S, now)
            self._say(node_status(now))
        if self._status_at <= now:
            self._status_at = _next(self._status_at, STATUS_S, now)
            self._say(status())


def node_status(uptime_s: float, warnings: int, failures: int, mode: Mode = Mode.OPERATIONAL) -> NodeStatus:
    """Tables 2-17 to 2-19; notifications do not touch health. A servo that has no id yet cannot send it."""
    health = NodeHealth.ERROR if failures else NodeHealth.WARNING if warnings else NodeHealth.OK
    return NodeStatus(int(uptime_s + _ROUNDING_S), health, mode)


def actuator_status(servo_id: int, tenths: int, tenths_per_unit: float) -> ActuatorStatus:
    """Table 2-22, `tenths` being the current angle of 0x08."""
    nothing = _REPORTED_NOWHERE
    return ActuatorStatus(servo_id, tenths / tenths_per_unit, nothing, nothing, nothing)


def _next(at: Instant, period: float, now: Instant) -> Instant:
    after = at + period
    return after if after > now else now + period
