"""Fair scheduling of queued items for many nodes, each of which takes one at a time."""

from dataclasses import dataclass, field
from heapq import heappop, heappush
from typing import Generic, TypeVar

T = TypeVar("T")


@dataclass(slots=True)
class _Lane(Generic[T]):
    """Queue of one node, by priority and order of arrival. `token` is its position among the nodes."""

    waiting: list[tuple[int, int, T]] = field(default_factory=list[tuple[int, int, T]])
    busy: bool = False
    token: tuple[int, int] | None = None


class Lanes(Generic[T]):
    """One queue per node, served round-robin among the free nodes.

    The lowest priority number goes first. Among equal priorities, nodes take turns regardless of their IDs.
    """

    def __init__(self) -> None:
        self._lanes: dict[int, _Lane[T]] = {}
        self._ready: list[tuple[int, int, int]] = []
        self._turn = 0

    def put(self, node_id: int, priority: int, item: T) -> None:
        """Queue `item` for a node."""
        lane = self._lanes.get(node_id)
        if lane is None:
            lane = self._lanes[node_id] = _Lane[T]()
        self._turn += 1
        heappush(lane.waiting, (priority, self._turn, item))
        if not lane.busy and (lane.token is None or priority < lane.token[0]):
            self._queue(node_id, lane)

    def take(self) -> T | None:
        """Remove and return the next item, if any. Its node is busy until it is freed."""
        while self._ready:
            priority, turn, node_id = heappop(self._ready)
            lane = self._lanes[node_id]
            if lane.token == (priority, turn):
                lane.token = None
                lane.busy = True
                return heappop(lane.waiting)[2]
        return None

    def free(self, node_id: int) -> None:
        """Mark the node as free for its next item."""
        lane = self._lanes[node_id]
        lane.busy = False
        if lane.waiting and lane.token is None:
            self._turn += 1
            self._queue(node_id, lane)

    def preempt(self, node_id: int, priority: int, item: T) -> bool:
        """If a more urgent item waits, requeue a busy node's item ahead of its equals and free the node."""
        lane = self._lanes[node_id]
        if not lane.waiting or lane.waiting[0][0] >= priority:
            return False
        self._turn += 1
        heappush(lane.waiting, (priority, -self._turn, item))
        self.free(node_id)
        return True

    def clear(self) -> None:
        """Drop all queued items. A busy node stays busy until it is freed."""
        for lane in self._lanes.values():
            lane.waiting.clear()
            lane.token = None
        self._ready.clear()

    def __bool__(self) -> bool:
        """Whether an item may be ready to be taken; False if none is."""
        return bool(self._ready)

    def _queue(self, node_id: int, lane: _Lane[T]) -> None:
        lane.token = (lane.waiting[0][0], self._turn)
        heappush(self._ready, (*lane.token, node_id))
