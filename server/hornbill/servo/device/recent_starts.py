"""Nodes that started too recently for anyone to have written to them, so that RAM equals ROM."""

from collections.abc import Callable

from hornbill.node.directory import NodeRecord
from hornbill.units import Instant

FRESH_UPTIME_S = 2
"""A node first seen with at most this uptime has just started and has not been written to."""

RESTARTED_UPTIME_S = 5
"""The same after an observed restart: some messages of the node may have been lost."""

GRANTED_WITHIN_S = 2.0
"""A node that we assigned an ID within this time has just started, whatever its uptime."""


class RecentStarts:
    """Nodes that have just started, each from the message that shows it until `remove`, after its rows were read."""

    def __init__(self, now: Callable[[], Instant], granted_at: Callable[[int], Instant | None]) -> None:
        """`granted_at` returns when we assigned a node ID on this bus, None if we did not."""
        self._now = now
        self._since: dict[int, tuple[int, Instant]] = {}
        self._granted_at = granted_at

    def on_status(self, node: int, uptime_s: int, at: Instant, *, restarted: bool) -> None:
        """Process a NodeStatus of a new node, or of one whose restart was noticed."""
        granted = self._granted_at(node)
        young = uptime_s <= (RESTARTED_UPTIME_S if restarted else FRESH_UPTIME_S)
        if young or (granted is not None and at - granted < GRANTED_WITHIN_S):
            self._since.setdefault(node, (uptime_s, at))

    def has_just_started(self, node: int, record: NodeRecord | None) -> bool:
        """Whether a node has just started, so that nothing can have been written to it.

        A node that was alone on the bus may first send queued old messages all at once. Its uptime then runs ahead of
        our clock since its apparent start.
        """
        if record is None or node not in self._since:
            return False
        uptime, since = self._since[node]
        return record.status.uptime_sec - uptime <= self._now() - since + 2

    def remove(self, node: int) -> None:
        """Remove a node whose rows have been read: from now on they may be written."""
        self._since.pop(node, None)

    def clear(self) -> None:
        """Remove all nodes: the bus was disconnected."""
        self._since.clear()
