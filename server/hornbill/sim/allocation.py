"""A node's side of dynamic node-id allocation, rules A to E of the public type (2.3)."""

from random import Random
from typing import Final

from hornbill.units import Instant, NodeId
from hornbill.wire.messages import AllocationMessage

_REQUEST_S: Final = (0.6, 1.0)
_FOLLOW_UP_S: Final = (0.0, 0.4)
_PART_BYTES: Final = 6
_NEVER: Final = float("inf")


class Allocatee:
    """Asks for a node id until it is given one. `uid` has 16 bytes; `random` draws the delays of table 2-2.

    After `begin`, call `fire` at `due` and `hear` with every Allocation message of others.
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
        """When the next request goes out; infinity when there is nothing to ask for."""
        return min(self._request_at, self._follow_up_at)

    def begin(self, now: Instant) -> None:
        """Rule A: start to ask."""
        self._restart(now)

    def stop(self) -> None:
        """Ask no more."""
        self._request_at = self._follow_up_at = _NEVER

    def fire(self, now: Instant) -> AllocationMessage:
        """Rule B, or the second half of rule D: the request that is due."""
        if self._follow_up_at <= self._request_at:
            self._follow_up_at = _NEVER
            return AllocationMessage(0, False, self._uid[self._offset : self._offset + _PART_BYTES])
        self._restart(now)
        return AllocationMessage(0, True, self._uid[:_PART_BYTES])

    def hear(self, message: AllocationMessage, source: int, now: Instant) -> NodeId | None:
        """Rules C, D and E for a message from node `source` (0 is another that asks); our node id, once given."""
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
        """Rule C: the request timer starts anew, and a follow-up that waited is given up."""
        self._request_at = now + self._random.uniform(*_REQUEST_S)
        self._follow_up_at = _NEVER
