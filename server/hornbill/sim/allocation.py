"""The node's side of dynamic node ID allocation: rules A to E of the public type (2.3)."""

from random import Random
from typing import Final

from hornbill.units import Instant, NodeId
from hornbill.wire.messages import AllocationMessage

_REQUEST_S: Final = (0.6, 1.0)
_FOLLOW_UP_S: Final = (0.0, 0.4)
_PART_BYTES: Final = 6
_NEVER: Final = float("inf")


class Allocatee:
    """Requests a node ID until one is assigned. `uid` has 16 bytes; `random` draws the delays of table 2-2.

    After `begin`, call `fire` at `due`, and `receive` with every Allocation message of other nodes.
    """

    __slots__ = ("_follow_up_at", "_offset", "_random", "_request_at", "_uid")

    def __init__(self, uid: bytes, random: Random) -> None:
        self._uid = uid
        self._random = random
        self._request_at: Instant = _NEVER
        self._follow_up_at: Instant = _NEVER
        self._offset = 0

    @property
    def due(self) -> Instant:
        """Time of the next request. Infinity if none is needed."""
        return self._follow_up_at if self._follow_up_at < self._request_at else self._request_at

    def begin(self, now: Instant) -> None:
        """Rule A: start requesting."""
        self._restart(now)

    def stop(self) -> None:
        """Stop requesting."""
        self._request_at = self._follow_up_at = _NEVER

    def fire(self, now: Instant) -> AllocationMessage:
        """Rule B, or the second half of rule D: return the request that is due."""
        if self._follow_up_at <= self._request_at:
            self._follow_up_at = _NEVER
            return AllocationMessage(0, False, self._uid[self._offset : self._offset + _PART_BYTES])
        self._restart(now)
        return AllocationMessage(0, True, self._uid[:_PART_BYTES])

    def receive(self, message: AllocationMessage, source: int, now: Instant) -> NodeId | None:
        """Rules C, D and E for a message from node `source` (0: another requester). Returns our assigned node ID."""
        if self._request_at == _NEVER:
            return None
        self._restart(now)
        known = message.unique_id
        if not source or not known or not self._uid.startswith(known):
            return None
        if len(known) < len(self._uid):
            self._offset = len(known)
            self._follow_up_at = now + self._random.uniform(*_FOLLOW_UP_S)
        elif message.node_id:
            self.stop()
            return NodeId(message.node_id)
        return None

    def _restart(self, now: Instant) -> None:
        """Rule C: restart the request timer and cancel a pending follow-up."""
        self._request_at = now + self._random.uniform(*_REQUEST_S)
        self._follow_up_at = _NEVER
