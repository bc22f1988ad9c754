"""Recent messages and responses of one node ID, observed from bus traffic."""

from collections import deque
from collections.abc import Iterable
from typing import Final

from hornbill.units import Instant

RESPONSE_WITHIN_S: Final = 0.3
"""A response counts as lost after this time if the node keeps sending."""

GAP_S: Final = 1.0
"""A node that sends Status ten times a second and is silent for this long was offline or restarted."""

_STREAM: Final = 8
_TRANSFER_IDS: Final = 32
_MOST_LOST: Final = 3
"""Consecutive lost messages allowed before a transfer ID counts as another counter."""

_SWITCHES: Final = 5
_EACH: Final = 3


def two_counters(transfer_ids: Iterable[int]) -> bool:
    """Whether the transfer IDs (0 to 31, oldest first) of one message type come from two alternating nodes.

    Each node counts its own messages, so two nodes with one node ID show two interleaved counters. A restart, frame
    loss, or a node with its own counting scheme does not.
    """
    last: list[int] = []
    shares = [0, 0]
    switches, exact, current = 0, 0, 0
    for transfer_id in transfer_ids:
        gaps = [(transfer_id - each - 1) % _TRANSFER_IDS for each in last]
        fitting = [(gap, index == current, index) for index, gap in enumerate(gaps) if gap <= _MOST_LOST]
        if fitting:
            gap, _, chosen = min(fitting)
            exact += gap == 0
        elif len(last) < 2:
            last.append(transfer_id)
            chosen = len(last) - 1
        else:
            return False
        last[chosen] = transfer_id
        shares[chosen] += 1
        switches += chosen != current
        current = chosen
    return min(shares) >= _EACH and switches >= _SWITCHES and 2 * exact >= sum(shares) - len(last)


class MessageTimes:
    """Recent messages of one type."""

    __slots__ = ("_at", "_ids", "_next", "_odd")

    def __init__(self) -> None:
        self._ids: deque[int] = deque(maxlen=_STREAM)
        self._at: Instant = float("-inf")
        self._next = -1
        self._odd = 0  # messages until the last out-of-sequence one has left the window

    def take(self, transfer_id: int, at: Instant) -> None:
        """Record a message."""
        self._ids.append(transfer_id)
        self._at = at
        self._odd = max(0, self._odd - 1) if transfer_id == self._next else _STREAM
        self._next = (transfer_id + 1) % _TRANSFER_IDS

    def doubled(self, now: Instant, period_s: float) -> bool:
        """Whether two nodes send this message now, each every `period_s` seconds."""
        return self._odd > 0 and now - self._at < 3 * period_s and two_counters(self._ids)


class RequestWatch:
    """Requests for one service to one node, and their responses."""

    __slots__ = ("_open", "_timed_out", "lost", "responded", "unanswered", "unanswered_since")

    def __init__(self) -> None:
        self.lost: deque[Instant] = deque(maxlen=256)
        """Times of requests without a response although the node was present."""
        self.responded = False
        """Whether any response was ever received."""
        self.unanswered = 0
        """Lost requests since the last response."""
        self.unanswered_since: Instant | None = None
        self._open: dict[int, Instant] = {}
        self._timed_out: dict[int, Instant] = {}

    def on_request(self, transfer_id: int, at: Instant) -> None:
        """Record a sent request."""
        self._open[transfer_id] = at

    def on_response(self, transfer_id: int) -> None:
        """Record a response, in time or late."""
        if self._open.pop(transfer_id, None) is None and (at := self._timed_out.pop(transfer_id, None)) in self.lost:
            self.lost.remove(at)  # late, not lost
        self.responded = True
        self.unanswered, self.unanswered_since = 0, None

    def on_other_message(self, now: Instant) -> None:
        """Count overdue requests as lost, because the node sent another message."""
        if not self._open:
            return
        due = now - RESPONSE_WITHIN_S
        for transfer_id, at in tuple(self._open.items()):
            if at < due:
                del self._open[transfer_id]
                self._timed_out[transfer_id] = at
                self.lost.append(at)
                self.unanswered += 1
                self.unanswered_since = at if self.unanswered_since is None else self.unanswered_since

    def forget(self) -> None:
        """Clear pending and lost requests after a restart of the node."""
        self._open.clear()
        self.lost.clear()
        self.unanswered, self.unanswered_since = 0, None


class NodeWatch:
    """One node ID."""

    __slots__ = (
"info", "last_seen", "node_statuses", "registers", "round_trips", "servo_id", "servo_id_at", "servo_id_since",
        "statuses", "uptime_s",
    )  # fmt: skip

    def __init__(self) -> None:
        self.last_seen: Instant = float("-inf")
        """Time of its last NodeStatus or Status."""
        self.uptime_s = 0
        self.node_statuses = MessageTimes()
        self.statuses = MessageTimes()
        self.servo_id: int | None = None
        """Servo ID in its Status. None for a node without Status."""
        self.servo_id_at: Instant = float("-inf")
        self.servo_id_since: Instant = float("-inf")
        """Start of its present servo ID without a gap."""
        self.registers = RequestWatch()
        self.info = RequestWatch()
        self.round_trips: deque[tuple[Instant, float]] = deque(maxlen=100)
        """Time and duration of responses, s."""

    def on_node_status(self, transfer_id: int, uptime_s: int, at: Instant) -> None:
        """Record a NodeStatus."""
        self.node_statuses.take(transfer_id, at)
        restarted, self.uptime_s = uptime_s < self.uptime_s, uptime_s
        self._seen(at, restarted=restarted or at - self.last_seen > 3 * GAP_S)

    def on_status(self, transfer_id: int, servo_id: int, at: Instant) -> None:
        """Record an actuator Status."""
        self.statuses.take(transfer_id, at)
        away = at - self.servo_id_at > GAP_S
        if servo_id != self.servo_id or away:
            self.servo_id_since = at
        self.servo_id, self.servo_id_at = servo_id, at
        self._seen(at, restarted=away)

    def _seen(self, at: Instant, *, restarted: bool) -> None:
        self.last_seen = at
        if restarted:
            self.registers.forget()
            self.info.forget()
        else:
            self.registers.on_other_message(at)
            self.info.on_other_message(at)
