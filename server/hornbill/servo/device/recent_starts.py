"""Which nodes started so lately that nobody can have written to them, so that RAM is what ROM holds."""

from collections.abc import Callable

from hornbill.node.directory import NodeRecord
from hornbill.units import Instant

FRESH_UPTIME_S = 2
"""A node first heard with at most this uptime has just started, so nobody has written to it yet."""

RESTARTED_UPTIME_S = 5
"""The same for one whose restart was noticed, which was heard until then: some of its messages may have been lost."""

GRANTED_WITHIN_S = 2.0
"""A node we gave its id so lately has just started, whatever uptime it tells."""


class RecentStarts:
    """A node is fresh from the message that proves it until `remove`, when its rows have been read."""

    def __init__(self, now: Callable[[], Instant], granted_at: Callable[[int], Instant | None]) -> None:
        """`granted_at` gives when we gave a node ID on this bus, None if we did not."""
        self._now = now
        self._since: dict[int, tuple[int, Instant]] = {}
        self._granted_at = granted_at

    def on_status(self, node: int, uptime_s: int, at: Instant, *, restarted: bool) -> None:
        """A NodeStatus of somebody who is new, or whose restart was noticed."""
        granted = self._granted_at(node)
        young = uptime_s <= (RESTARTED_UPTIME_S if restarted else FRESH_UPTIME_S)
        if young or (granted is not None and at - granted < GRANTED_WITHIN_S):
            self._since.setdefault(node, (uptime_s, at))

    def has_just_started(self, node: int, record: NodeRecord | None) -> bool:
        """Whether nobody can have written to a node since its start.

        A node that had nobody to hear it may first say, all at once, what it said long ago: then its uptime has
        run ahead of our clock since it seemed to start.
        """
        if record is None or node not in self._since:
            return False
        uptime, since = self._since[node]
        return record.status.uptime_sec - uptime <= self._now() - since + 2

    def remove(self, node: int) -> None:
        """Its rows were read: from now on anybody may write."""
        self._since.pop(node, None)

    def clear(self) -> None:
        """The bus went away."""
        self._since.clear()
