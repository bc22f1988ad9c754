"""Nodes not known as servos: which of them may be one, and when each is asked again."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from hornbill.domain.note import Note
from hornbill.node.directory import OFFLINE_AFTER_S, NodeRecord
from hornbill.servo.device.requests import RetryPolicy
from hornbill.units import Instant

UNKNOWN_NODE: Final = RetryPolicy(priority=24, timeout_s=0.12, tries=3)
UNKNOWN_ACTUATOR: Final = RetryPolicy(priority=24, timeout_s=0.12, tries=12)
"""For a node that broadcasts the Status of an actuator, as every servo does ten times a second (table 2-2)."""

_REFUSALS_OF_A_STARTING_SERVO: Final = 4
"""Refusals that may come from a servo busy with its start: the fifth comes after 15 s at the earliest."""

_REFUSALS: Final = 4
"""After so many a node that is no actuator is not asked again until it starts anew."""

_NEVER: Final = float("inf")


@dataclass(slots=True)
class _Attempts:
    """What came of asking one node since it appeared or started anew, in rounds of a few tries each.

    `boot_count` is NodeRecord.boot_count at that time; `no_info` rounds got no response to GetNodeInfo, `no_get_set` rounds none
    to GetSet, and in `refused` ones it answered that it has no 0x50.
    """

    boot_count: int | None = None
    no_info: int = 0
    no_get_set: int = 0
    refused: int = 0
    again_at: Instant = float("-inf")

    @property
    def rounds(self) -> int:
        return self.no_info + self.no_get_set + self.refused


class ForeignNodes:
    """Asks nothing itself. A node that does not answer, or is no servo, costs a few requests, ever more rarely.

    A node that broadcasts an actuator's Status may be a servo for as long as it did not refuse 0x50 five
    times; any other is taken for foreign at its first refusal, and asked a few times more in case it was
    busy starting.
    """

    def __init__(self, clock: Callable[[], Instant]) -> None:
        self._clock = clock
        self._attempts: dict[int, _Attempts] = {}
        self._status_at: dict[int, Instant] = {}

    def due(self, record: NodeRecord) -> bool:
        """Whether to ask a node that was just heard."""
        attempts = self._attempts.get(record.node_id)
        if attempts is None or attempts.boot_count not in (None, record.boot_count):
            self._attempts[record.node_id] = _Attempts(record.boot_count)
            return True
        attempts.boot_count = record.boot_count
        return self._clock() >= attempts.again_at

    def retry_policy(self, node_id: int) -> RetryPolicy:
        """How insistently to ask it."""
        return UNKNOWN_ACTUATOR if self.is_actuator(node_id) else UNKNOWN_NODE

    def on_status(self, node_id: int) -> None:
        """A node broadcast the Status of an actuator."""
        if not self.is_actuator(node_id) and (attempts := self._attempts.get(node_id)) is not None:
            attempts.again_at = min(attempts.again_at, self._clock())
        self._status_at[node_id] = self._clock()

    def no_node_info(self, node_id: int) -> None:
        """It did not answer GetNodeInfo."""
        self._of(node_id).no_info += 1
        self._schedule(node_id)

    def no_parameters(self, node_id: int) -> None:
        """It did not answer GetSet, although it answered GetNodeInfo."""
        self._of(node_id).no_get_set += 1
        self._schedule(node_id)

    def refused(self, node_id: int) -> None:
        """It answered that it has no 0x50."""
        self._of(node_id).refused += 1
        self._schedule(node_id)

    def postpone(self, node_id: int, until: Instant) -> None:
        """Ask it no earlier, for a reason of ours."""
        self._of(node_id).again_at = until

    def retry_now(self, node_id: int) -> None:
        """Somebody needs to know now who it is; what is known to be foreign stays so."""
        if (attempts := self._attempts.get(node_id)) is not None:
            attempts.again_at = float("-inf")

    def forget(self, node_id: int) -> None:
        """It is known as a servo now."""
        self._attempts.pop(node_id, None)
        self._status_at.pop(node_id, None)

    def is_actuator(self, node_id: int) -> bool:
        """Whether it broadcasts the Status of an actuator."""
        return self._clock() - self._status_at.get(node_id, float("-inf")) < OFFLINE_AFTER_S

    def is_foreign(self, node_id: int) -> bool:
        """Whether it is known to be no servo of ours."""
        attempts = self._attempts.get(node_id)
        if attempts is None:
            return False
        if self.is_actuator(node_id):
            return attempts.refused > _REFUSALS_OF_A_STARTING_SERVO
        return attempts.refused > 0 or attempts.no_get_set > 0

    def suspects(self) -> list[int]:
        """Nodes that broadcast the Status of an actuator and are not known to be foreign, by node id."""
        return sorted(
            node_id for node_id in self._status_at if self.is_actuator(node_id) and not self.is_foreign(node_id)
        )

    def note(self, node_id: int) -> Note | None:
        """Why a node is not taken for a servo, for people; None while it has not been asked."""
        attempts = self._attempts.get(node_id)
        if attempts is None or not attempts.rounds:
            return None
        if attempts.refused:
            note = Note("It has no model number (0x50), so it is no servo of this family.", "no_model_number")
        elif attempts.no_get_set:
            text = "It answers GetNodeInfo but not GetSet, so it has no parameters that could be read."
            note = Note(text, "no_parameters")
        else:
            text = f"It does not answer GetNodeInfo; it was asked {attempts.no_info} times."
            note = Note(text, "no_info", {"tries": attempts.no_info})
        if self.is_actuator(node_id) and not self.is_foreign(node_id):
            also = " It broadcasts an actuator's status, so it may be a servo: stop writes torque off to it, too."
            return Note(note.text + also, note.code, {**note.params, "may_be_servo": True})
        return note

    def _of(self, node_id: int) -> _Attempts:
        return self._attempts.setdefault(node_id, _Attempts())

    def _schedule(self, node_id: int) -> None:
        attempts = self._of(node_id)
        rounds = min(attempts.rounds, 20) - 1
        if self.is_actuator(node_id):
            delay = min(0.5 * 2**rounds, 300.0 if attempts.refused else 30.0)
        elif attempts.refused >= _REFUSALS:
            delay = _NEVER
        else:
            delay = min(2.0 * 4**rounds, 3600.0)
        attempts.again_at = self._clock() + delay
