"""What one node id said and answered lately, from what passes by anyway."""

from collections import deque
from collections.abc import Iterable
from typing import Final

from hornbill.units import Instant

ANSWER_WITHIN_S: Final = 0.3
"""An answer that did not come by then, while the node went on talking, is lost."""

GAP_S: Final = 1.0
"""A node that says Status ten times a second and is not heard for so long was away, or restarted."""

_STREAM: Final = 8
_TRANSFER_IDS: Final = 32
_MOST_LOST: Final = 3
"""Messages in a row that a lossy bus may swallow before a counter is taken for another one."""

_SWITCHES: Final = 5
_EACH: Final = 3


def two_counters(transfer_ids: Iterable[int]) -> bool:
    """Whether the transfer ids (0..31, oldest first) of one kind of message come from two nodes in turn.

    Each node counts its own messages, so that two with one node id show two counters, one between the other. A
    restart, loss, or a node that counts in a way of its own does not look like that.
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
    """The last messages of one kind."""

    __slots__ = ("_at", "_ids", "_next", "_odd")

    def __init__(self) -> None:
        self._ids: deque[int] = deque(maxlen=_STREAM)
        self._at: Instant = float("-inf")
        self._next = -1
        self._odd = 0  # so many more messages until the last that did not count on has left

    def take(self, transfer_id: int, at: Instant) -> None:
        """One more message."""
        self._ids.append(transfer_id)
        self._at = at
        self._odd = max(0, self._odd - 1) if transfer_id == self._next else _STREAM
        self._next = (transfer_id + 1) % _TRANSFER_IDS

    def doubled(self, now: Instant, period_s: float) -> bool:
        """Whether two nodes send it now, each every `period_s` seconds."""
        return self._odd > 0 and now - self._at < 3 * period_s and two_counters(self._ids)


class Questions:
    """The requests for one service to one node, and what became of them."""

    __slots__ = ("_given_up", "_open", "answered", "lost", "unanswered", "unanswered_since")

    def __init__(self) -> None:
        self.lost: deque[Instant] = deque(maxlen=256)
        """When requests went out that were not answered although the node was there."""
        self.answered = False
        """Whether any was, ever."""
        self.unanswered = 0
        """How many of the lost ones since the last answer."""
        self.unanswered_since: Instant | None = None
        self._open: dict[int, Instant] = {}
        self._given_up: dict[int, Instant] = {}

    def ask(self, transfer_id: int, at: Instant) -> None:
        """A request went out."""
        self._open[transfer_id] = at

    def answer(self, transfer_id: int) -> None:
        """An answer came, in time or late."""
        if self._open.pop(transfer_id, None) is None and (at := self._given_up.pop(transfer_id, None)) in self.lost:
            self.lost.remove(at)  # it was only late
        self.answered = True
        self.unanswered, self.unanswered_since = 0, None

    def node_is_there(self, now: Instant) -> None:
        """The node said something else: what it has not answered by now is lost."""
        if not self._open:
            return
        due = now - ANSWER_WITHIN_S
        for transfer_id, at in tuple(self._open.items()):
            if at < due:
                del self._open[transfer_id]
                self._given_up[transfer_id] = at
                self.lost.append(at)
                self.unanswered += 1
                self.unanswered_since = at if self.unanswered_since is None else self.unanswered_since

    def forget(self) -> None:
        """The node started anew."""
        self._open.clear()
        self.lost.clear()
        self.unanswered, self.unanswered_since = 0, None


class NodeWatch:
    """One node id."""

    __slots__ = (
        "heard", "info", "node_statuses", "registers", "round_trips", "servo_id", "servo_id_at", "servo_id_since",
        "statuses", "uptime_s",
    )  # fmt: skip

    def __init__(self) -> None:
        self.heard: Instant = float("-inf")
        """When it last broadcast NodeStatus or Status."""
        self.uptime_s = 0
        self.node_statuses = MessageTimes()
        self.statuses = MessageTimes()
        self.servo_id: int | None = None
        """What its Status says; None for a node that says none."""
        self.servo_id_at: Instant = float("-inf")
        self.servo_id_since: Instant = float("-inf")
        """Since when it says so without a gap."""
        self.registers = Questions()
        self.info = Questions()
        self.round_trips: deque[tuple[Instant, float]] = deque(maxlen=100)
        """When answers came, and the seconds each took."""

    def hear_node_status(self, transfer_id: int, uptime_s: int, at: Instant) -> None:
        """One NodeStatus."""
        self.node_statuses.take(transfer_id, at)
        restarted, self.uptime_s = uptime_s < self.uptime_s, uptime_s
        self._hear(at, restarted=restarted or at - self.heard > 3 * GAP_S)

    def hear_status(self, transfer_id: int, servo_id: int, at: Instant) -> None:
        """One Status of an actuator."""
        self.statuses.take(transfer_id, at)
        away = at - self.servo_id_at > GAP_S
        if servo_id != self.servo_id or away:
            self.servo_id_since = at
        self.servo_id, self.servo_id_at = servo_id, at
        self._hear(at, restarted=away)

    def _hear(self, at: Instant, *, restarted: bool) -> None:
        self.heard = at
        if restarted:
            self.registers.forget()
            self.info.forget()
        else:
            self.registers.node_is_there(at)
            self.info.node_is_there(at)
